//! Ctrl-C, and on Unix a hang-up and a request to end: training stops at its next step, all else at once, and
//! nothing half-written is left. A signal that the program was started to ignore, as by `nohup`, stays so,
//! but for Ctrl-C in training.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::output::kept_text;
use super::progress::say;

/// Added to the number of a signal it is the exit code that shells report.
const ENDED_BY: i32 = 128;
/// Number of the signal that Ctrl-C sends.
const CTRL_C: i32 = 2;

/// Whether something trains.
static IS_TRAINING: AtomicBool = AtomicBool::new(false);
/// Whether training was asked to stop.
static STOP: AtomicBool = AtomicBool::new(false);

/// Takes Ctrl-C over for the rest of the process.
pub(super) fn listen() {
    if let Err(error) = on_interrupt(stop_or_end) {
        tracing::warn!("Ctrl-C will not leave a checkpoint, nor tidy up: {error}");
    }
}

/// Lets training stop where it may go on from; ends the program otherwise, or if it is asked again.
fn stop_or_end(code: i32) {
    if IS_TRAINING.load(Ordering::SeqCst) && !STOP.swap(true, Ordering::SeqCst) {
        return say("stopping at the next step; Ctrl-C again aborts without a checkpoint");
    }
    say(&told(&lgs_data::abandon()));
    std::process::exit(code);
}

/// Calls `handler` with the exit code that a shell would report, each time that the program is asked to end.
pub(super) fn on_interrupt(handler: impl Fn(i32) + Send + Sync + 'static) -> io::Result<()> {
    let handler = Arc::new(handler);
    #[cfg(unix)]
    signals::on_end({
        let handler = Arc::clone(&handler);
        move |signal| handler(ENDED_BY + signal)
    })?;
    match ctrlc::try_set_handler(move || handler(ENDED_BY + CTRL_C)) {
        // It is ignored.
        Ok(()) | Err(ctrlc::Error::MultipleHandlers) => Ok(()),
        Err(error) => Err(io::Error::other(error)),
    }
}

/// What became of files under way.
fn told(abandoned: &lgs_data::Abandoned) -> String {
    let left = abandoned.left.iter().map(|path| format!("could not remove {}", path.display()));
    let stuck = abandoned.is_writing.then(|| "a file that is being written may be left as it is".to_owned());
    let parts: Vec<String> = abandoned.kept.iter().map(kept_text).chain(left).chain(stuck).collect();
    if parts.is_empty() {
        return "interrupted; nothing half-written is left".to_owned();
    }
    format!("interrupted; {}", parts.join(", "))
}

/// Whether Ctrl-C was pressed while something trained.
pub(super) fn is_stopping() -> bool {
    STOP.load(Ordering::SeqCst)
}

/// Training, which Ctrl-C stops at its next step for as long as this lives.
pub(super) struct Training(());

impl Training {
    /// Takes Ctrl-C even if the program was started to ignore it, as scripts start what runs behind them: a
    /// training that stops loses nothing.
    pub(super) fn begin() -> Self {
        IS_TRAINING.store(true, Ordering::SeqCst);
        match ctrlc::set_handler(|| stop_or_end(ENDED_BY + CTRL_C)) {
            // It was taken at the start.
            Ok(()) | Err(ctrlc::Error::MultipleHandlers) => {}
            Err(error) => tracing::warn!("Ctrl-C will not leave a checkpoint: {error}"),
        }
        Self(())
    }

    /// The flag that Ctrl-C raises.
    pub(super) fn stop(&self) -> &'static AtomicBool {
        &STOP
    }
}

impl Drop for Training {
    fn drop(&mut self) {
        IS_TRAINING.store(false, Ordering::SeqCst);
    }
}

/// Signals of Unix beside that of Ctrl-C.
#[cfg(unix)]
mod signals {
    use std::io;

    use signal_hook::consts::{SIGHUP, SIGTERM};
    use signal_hook::iterator::Signals;

    /// Calls `handler` with every signal that asks the program to end, from a thread of its own.
    pub(super) fn on_end(handler: impl Fn(i32) + Send + 'static) -> io::Result<()> {
        let ignored = ignored(&std::fs::read_to_string("/proc/self/status").unwrap_or_default());
        let taken = [SIGTERM, SIGHUP].into_iter().filter(|&signal| ignored >> (signal - 1) & 1 == 0);
        let mut signals = Signals::new(taken)?;
        let listen = move || signals.forever().for_each(handler);
        std::thread::Builder::new().name("signals".to_owned()).spawn(listen).map(drop)
    }

    /// A bit for every signal that is ignored, by what Linux says of a process. Where nothing is said a
    /// hang-up may be ignored, and then the program must not end with it: it is left as it is.
    fn ignored(status: &str) -> u64 {
        let line = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        let mask = line.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        mask.unwrap_or(1 << (SIGHUP - 1))
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn a_hang_up_is_ignored_where_that_is_said_or_nothing() {
            assert_eq!(ignored("Name:\tx\nSigIgn:\t0000000000001001\nSigCgt:\t0\n"), 0x1001);
            assert_eq!(ignored("SigIgn:\t0000000000001000\n") & 1, 0);
            assert_eq!(ignored(""), 1);
        }
    }
}
