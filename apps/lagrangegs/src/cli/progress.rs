//! Progress bars and logs, both on stderr, without writing over each other.
//!
//! Where stderr is no terminal the bars are silent and a long task logs a line every ten seconds instead.
//! `RUST_LOG` chooses what is logged.

use std::collections::BTreeSet;
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressStyle};
use tracing_subscriber::fmt::MakeWriter;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Layer};

use super::profile::Profile;
use super::thresholds::LOG_INTERVAL_SECS;

fn bars() -> &'static MultiProgress {
    static BARS: OnceLock<MultiProgress> = OnceLock::new();
    BARS.get_or_init(MultiProgress::new)
}

/// Starts logging to stderr, and measuring if a profile is given.
pub(crate) fn start_logs(profile: Option<&Profile>) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    let logs = tracing_subscriber::fmt::layer().with_target(false).without_time();
    let logs = logs.with_ansi(std::io::stderr().is_terminal()).with_writer(BetweenBars).with_filter(filter);
    // Fails only if a log is set up already, as when a program calls the command line twice.
    let _ = tracing_subscriber::registry().with(logs).with(profile.map(Profile::layer)).try_init();
}

/// One line to stderr.
pub(crate) fn say(line: &str) {
    bars().suspend(|| {
        let _ = writeln!(std::io::stderr(), "{line}");
    });
}

/// A warning that is not repeated.
pub(crate) fn warn_once(warning: &str) {
    static GIVEN: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    if GIVEN.lock().unwrap_or_else(PoisonError::into_inner).insert(warning.to_owned()) {
        tracing::warn!("{warning}");
    }
}

/// Writes log lines with the bars out of the way.
struct BetweenBars;

impl Write for BetweenBars {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        bars().suspend(|| std::io::stderr().write_all(bytes))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        std::io::stderr().flush()
    }
}

impl MakeWriter<'_> for BetweenBars {
    type Writer = Self;

    fn make_writer(&self) -> Self {
        Self
    }
}

/// A task with a known number of steps.
pub(crate) struct Task {
    name: String,
    bar: ProgressBar,
    begun: Instant,
    lines: AtomicU64,
}

impl Task {
    /// Shows a bar; `total` may be corrected later.
    pub(crate) fn new(name: &str, total: u64) -> Self {
        let style = ProgressStyle::with_template("{prefix:16} [{bar:30}] {pos}/{len} eta {eta} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .progress_chars("=> ");
        let bar = bars().add(ProgressBar::new(total).with_style(style).with_prefix(name.to_owned()));
        bar.enable_steady_tick(Duration::from_millis(500));
        Self { name: name.to_owned(), bar, begun: Instant::now(), lines: AtomicU64::new(0) }
    }

    /// Sets how much is done; may be called from any thread.
    pub(crate) fn set(&self, done: u64, total: u64, message: impl FnOnce() -> String) {
        self.bar.set_length(total);
        if self.bar.is_hidden() {
            let due = self.begun.elapsed().as_secs() / LOG_INTERVAL_SECS;
            if self.lines.fetch_max(due, Ordering::Relaxed) < due {
                let left = time_left(self.begun.elapsed(), done, total);
                tracing::info!("{}: {done}/{total}, {left} {}", self.name, message());
            }
        } else {
            self.bar.set_position(self.bar.position().max(done));
            self.bar.set_message(message());
        }
    }

    /// Sets how much is done, without a message.
    pub(crate) fn count(&self, done: usize, total: usize) {
        self.set(done as u64, total as u64, String::new);
    }
}

/// How long a task will take yet, if it goes on as it did.
fn time_left(elapsed: Duration, done: u64, total: u64) -> String {
    let secs = elapsed.as_secs_f64() * total.saturating_sub(done) as f64 / done.max(1) as f64;
    format!("eta {}", HumanDuration(Duration::from_secs_f64(secs.min(1e9))))
}

impl Drop for Task {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        bars().remove(&self.bar);
    }
}
