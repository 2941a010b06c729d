//! What is on view: a finished run, or a run while it is trained.
//!
//! Training hands over a copy of its models now and then, and only while somebody looks; all else about it is
//! a few numbers. Neither changes what is trained.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::curve::{Curve, StepSheet};
use crate::protocol::TrainingSheet;
use crate::subject::Subject;
use crate::thresholds::{LEAST_SNAPSHOT_SECS, LOOKING_SECS, SHARE_SECS, SNAPSHOT_REST};

/// What is on view.
pub struct Exhibit {
    shown: Mutex<Shown>,
    training: Option<Training>,
}

struct Shown {
    subject: Arc<Subject>,
    /// How many subjects came before.
    number: u64,
}

/// Training under way.
#[derive(Default)]
struct Training {
    state: Mutex<State>,
    resumed: Condvar,
}

#[derive(Default)]
struct State {
    step: Option<StepSheet>,
    /// Beginning of the stage, and its first step.
    begun: Option<(Instant, usize)>,
    curve: Curve,
    looked: Option<Instant>,
    /// When the next snapshot may be taken.
    due: Option<Instant>,
    paused: bool,
    /// What serving took lately: when it ended, and how long it was.
    served: VecDeque<(Instant, Duration)>,
}

impl Exhibit {
    /// A subject that stays as it is.
    #[must_use]
    pub fn of(subject: Subject) -> Self {
        Self { shown: Mutex::new(Shown { subject: Arc::new(subject), number: 0 }), training: None }
    }

    /// The first subject of a run that is trained.
    #[must_use]
    pub fn of_training(subject: Subject) -> Self {
        Self { training: Some(Training::default()), ..Self::of(subject) }
    }

    /// Puts a subject in the place of the one before; `begun` is when its making began.
    pub fn show(&self, subject: Subject, begun: Instant) {
        {
            let mut shown = locked(&self.shown);
            shown.subject = Arc::new(subject);
            shown.number += 1;
        }
        let Some(training) = &self.training else { return };
        let (now, mut state) = (Instant::now(), locked(&training.state));
        let took = now - begun;
        state.due = Some(now + Duration::from_secs_f32(LEAST_SNAPSHOT_SECS).max(SNAPSHOT_REST * took));
        state.serve(now, took);
    }

    /// Takes note of a training step.
    pub fn report(&self, step: StepSheet) {
        let Some(training) = &self.training else { return };
        let mut state = locked(&training.state);
        if state.step.as_ref().is_none_or(|last| last.stage != step.stage) {
            state.begun = Some((Instant::now(), step.step));
        }
        state.curve.add(&step);
        state.step = Some(step);
    }

    /// Whether somebody looks and the last snapshot is old enough.
    #[must_use]
    pub fn wants(&self) -> bool {
        self.training.as_ref().is_some_and(|training| {
            let (now, state) = (Instant::now(), locked(&training.state));
            let looks = state.looked.is_some_and(|looked| now - looked < Duration::from_secs(LOOKING_SECS));
            looks && state.due.is_none_or(|due| due <= now)
        })
    }

    /// Waits for as long as a page has paused training, or until `stop` is set.
    pub fn wait_while_paused(&self, stop: &AtomicBool) {
        const GLANCE: Duration = Duration::from_millis(100);
        let Some(training) = &self.training else { return };
        let (begun, mut state) = (Instant::now(), locked(&training.state));
        if !state.paused {
            return;
        }
        while state.paused && !stop.load(Ordering::Relaxed) {
            state = training.resumed.wait_timeout(state, GLANCE).unwrap_or_else(PoisonError::into_inner).0;
        }
        // A rest is no part of the stage's pace.
        state.begun = state.begun.map(|(start, step)| (start + begun.elapsed(), step));
    }

    pub(crate) fn is_training(&self) -> bool {
        self.training.is_some()
    }

    /// The subject and its number.
    pub(crate) fn current(&self) -> (Arc<Subject>, u64) {
        let shown = locked(&self.shown);
        (Arc::clone(&shown.subject), shown.number)
    }

    /// Pauses training, or lets it go on.
    pub(crate) fn pause(&self, paused: bool) {
        if let Some(training) = &self.training {
            locked(&training.state).paused = paused;
            training.resumed.notify_all();
        }
    }

    /// Takes note of the time that a picture took.
    pub(crate) fn served(&self, took: Duration) {
        if let Some(training) = &self.training {
            locked(&training.state).serve(Instant::now(), took);
        }
    }

    /// What a page is told of training; asking counts as looking.
    pub(crate) fn sheet(&self) -> Option<TrainingSheet> {
        let number = locked(&self.shown).number;
        let now = Instant::now();
        let mut state = locked(&self.training.as_ref()?.state);
        state.looked = Some(now);
        let step = state.step.clone();
        Some(TrainingSheet {
            subject: number,
            eta_secs: state.eta_secs(now),
            share: state.share(now),
            paused: state.paused,
            curve: state.curve.points().to_vec(),
            step,
        })
    }
}

impl State {
    fn serve(&mut self, now: Instant, took: Duration) {
        self.served.push_back((now, took));
        self.share(now);
    }

    /// Part of the last seconds that serving took.
    fn share(&mut self, now: Instant) -> f32 {
        let window = Duration::from_secs(SHARE_SECS);
        while self.served.front().is_some_and(|(end, _)| now - *end > window) {
            self.served.pop_front();
        }
        let total: Duration = self.served.iter().map(|(_, took)| *took).sum();
        (total.as_secs_f32() / window.as_secs_f32()).min(1.0)
    }

    /// Seconds that the stage takes yet, if it goes on at its pace.
    fn eta_secs(&self, now: Instant) -> Option<f32> {
        let (step, (begun, first)) = (self.step.as_ref()?, self.begun?);
        let done = step.step.checked_sub(first).filter(|done| *done > 0)?;
        let left = step.steps.saturating_sub(step.step);
        Some((now - begun).as_secs_f32() * left as f32 / done as f32)
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
