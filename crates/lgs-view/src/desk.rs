//! Requests that wait to be drawn, and answers that wait to be sent.
//!
//! Of every pane of every page the newest request alone waits. Pages take turns, and a page whose last
//! picture is still to be sent has to wait, so that a slow connection costs the others nothing.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

use crate::protocol::{Answer, Ask, FrameRequest, ObjectEdit};

/// Number of a page's connection.
pub(crate) type Page = u64;

/// Something to be done for a page.
pub(crate) enum Job {
    Frame(FrameRequest),
    Pick(FrameRequest, [f32; 2]),
    Paths(u64, Vec<ObjectEdit>),
    Slice(FrameRequest, usize),
}

#[derive(Default)]
struct Waiting {
    frames: BTreeMap<usize, FrameRequest>,
    pick: Option<(FrameRequest, [f32; 2])>,
    slice: Option<(FrameRequest, usize)>,
    paths: Option<(u64, Vec<ObjectEdit>)>,
    outbox: Arc<Outbox>,
}

#[derive(Default)]
struct Pages {
    waiting: BTreeMap<Page, Waiting>,
    turns: VecDeque<Page>,
    last: Page,
    closed: bool,
}

/// The requests of all pages.
#[derive(Default)]
pub(crate) struct Desk {
    pages: Mutex<Pages>,
    news: Condvar,
}

/// What the desk has to do.
pub(crate) enum Next {
    Job(Page, Job),
    /// Nothing; rollouts may go on.
    Idle,
    Closed,
}

impl Desk {
    fn pages(&self) -> MutexGuard<'_, Pages> {
        self.pages.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A new page, unless there are as many as may be.
    pub(crate) fn open(&self, most: usize) -> Option<(Page, Arc<Outbox>)> {
        let mut pages = self.pages();
        if pages.waiting.len() >= most {
            return None;
        }
        pages.last += 1;
        let page = pages.last;
        let waiting = Waiting::default();
        let outbox = Arc::clone(&waiting.outbox);
        pages.waiting.insert(page, waiting);
        pages.turns.push_back(page);
        Some((page, outbox))
    }

    /// Returns whether it was the last page.
    pub(crate) fn leave(&self, page: Page) -> bool {
        let mut pages = self.pages();
        pages.waiting.remove(&page);
        pages.turns.retain(|other| *other != page);
        pages.waiting.is_empty()
    }

    /// Puts a request in the place of an older one.
    pub(crate) fn ask(&self, page: Page, ask: Ask) {
        if let Some(waiting) = self.pages().waiting.get_mut(&page) {
            match ask {
                Ask::Frame(request) => {
                    waiting.frames.insert(request.pane, request);
                }
                Ask::Pick { view, pixel } => waiting.pick = Some((view, pixel)),
                Ask::Slice { view, object } => waiting.slice = Some((view, object)),
                Ask::Paths { serial, edits } => waiting.paths = Some((serial, edits)),
                // What needs no drawing is answered at once.
                Ask::Hello | Ask::Training | Ask::Pause { .. } => {}
            }
        }
        self.news.notify_one();
    }

    /// Puts an unfinished request back unless there is a newer one.
    pub(crate) fn put_back(&self, page: Page, job: Job) {
        if let Some(waiting) = self.pages().waiting.get_mut(&page) {
            match job {
                Job::Frame(request) => {
                    waiting.frames.entry(request.pane).or_insert(request);
                }
                Job::Paths(serial, edits) if waiting.paths.is_none() => waiting.paths = Some((serial, edits)),
                Job::Pick(..) | Job::Paths(..) | Job::Slice(..) => {}
            }
        }
    }

    /// A picture was sent, so that its page may have another.
    pub(crate) fn sent(&self) {
        // Outboxes have locks of their own: without this one the news could come after `next` has found the
        // outbox full and before it waits.
        let _pages = self.pages();
        self.news.notify_one();
    }

    pub(crate) fn outbox(&self, page: Page) -> Option<Arc<Outbox>> {
        self.pages().waiting.get(&page).map(|waiting| Arc::clone(&waiting.outbox))
    }

    pub(crate) fn close(&self) {
        self.pages().closed = true;
        self.news.notify_all();
    }

    /// The next job. Where there is none it waits for one, unless `idle` has work to go on with.
    pub(crate) fn next(&self, idle: bool) -> Next {
        let mut pages = self.pages();
        loop {
            if pages.closed {
                return Next::Closed;
            }
            for _ in 0..pages.turns.len() {
                let Some(page) = pages.turns.pop_front() else { break };
                pages.turns.push_back(page);
                if let Some(job) = pages.waiting.get_mut(&page).and_then(Waiting::take) {
                    return Next::Job(page, job);
                }
            }
            if idle {
                return Next::Idle;
            }
            pages = self.news.wait(pages).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Waiting {
    fn take(&mut self) -> Option<Job> {
        if let Some((view, pixel)) = self.pick.take() {
            return Some(Job::Pick(view, pixel));
        }
        if let Some((view, object)) = self.slice.take() {
            return Some(Job::Slice(view, object));
        }
        let ready = self.frames.keys().copied().find(|pane| !self.outbox.holds(*pane));
        if let Some(request) = ready.and_then(|pane| self.frames.remove(&pane)) {
            return Some(Job::Frame(request));
        }
        self.paths.take().map(|(serial, edits)| Job::Paths(serial, edits))
    }
}

/// What waits to be sent to a page: of every pane the newest picture, and answers in order.
#[derive(Default)]
pub(crate) struct Outbox {
    held: Mutex<Held>,
    news: Notify,
}

#[derive(Default)]
struct Held {
    frames: BTreeMap<usize, Vec<u8>>,
    answers: VecDeque<String>,
}

/// A message to a page.
pub(crate) enum Letter {
    Frame(Vec<u8>),
    Answer(String),
}

impl Outbox {
    fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn holds(&self, pane: usize) -> bool {
        self.held().frames.contains_key(&pane)
    }

    pub(crate) fn frame(&self, pane: usize, bytes: Vec<u8>) {
        self.held().frames.insert(pane, bytes);
        self.news.notify_one();
    }

    pub(crate) fn answer(&self, answer: &Answer) {
        self.text(serde_json::to_string(answer).unwrap_or_default());
    }

    pub(crate) fn text(&self, text: String) {
        // A page that does not read has no use for old answers.
        const MOST: usize = 64;
        let mut held = self.held();
        if held.answers.len() == MOST {
            held.answers.pop_front();
        }
        held.answers.push_back(text);
        self.news.notify_one();
    }

    /// The next message, once there is one.
    pub(crate) async fn next(&self) -> Letter {
        loop {
            let news = self.news.notified();
            {
                let mut held = self.held();
                if let Some(answer) = held.answers.pop_front() {
                    return Letter::Answer(answer);
                }
                if let Some((_, frame)) = held.frames.pop_first() {
                    return Letter::Frame(frame);
                }
            }
            news.await;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::thread;
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_picture_that_is_sent_while_the_desk_is_looked_through_is_told_of_afterwards() {
        let desk = Arc::new(Desk::default());
        let look = desk.pages();
        let (sender, (told, news)) = (Arc::clone(&desk), mpsc::channel());
        thread::spawn(move || {
            sender.sent();
            told.send(())
        });
        assert!(news.recv_timeout(Duration::from_millis(200)).is_err(), "nobody waits for it yet");
        drop(look);
        assert!(news.recv_timeout(Duration::from_secs(60)).is_ok());
    }
}
