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
    /// What the relative error is below of, with 90 % confidence; `None` before it can be told.
    pub error: Option<f64>,
    /// The error that ends the render.
    pub target: Option<f64>,
    /// Connections that the roulette or the uniform picks accepted so far.
    pub accepted: u64,
}

impl Progress {
    /// How much of the whole render is done, 0..=1.
    pub fn done(&self) -> f64 {
        let by_iterations =
            self.iterations.map(|n| (self.iteration as f64 + self.fraction) / n.max(1) as f64);
        let by_time = self.time_limit.map(|limit| self.elapsed / limit.max(1e-9));
        let parts = [by_iterations, by_time, self.by_error()];
        parts.into_iter().flatten().fold(0.0, f64::max).clamp(0.0, 1.0)
    }

    /// How much of the way to the wanted error is done: noise falls with the root of time.
    fn by_error(&self) -> Option<f64> {
        self.error.zip(self.target).map(|(error, target)| (target / error.max(1e-300)).powi(2).min(1.0))
    }

    /// Seconds that the rest will take if it goes on like this; `None` before anything can be said.
    pub fn remaining(&self) -> Option<f64> {
        let until_limit = self.time_limit.map(|limit| (limit - self.elapsed).max(0.0));
        let after = |done: f64| (self.elapsed > 0.0 && done > 0.0).then(|| self.elapsed * (1.0 / done - 1.0));
        match (self.iterations, until_limit, self.by_error().and_then(after)) {
            (None, Some(limit), Some(error)) => Some(limit.min(error)),
            (None, Some(limit), None) => Some(limit),
            (None, None, error) => error,
            _ => after(self.done()),
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

    /// Twice the wanted error after 2 s: four times that in all, unless time is up before.
    #[test]
    fn the_error_tells_what_is_left() {
        let p = Progress { elapsed: 2.0, error: Some(0.02), target: Some(0.01), ..Progress::default() };
        assert_eq!((p.done(), p.remaining()), (0.25, Some(6.0)));
        let limited = Progress { time_limit: Some(4.0), ..p };
        assert_eq!((limited.done(), limited.remaining()), (0.5, Some(2.0)));
        let early = Progress { error: None, ..p };
        assert_eq!((early.done(), early.remaining()), (0.0, None));
    }

    #[test]
    fn nothing_is_claimed_at_the_start() {
        let p = Progress { iterations: Some(4), ..Progress::default() };
        assert_eq!((p.done(), p.remaining()), (0.0, None));
    }
}
