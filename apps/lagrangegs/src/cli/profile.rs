//! `--profile`: where the time went, as a tree of the spans that operations open.
//!
//! Without the flag no subscriber asks for spans, and opening one costs a load and a branch.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tracing::span::Id;
use tracing::{Metadata, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::filter_fn;
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;

/// Names from the outermost span to the innermost.
type Path = Vec<&'static str>;

/// Visits and time of one path.
#[derive(Clone, Copy, Debug, Default)]
struct Spent {
    count: u64,
    total: Duration,
}

/// Spent time by path; clones share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Profile {
    spent: Arc<Mutex<BTreeMap<Path, Spent>>>,
}

thread_local! {
    /// Open spans of this thread: what their paths are and when they were entered.
    static OPEN: RefCell<Vec<(&'static str, Instant)>> = const { RefCell::new(Vec::new()) };
}

/// The layer that fills a profile. Spans are synchronous here: entered and left once, on one thread,
/// innermost first.
pub(crate) struct ProfileLayer(Profile);

impl<S: Subscriber + for<'a> LookupSpan<'a>> Layer<S> for ProfileLayer {
    fn on_enter(&self, id: &Id, context: Context<'_, S>) {
        if let Some(metadata) = context.metadata(id) {
            OPEN.with_borrow_mut(|open| open.push((metadata.name(), Instant::now())));
        }
    }

    fn on_exit(&self, _id: &Id, _context: Context<'_, S>) {
        let left = OPEN.with_borrow_mut(|open| {
            let path: Path = open.iter().map(|(name, _)| *name).collect();
            open.pop().map(|(_, begun)| (path, begun.elapsed()))
        });
        if let Some((path, elapsed)) = left {
            let mut spent = self.0.spent.lock().unwrap_or_else(PoisonError::into_inner);
            let entry = spent.entry(path).or_default();
            entry.count += 1;
            entry.total += elapsed;
        }
    }
}

/// Spans of this program's own crates.
fn own_spans(metadata: &Metadata<'_>) -> bool {
    metadata.is_span()
        && (metadata.target().starts_with("lgs_") || metadata.target().starts_with("lagrangegs"))
}

impl Profile {
    /// A layer that fills this profile, with the filter that lets it see what it needs.
    pub(crate) fn layer<S: Subscriber + for<'a> LookupSpan<'a>>(&self) -> impl Layer<S> + use<S> {
        ProfileLayer(self.clone()).with_filter(filter_fn(own_spans))
    }

    /// The tree: time, share of the parent's time, visits and time per visit; what a span does itself is
    /// listed as `(other)`.
    pub(crate) fn table(&self, wall: Duration) -> String {
        let spent = self.spent.lock().unwrap_or_else(PoisonError::into_inner);
        let mut out = format!(
            "{:<48} {:>9} {:>7} {:>9} {:>11}\n",
            "where the time went", "seconds", "share", "count", "ms each"
        );
        rows(&spent, &Vec::new(), wall, &mut out);
        out
    }
}

/// Appends the rows below `parent`, the most expensive first.
fn rows(spent: &BTreeMap<Path, Spent>, parent: &Path, whole: Duration, out: &mut String) {
    let mut children: Vec<(&Path, &Spent)> =
        spent.iter().filter(|(p, _)| p.len() == parent.len() + 1 && p.starts_with(parent)).collect();
    children.sort_by_key(|(_, s)| std::cmp::Reverse(s.total));
    if children.is_empty() {
        return;
    }
    let share = |time: Duration| 100.0 * time.as_secs_f64() / whole.as_secs_f64().max(1e-9);
    let indent = 2 * parent.len();
    for (path, s) in &children {
        let (name, secs) = (path.last().copied().unwrap_or_default(), s.total.as_secs_f64());
        let each = 1e3 * secs / s.count.max(1) as f64;
        let label = format!("{:indent$}{name}", "");
        let _ = writeln!(out, "{label:<48} {secs:>9.2} {:>6.1}% {:>9} {each:>11.3}", share(s.total), s.count);
        rows(spent, path, s.total, out);
    }
    let inside: Duration = children.iter().map(|(_, s)| s.total).sum();
    let other = whole.saturating_sub(inside);
    let label = format!("{:indent$}(other)", "");
    let _ = writeln!(out, "{label:<48} {:>9.2} {:>6.1}%", other.as_secs_f64(), share(other));
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing_subscriber::layer::SubscriberExt;

    #[test]
    fn spans_become_a_tree_with_counts() {
        let profile = Profile::default();
        tracing::subscriber::with_default(tracing_subscriber::registry().with(profile.layer()), || {
            for _ in 0..3 {
                let _outer = tracing::trace_span!("outer").entered();
                tracing::trace_span!("inner").in_scope(|| std::thread::sleep(Duration::from_millis(2)));
            }
        });
        let table = profile.table(Duration::from_secs(1));
        let lines: Vec<Vec<&str>> = table.lines().map(|l| l.split_whitespace().collect()).collect();
        assert_eq!(
            lines.iter().map(|l| l[0]).collect::<Vec<_>>(),
            ["where", "outer", "inner", "(other)", "(other)"],
            "{table}"
        );
        assert_eq!((lines[1][3], lines[2][3]), ("3", "3"));
        assert!(lines[2][1].parse::<f64>().expect("seconds") > 0.005, "{table}");
    }
}
