//! Ctrl-C: training stops at its next step, all else at once, and nothing half-written is left.

use std::sync::atomic::{AtomicBool, Ordering};

use super::progress::say;

/// Exit code of a program that Ctrl-C ended: 128 + SIGINT, as shells report it.
const ABORTED: i32 = 130;

/// Whether something trains.
static IS_TRAINING: AtomicBool = AtomicBool::new(false);
/// Whether training was asked to stop.
static STOP: AtomicBool = AtomicBool::new(false);

/// Takes Ctrl-C over for the rest of the process.
pub(super) fn listen() {
    let handler = || {
        if !IS_TRAINING.load(Ordering::SeqCst) {
            lgs_data::abandon();
            say("interrupted; nothing half-written is left");
            std::process::exit(ABORTED);
        }
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(ABORTED);
        }
        say("stopping at the next step; Ctrl-C again aborts without a checkpoint");
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        tracing::warn!("Ctrl-C will not leave a checkpoint, nor tidy up: {error}");
    }
}

/// Whether Ctrl-C was pressed while something trained.
pub(super) fn is_stopping() -> bool {
    STOP.load(Ordering::SeqCst)
}

/// Training, which Ctrl-C stops at its next step for as long as this lives.
pub(super) struct Training(());

impl Training {
    pub(super) fn begin() -> Self {
        IS_TRAINING.store(true, Ordering::SeqCst);
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
