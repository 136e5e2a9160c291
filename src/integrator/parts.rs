//! The parts that an iteration's eye samples are taken in, so that it ends in time.

use std::time::Instant;

/// One of the equal parts that an iteration's eye samples are taken in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// Its number.
    pub index: u32,
    /// How many there were to be.
    pub of: u32,
    /// What it counts for, of the iteration.
    pub share: f64,
}

impl Part {
    /// All samples at once.
    pub const ALL: Self = Self { index: 0, of: 1, share: 1.0 };

    /// Which of a pixel's samples belong to it: one at least. There is no end to them, should there be more parts.
    pub fn range(&self, samples: u32) -> std::ops::Range<u32> {
        let bound = |index: u32| (u64::from(samples) * u64::from(index) / u64::from(self.of)) as u32;
        bound(self.index)..bound(self.index + 1).max(bound(self.index) + 1)
    }
}

/// Parts of an eye pass that must end in time, and samples in each at least.
pub(super) const PARTS: u32 = 8;
pub(super) const LEAST_SAMPLES: u32 = 4;

/// The parts that the eye samples of an iteration are taken in. When half of them are done, what these took tells how many
/// more there is time for; these then count for the other half.
pub(super) struct Parts {
    of: u32,
    done: u32,
    /// How many there are, as far as is known.
    pub end: u32,
    start: Instant,
}

impl Parts {
    /// As many as that, if there is time.
    pub fn new(of: u32) -> Self {
        Self { of, done: 0, end: of, start: Instant::now() }
    }

    /// The next one, if there is one.
    pub fn next(&mut self, deadline: Option<Instant>) -> Option<Part> {
        let (half, index) = (self.of / 2, self.done);
        if half > 0
            && index == half
            && let Some(deadline) = deadline
        {
            let each = self.start.elapsed().as_secs_f64() / f64::from(half);
            let left = deadline.saturating_duration_since(Instant::now()).as_secs_f64();
            self.end = half + ((left / each).round() as u32).clamp(1, 2 * (self.of - half));
        }
        if index == self.end {
            return None;
        }
        self.done += 1;
        let planned = if index < half { 1 } else { self.of - half };
        let taken = if index < half { 1 } else { self.end - half };
        Some(Part { index, of: self.of, share: f64::from(planned) / f64::from(self.of) / f64::from(taken) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn parts_count_as_a_whole_however_many_there_is_time_for() {
        for of in [1, 2, 3, 8, 13] {
            let soon = Some(Instant::now());
            let late = Some(Instant::now() + Duration::from_secs(1000));
            let half = of / 2;
            let rest = |least: u32| if half == 0 { of } else { half + least };
            for (deadline, count) in [(None, of), (soon, rest(1)), (late, rest(2 * (of - half)))] {
                let (mut parts, mut shares, mut indices) = (Parts::new(of), 0.0, Vec::new());
                while let Some(part) = parts.next(deadline) {
                    shares += part.share;
                    indices.push(part.index);
                }
                assert!((shares - 1.0).abs() < 1e-12, "{of}: {shares}");
                assert_eq!(indices, (0..count).collect::<Vec<_>>(), "{of}");
            }
        }
    }
}
