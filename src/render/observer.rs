//! Whoever watches a render: is told how far it is, and may stop it.

/// How far a render is. All seconds are wall-clock time since it started.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Progress {
    /// Iterations that are finished.
    pub iteration: u64,
    /// Iterations that are to be run; `None` when time decides.
    pub iterations: Option<u64>,
    /// How much of the present iteration is done, 0..=1.
    pub fraction: f64,
    /// Seconds so far.
    pub elapsed: f64,
    /// Seconds after which no iteration is begun; `None` when their number decides.
    pub time_limit: Option<f64>,
    /// Connections that the roulette or the uniform picks accepted so far.
    pub accepted: u64,
}

impl Progress {
    /// How much of the whole render is done, 0..=1.
    pub fn done(&self) -> f64 {
        let by_iterations =
            self.iterations.map(|n| (self.iteration as f64 + self.fraction) / n.max(1) as f64);
        let by_time = self.time_limit.map(|limit| self.elapsed / limit.max(1e-9));
        by_iterations.unwrap_or(0.0).max(by_time.unwrap_or(0.0)).clamp(0.0, 1.0)
    }

    /// Seconds that the rest will take if it goes on like this; `None` before anything can be said.
    pub fn remaining(&self) -> Option<f64> {
        match (self.iterations, self.time_limit) {
            (None, Some(limit)) => Some((limit - self.elapsed).max(0.0)),
            _ if self.elapsed > 0.0 && self.done() > 0.0 => Some(self.elapsed * (1.0 / self.done() - 1.0)),
            _ => None,
        }
    }
}

/// Watches a render. Any thread may call, at any time and at once.
pub trait Observer: Sync {
    /// Called a few times a second, or less often.
    fn progress(&self, progress: &Progress);

    /// Asked between iterations; true ends the render with what there is.
    fn should_stop(&self) -> bool;

    /// Something that the user should know: one sentence.
    fn warn(&self, message: &str);
}

/// Watches nothing and stops nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn progress(&self, _: &Progress) {}

    fn should_stop(&self) -> bool {
        false
    }

    fn warn(&self, _: &str) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn iterations_tell_what_is_left() {
        let p = Progress {
            iteration: 2,
            iterations: Some(10),
            fraction: 0.5,
            elapsed: 5.0,
            ..Progress::default()
        };
        assert_eq!(p.done(), 0.25);
        assert_eq!(p.remaining(), Some(15.0));
    }

    #[test]
    fn time_tells_what_is_left() {
        let p = Progress { iteration: 7, elapsed: 6.0, time_limit: Some(8.0), ..Progress::default() };
        assert_eq!((p.done(), p.remaining()), (0.75, Some(2.0)));
        let late = Progress { elapsed: 9.0, ..p };
        assert_eq!((late.done(), late.remaining()), (1.0, Some(0.0)));
    }

    #[test]
    fn nothing_is_claimed_at_the_start() {
        let p = Progress { iterations: Some(4), ..Progress::default() };
        assert_eq!((p.done(), p.remaining()), (0.0, None));
    }
}
