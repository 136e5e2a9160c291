//! How far the render is: a bar on a terminal, a line now and then elsewhere.

use crate::log::{Log, Verbosity, duration, quantity};
use hrr::render::observer::{Observer, Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Lines that are not on a terminal come no faster than this.
const BETWEEN_LINES: Duration = Duration::from_secs(2);
/// Steps of the bar.
const STEPS: u64 = 1000;

/// Watches the render for the user, who may stop it.
pub struct Reporter {
    log: Log,
    display: Display,
    stop: AtomicBool,
}

enum Display {
    Nothing,
    Bar(ProgressBar),
    Lines(Mutex<Instant>),
}

impl Reporter {
    pub fn new(log: Log) -> Self {
        let display = if log.verbosity() == Verbosity::Quiet {
            Display::Nothing
        } else if std::io::stderr().is_terminal() && std::env::var_os("TERM").is_none_or(|t| t != "dumb") {
            Display::Bar(bar())
        } else {
            Display::Lines(Mutex::new(Instant::now()))
        };
        Self { log, display, stop: AtomicBool::new(false) }
    }

    /// Asks the render to stop; false when that has been asked before.
    pub fn stop(&self) -> bool {
        !self.stop.swap(true, Ordering::Relaxed)
    }

    /// Prints something without tearing the bar.
    pub fn say(&self, print: impl FnOnce(&Log)) {
        match &self.display {
            Display::Bar(bar) => bar.suspend(|| print(&self.log)),
            _ => print(&self.log),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

impl Observer for Reporter {
    fn progress(&self, progress: &Progress) {
        match &self.display {
            Display::Nothing => {}
            Display::Bar(bar) => {
                bar.set_position((progress.done() * STEPS as f64) as u64);
                bar.set_message(describe(progress));
            }
            Display::Lines(last) => {
                // Whoever does not get the lock is told about by the one who has it.
                if let Ok(mut last) = last.try_lock()
                    && last.elapsed() >= BETWEEN_LINES
                {
                    *last = Instant::now();
                    self.log.info(format_args!("{:3.0} %  {}", 100.0 * progress.done(), describe(progress)));
                }
            }
        }
    }

    fn should_stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn warn(&self, message: &str) {
        self.say(|log| log.warning(message));
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr_with_hz(8));
    // The template is a constant: it parses, or the tests say so.
    if let Ok(style) = ProgressStyle::with_template("[{bar:24}] {percent:>3} %  {msg}") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar
}

/// Iteration, time left and connections, on one line.
fn describe(p: &Progress) -> String {
    let mut text = match p.iterations {
        Some(n) => format!("iteration {} of {n}", (p.iteration + 1).min(n)),
        None => format!("iteration {}", p.iteration + 1),
    };
    text += &format!(", {}", duration(p.elapsed));
    if let Some(remaining) = p.remaining() {
        text += &format!(", {} left", duration(remaining));
    }
    if p.accepted > 0 && p.elapsed > 0.0 {
        text += &format!(", {} connections/s", quantity(p.accepted as f64 / p.elapsed));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_iteration_time_and_connections() {
        let p = Progress {
            iteration: 2,
            iterations: Some(10),
            fraction: 0.5,
            elapsed: 5.0,
            accepted: 6_170_000,
            time_limit: None,
        };
        assert_eq!(describe(&p), "iteration 3 of 10, 5.0 s, 15.0 s left, 1.23 M connections/s");
        let last = Progress { iteration: 10, fraction: 0.0, accepted: 0, ..p };
        assert_eq!(describe(&last), "iteration 10 of 10, 5.0 s, 0.0 s left");
        let timed = Progress { iterations: None, time_limit: Some(8.0), accepted: 0, ..p };
        assert_eq!(describe(&timed), "iteration 3, 5.0 s, 3.0 s left");
    }

    #[test]
    fn the_bar_has_a_style() {
        ProgressStyle::with_template("[{bar:24}] {percent:>3} %  {msg}").unwrap();
    }

    #[test]
    fn only_the_first_request_to_stop_is_the_first() {
        let reporter = Reporter::new(Log::new(Verbosity::Quiet));
        assert!(!reporter.should_stop());
        assert!(reporter.stop());
        assert!(!reporter.stop());
        assert!(reporter.should_stop());
    }
}
