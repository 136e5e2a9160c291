//! The program `hrr`: renders scenes from the command line, and says what they call for. Data goes to stdout, everything else to stderr.

mod args;
mod backends;
mod compare;
mod cost;
mod effects;
mod log;
mod pilot;
mod predict;
mod progress;
mod reference;
mod render;
mod scene_args;
mod sweep;

use args::Command;
use log::{Log, Verbosity};
use std::backtrace::{Backtrace, BacktraceStatus};
use std::io::Write;
use std::panic::{self, PanicHookInfo, UnwindSafe};
use std::process::ExitCode;

/// A fault of the program itself, as in BSD's `sysexits.h`.
const INTERNAL: u8 = 70;

fn main() -> ExitCode {
    panic::set_hook(Box::new(report_panic));
    ExitCode::from(guard(run))
}

/// Does what the command line says; returns the exit code.
fn run() -> u8 {
    let command = match args::parse(std::env::args_os()) {
        Ok(command) => command,
        Err(e) => return args::explain(&e),
    };
    let (log, result) = match command {
        Command::Render(args) => {
            let log = Log::new(args.verbosity);
            (log, render::run(&args, &log))
        }
        Command::Effects(args) => {
            let log = Log::new(args.verbosity);
            (log, effects::run(&args, &log))
        }
        Command::Compare(args) => (Log::new(Verbosity::Normal), compare::run(&args)),
        Command::Reference(args) => {
            let log = Log::new(args.verbosity);
            (log, reference::run(&args, &log))
        }
        Command::Backends(args) => {
            let log = Log::new(args.verbosity);
            (log, backends::run(&args, &log))
        }
        Command::Cost(args) => {
            let log = Log::new(args.verbosity);
            (log, cost::run(&args, &log))
        }
        Command::Predict(args) => {
            let log = Log::new(args.verbosity);
            (log, predict::run(&args, &log))
        }
    };
    result.unwrap_or_else(|error| {
        log.error(&error);
        error.exit_code()
    })
}

/// A panic ends the program in an orderly way, with its own exit code.
fn guard(work: impl FnOnce() -> u8 + UnwindSafe) -> u8 {
    panic::catch_unwind(work).unwrap_or(INTERNAL)
}

fn report_panic(info: &PanicHookInfo<'_>) {
    let what = info.payload_as_str().unwrap_or("unknown");
    let place = info.location().map(|l| format!(" ({}:{})", l.file(), l.line())).unwrap_or_default();
    let mut err = std::io::stderr().lock();
    // Nobody is left to tell when stderr is closed.
    let _ = writeln!(err, "hrr: internal error: {what}{place}\n     {}", log::BUG);
    let trace = Backtrace::capture();
    if trace.status() == BacktraceStatus::Captured {
        let _ = writeln!(err, "{trace}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_exit_code_70() {
        assert_eq!(guard(|| 3), 3);
        assert_eq!(guard(|| panic!("on purpose")), 70);
    }
}
