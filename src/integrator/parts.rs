//! The parts that an iteration's eye samples are taken in, so that it ends in time.

use std::time::Instant;

/// One of the equal parts that an iteration's eye samples are taken in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// Its number.
    pub index: u32,
    /// How many there were to be.
    pub of: u32,
}

impl Part {
    /// All samples at once.
    pub const ALL: Self = Self { index: 0, of: 1 };

    /// Which of a pixel's samples belong to it: one at least. There is no end to them, should there be more parts.
    pub fn range(&self, samples: u32) -> std::ops::Range<u32> {
        let bound = |index: u32| (u64::from(samples) * u64::from(index) / u64::from(self.of)) as u32;
        bound(self.index)..bound(self.index + 1).max(bound(self.index) + 1)
    }
}

/// Parts of an eye pass that must end in time, and samples in each at least.
pub(super) const PARTS: u32 = 8;
pub(super) const LEAST_SAMPLES: u32 = 2;
/// Parts that are taken while there is time, over those that were to be.
const MOST: u32 = 4;

/// The parts that the eye samples of an iteration are taken in: as many as there is time for.
pub(super) struct Parts {
    of: u32,
    /// How many were taken.
    pub done: u32,
    /// How many there will be, as far as is known.
    pub end: u32,
    start: Instant,
}

impl Parts {
    /// As many as that, unless there is a deadline.
    pub fn new(of: u32) -> Self {
        Self { of, done: 0, end: of, start: Instant::now() }
    }

    /// The next one, if there is one.
    pub fn next(&mut self, deadline: Option<Instant>) -> Option<Part> {
        let index = self.done;
        if index > 0
            && let Some(deadline) = deadline
        {
            let each = self.start.elapsed().as_secs_f64() / f64::from(index);
            let left = deadline.saturating_duration_since(Instant::now()).as_secs_f64();
            let most = MOST * self.of;
            self.end = most.min(index + (left / each).round().min(f64::from(most)) as u32);
        }
        if index == self.end {
            return None;
        }
        self.done += 1;
        Some(Part { index, of: self.of })
    }

    /// What the parts that were taken count for, over the iteration that they are to be.
    pub fn scale(&self) -> f64 {
        f64::from(self.of) / f64::from(self.done)
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
            for (deadline, count) in [(None, of), (soon, 1), (late, MOST * of)] {
                let (mut parts, mut indices) = (Parts::new(of), Vec::new());
                while let Some(part) = parts.next(deadline) {
                    assert_eq!(part.of, of);
                    indices.push(part.index);
                }
                assert_eq!(indices, (0..count).collect::<Vec<_>>(), "{of}");
                assert_eq!(parts.scale() * f64::from(count), f64::from(of));
            }
        }
    }
}
