//! What the user is told, on stderr.

use hrr::Error;
use std::fmt::Display;
use std::io::Write;

/// How much is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors only.
    Quiet,
    /// Progress, warnings, and where the image is.
    Normal,
    /// Also what was done and how long it took.
    Verbose,
}

/// What to do about a fault of the program.
pub const BUG: &str = "this is a bug in hrr; please report it, with the command line and the scene";

/// Writes lines to stderr, each beginning with the program's name.
#[derive(Debug, Clone, Copy)]
pub struct Log {
    verbosity: Verbosity,
}

impl Log {
    pub fn new(verbosity: Verbosity) -> Self {
        Self { verbosity }
    }

    pub fn verbosity(&self) -> Verbosity {
        self.verbosity
    }

    pub fn error(&self, error: &Error) {
        line(format_args!("hrr: {error}"));
        if let Some(hint) = hint(error) {
            line(format_args!("     {hint}"));
        }
    }

    pub fn warning(&self, message: impl Display) {
        if self.verbosity >= Verbosity::Normal {
            line(format_args!("hrr: warning: {message}"));
        }
    }

    pub fn info(&self, message: impl Display) {
        if self.verbosity >= Verbosity::Normal {
            line(format_args!("hrr: {message}"));
        }
    }

    pub fn detail(&self, message: impl Display) {
        if self.verbosity >= Verbosity::Verbose {
            line(format_args!("hrr: {message}"));
        }
    }
}

/// A closed stderr is no reason to stop.
fn line(text: impl Display) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// What the user may do about an error.
fn hint(error: &Error) -> Option<&'static str> {
    match error {
        Error::Usage(_) => Some("'hrr render --help' tells all flags and their values"),
        Error::Output { .. } => Some("choose another file, or make its directory writable"),
        Error::Memory(_) => Some("a smaller --size or fewer --light-subpaths need less"),
        Error::Internal(_) => Some(BUG),
        _ => None,
    }
}

/// Seconds as one reads them: `12.3 s`, `3 min 05 s`, `2 h 03 min`.
pub fn duration(seconds: f64) -> String {
    // From here on tenths would be rounded up to 60.0 s.
    if seconds < 59.95 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round() as u64;
    if whole < 3600 {
        format!("{} min {:02} s", whole / 60, whole % 60)
    } else {
        format!("{} h {:02} min", whole / 3600, whole / 60 % 60)
    }
}

/// A share of one as one reads it, to two digits: `2.3 %`, `0.12 %`.
pub fn percent(share: f64) -> String {
    let p = 100.0 * share;
    if !(p > 0.0 && p < 1e6) {
        return format!("{p} %");
    }
    let decimals = (1 - p.log10().floor() as i32).max(0) as usize;
    format!("{p:.decimals$} %")
}

/// A large number as one reads it: three digits and a prefix.
pub fn quantity(x: f64) -> String {
    let (value, prefix) = match x {
        x if x < 999.5 => return format!("{x:.0}"),
        x if x < 999.5e3 => (x / 1e3, "k"),
        x if x < 999.5e6 => (x / 1e6, "M"),
        x => (x / 1e9, "G"),
    };
    let decimals = if value < 9.995 { 2 } else { usize::from(value < 99.95) };
    format!("{value:.decimals$} {prefix}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_never_show_sixty() {
        let all = [0.04, 59.94, 59.96, 185.4, 3599.4, 3599.6, 7380.0].map(duration);
        assert_eq!(
            all,
            ["0.0 s", "59.9 s", "1 min 00 s", "3 min 05 s", "59 min 59 s", "1 h 00 min", "2 h 03 min"]
        );
    }

    #[test]
    fn percents_have_two_digits() {
        let all = [0.0, 0.0234, 0.00123, 0.25, 1.5, f64::NAN].map(percent);
        assert_eq!(all, ["0 %", "2.3 %", "0.12 %", "25 %", "150 %", "NaN %"]);
    }

    #[test]
    fn quantities_have_three_digits() {
        let all = [0.0, 999.0, 999.6, 1234.0, 12_345.0, 999_499.0, 999_600.0, 5.678e9].map(quantity);
        assert_eq!(all, ["0", "999", "1.00 k", "1.23 k", "12.3 k", "999 k", "1.00 M", "5.68 G"]);
    }
}
