//! How far the render is: a bar on a terminal, a line now and then elsewhere.

use crate::log::{Log, Verbosity, duration, percent, quantity};
use hrr::render::observer::{Observer, Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Lines that are not on a terminal come no faster than this.
const BETWEEN_LINES: Duration = Duration::from_secs(2);
/// The bar and the line after it, cut to the width of the terminal.
const TEMPLATE: &str = "[{bar:16}] {percent:>3} %  {wide_msg}";
/// Steps of the bar.
const STEPS: u64 = 1000;

/// Watches the render for the user, who may stop it.
pub struct Reporter {
    log: Log,
    display: Display,
    rate: Mutex<Rate>,
    stop: AtomicBool,
}

/// Accepted connections per second, as of the last time that their number grew: it does so in large steps.
#[derive(Default)]
struct Rate {
    accepted: u64,
    per_second: Option<f64>,
}

impl Rate {
    fn update(&mut self, p: &Progress) -> Option<f64> {
        if p.accepted > self.accepted && p.elapsed > 0.0 {
            self.accepted = p.accepted;
            self.per_second = Some(p.accepted as f64 / p.elapsed);
        }
        self.per_second
    }
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
        Self { log, display, rate: Mutex::default(), stop: AtomicBool::new(false) }
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
        // Whoever does not get the lock is told about by the one who has it.
        let Ok(mut rate) = self.rate.try_lock() else { return };
        let rate = rate.update(progress);
        match &self.display {
            Display::Nothing => {}
            Display::Bar(bar) => {
                bar.set_position((progress.done() * STEPS as f64) as u64);
                bar.set_message(describe(progress, rate));
            }
            Display::Lines(last) => {
                if let Ok(mut last) = last.try_lock()
                    && last.elapsed() >= BETWEEN_LINES
                {
                    *last = Instant::now();
                    self.log.info(format_args!(
                        "{:3.0} %  {}",
                        100.0 * progress.done(),
                        describe(progress, rate)
                    ));
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
    if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar
}

/// Iteration, time left and connections, on one line.
fn describe(p: &Progress, rate: Option<f64>) -> String {
    let mut text = match p.iterations {
        Some(n) => format!("iteration {} of {n}", (p.iteration + 1).min(n)),
        None => format!("iteration {}", p.iteration + 1),
    };
    text += &format!(", {}", duration(p.elapsed));
    if let Some(remaining) = p.remaining() {
        text += &format!(", {} left", duration(remaining));
    }
    if let Some(error) = p.error {
        text += &format!(", error {}", percent(error));
    }
    if let Some(rate) = rate {
        text += &format!(", {} connections/s", quantity(rate));
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
            ..Progress::default()
        };
        assert_eq!(
            describe(&p, Some(1.234e6)),
            "iteration 3 of 10, 5.0 s, 15.0 s left, 1.23 M connections/s"
        );
        let last = Progress { iteration: 10, fraction: 0.0, ..p };
        assert_eq!(describe(&last, None), "iteration 10 of 10, 5.0 s, 0.0 s left");
        let known = Progress { error: Some(0.0234), ..last };
        assert_eq!(describe(&known, None), "iteration 10 of 10, 5.0 s, 0.0 s left, error 2.3 %");
        let timed = Progress { iterations: None, time_limit: Some(8.0), ..p };
        assert_eq!(describe(&timed, None), "iteration 3, 5.0 s, 3.0 s left");
    }

    #[test]
    fn the_rate_holds_between_steps() {
        let mut rate = Rate::default();
        let at = |elapsed, accepted| Progress { elapsed, accepted, ..Progress::default() };
        let seen =
            [(0.5, 0), (1.0, 0), (2.0, 600), (3.0, 600), (4.0, 2000)].map(|(t, n)| rate.update(&at(t, n)));
        assert_eq!(seen, [None, None, Some(300.0), Some(300.0), Some(500.0)]);
    }

    #[test]
    fn the_bar_has_a_style() {
        ProgressStyle::with_template(TEMPLATE).unwrap();
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
