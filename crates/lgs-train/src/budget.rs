//! A time budget, and the paces at which stages go through their schedules to keep to it.
//!
//! Every stage that follows a [`Clock`] gets a deadline: a part of the time that is left when it begins, less
//! what the choices of laws that come after it are going to take. From then on its schedule runs with time:
//! about once a second the pace is set such that the schedule ends at the deadline if steps go on taking as
//! long as the last ones did, of which the newer count more. All paces are recorded in `schedule.json`, by
//! the step from which they hold. A run that is resumed follows the record as far as it goes, so it repeats
//! what was done exactly, whatever the machine does; beyond, it looks at the time again. Whether there was
//! time to tune the Gaussians, and to seek laws by the images for objects that have none, is recorded too.

use std::path::{Path, PathBuf};
use std::time::Instant;

use lgs_data::files::{FileError, write_atomically};

use crate::checkpoint::Stage;
use crate::clock::Clock;
use crate::config::LastStage;
use crate::error::TrainError;
use crate::schedule::{Pace, Schedule, read_schedule};
use crate::thresholds::{
    LAST_STAGE_SHARE, LEAST_SHARE, NEWEST_WEIGHT, PACE_SECS, PACE_STEPS, REFINEMENT_SHARE, SLOWEST_PACE,
    SOURCE_SHARE,
};

/// The time that a run has, and what became of it.
pub(crate) struct Budget {
    secs: f64,
    path: PathBuf,
    schedule: Schedule,
    /// Paces of the record that have not been followed yet begin here.
    next: usize,
    used_before: f64,
    begun: Instant,
    current: Option<Current>,
}

/// The stage that runs, since its last change of pace.
struct Current {
    stage: Stage,
    begun: f64,
    deadline: f64,
    since: f64,
    steps: usize,
    /// Seconds of a step, smoothed.
    step_secs: Option<f64>,
}

impl Budget {
    /// The budget of a run, with the schedule that its folder holds.
    ///
    /// # Errors
    /// If the schedule cannot be read.
    pub(crate) fn open(secs: f64, path: &Path) -> Result<Self, TrainError> {
        let schedule = if path.exists() { read_schedule(path)? } else { Schedule::default() };
        Ok(Self {
            secs,
            path: path.to_owned(),
            used_before: schedule.used_secs,
            schedule,
            next: 0,
            begun: Instant::now(),
            current: None,
        })
    }

    /// Seconds used, those of earlier sessions included.
    fn used(&self) -> f64 {
        self.used_before + self.begun.elapsed().as_secs_f64()
    }

    /// Seconds left; none once the budget is used up.
    pub(crate) fn left(&self) -> f64 {
        (self.secs - self.used()).max(0.0)
    }

    /// A stage begins, or goes on, to be followed by those up to the last one.
    pub(crate) fn begin(&mut self, stage: Stage, last: LastStage) {
        let used = self.used();
        let available = (self.left() - self.reserve(stage)).max(0.0);
        let deadline = used + share(stage, last) * available;
        self.current = Some(Current { stage, begun: used, deadline, since: used, steps: 0, step_secs: None });
    }

    /// Seconds to be kept for what has no pace, beside a stage or in it: laws are chosen by the images before
    /// and after the last stage, each time for about as long as they were sought in the tracks.
    fn reserve(&self, stage: Stage) -> f64 {
        match stage {
            Stage::RefineGaussians => 2.0 * self.schedule.distill_secs,
            Stage::FitDynamics => self.schedule.distill_secs,
            Stage::TuneGaussians | Stage::RetuneGaussians => self.schedule.fit_secs,
            _ => 0.0,
        }
    }

    /// Whether enough is left for a stage beside what has to be kept: as recorded or, when it is asked for
    /// the first time, by the time.
    ///
    /// # Errors
    /// If the record cannot be written.
    pub(crate) fn has_time_for(&mut self, stage: Stage) -> Result<bool, TrainError> {
        if let Some(&has_time) = self.schedule.has_time_for.get(stage.name()) {
            return Ok(has_time);
        }
        let available = self.left() - self.reserve(stage);
        let has_time = match stage {
            Stage::FitDynamics => available > 0.0,
            _ => share(stage, LastStage::TuneGaussians) * available > LEAST_SHARE * self.secs,
        };
        self.schedule.has_time_for.insert(stage.name().to_owned(), has_time);
        self.save()?;
        Ok(has_time)
    }

    /// A stage ends.
    pub(crate) fn end(&mut self) {
        let used = self.used();
        match self.current.take() {
            Some(Current { stage: Stage::Distill, begun, .. }) => self.schedule.distill_secs = used - begun,
            Some(Current { stage: Stage::FitDynamics, begun, .. }) => self.schedule.fit_secs = used - begun,
            _ => {}
        }
    }

    /// Sets the pace of the step to come: that of the record or, once its end is reached, one that keeps to
    /// the deadline.
    pub(crate) fn pace(&mut self, clock: &mut Clock) {
        let used = self.used();
        let Some(current) = &mut self.current else { return };
        let reached = (current.stage.index(), clock.taken());
        while let Some(pace) = self.schedule.paces.get(self.next).filter(|pace| pace.place() <= reached) {
            if pace.place().0 == reached.0 {
                clock.set_pace(pace.pace);
            }
            self.next += 1;
        }
        if self.next < self.schedule.paces.len() {
            current.measure_from(used);
        } else if let Some(pace) = current.due(clock, used) {
            clock.set_pace(pace);
            let stage = current.stage.name().to_owned();
            self.schedule.paces.push(Pace { stage, step: clock.taken(), pace });
            self.next += 1;
        }
    }

    /// Writes the schedule.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn save(&self) -> Result<(), TrainError> {
        let schedule = Schedule { used_secs: self.used(), ..self.schedule.clone() };
        let json = serde_json::to_vec_pretty(&schedule)
            .map_err(|e| FileError::new("write file", &self.path, e.into()))?;
        Ok(write_atomically(&self.path, |w| w.write_all(&json))?)
    }
}

impl Current {
    /// Steps are timed from now on.
    fn measure_from(&mut self, used: f64) {
        (self.since, self.steps) = (used, 0);
    }

    /// A pace that comes to the end of the schedule at the deadline, once a second or so.
    fn due(&mut self, clock: &Clock, used: f64) -> Option<f64> {
        let (secs, steps) = (used - self.since, self.steps);
        self.steps += 1;
        if steps < PACE_STEPS || secs < PACE_SECS {
            return None;
        }
        self.measure_from(used);
        self.steps += 1;
        let newest = secs / steps as f64;
        let step_secs = self.step_secs.map_or(newest, |before| before + NEWEST_WEIGHT * (newest - before));
        self.step_secs = Some(step_secs);
        let steps_left = ((self.deadline - used) / step_secs).max(1.0);
        Some((clock.left() / steps_left).max(SLOWEST_PACE))
    }
}

/// The part of the time left that a stage may take at most.
fn share(stage: Stage, last: LastStage) -> f64 {
    match (stage, last) {
        (Stage::Source, LastStage::TuneGaussians) => SOURCE_SHARE,
        (Stage::RefineGaussians, _) => REFINEMENT_SHARE,
        _ => LAST_STAGE_SHARE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seconds and steps that a schedule of 1000 steps takes with a budget of 300 seconds.
    fn used_and_taken(secs_of_step: impl Fn(f64) -> f64) -> (f64, usize) {
        let mut clock = Clock::new(1000);
        let (stage, deadline) = (Stage::Source, 300.0);
        let mut current = Current { stage, begun: 0.0, deadline, since: 0.0, steps: 0, step_secs: None };
        let mut used = 0.0;
        while clock.left() > 0.0 {
            if let Some(pace) = current.due(&clock, used) {
                clock.set_pace(pace);
            }
            clock.advance();
            used += secs_of_step(clock.progress());
        }
        (used, clock.taken())
    }

    #[test]
    fn a_schedule_ends_at_its_deadline_whatever_steps_take() {
        for secs_of_step in
            [|_: f64| 0.4, |progress: f64| 0.02 + progress, |progress: f64| 1.2 - progress * 0.8]
        {
            let (used, _) = used_and_taken(secs_of_step);
            assert!((used - 300.0).abs() < 6.0, "{used}");
        }
    }

    #[test]
    fn a_schedule_is_not_stretched_beyond_its_own_steps() {
        let (used, taken) = used_and_taken(|_| 0.2);
        assert!((used - 200.0).abs() < 1e-6 && taken == 1000, "{used} {taken}");
    }

    #[test]
    fn time_for_the_choices_of_laws_is_kept_and_what_was_decided_holds() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("schedule.json");
        let with_fit = |secs, fit_secs| {
            let mut budget = Budget::open(secs, &path).expect("open");
            budget.schedule.fit_secs = fit_secs;
            budget
        };
        let deadline = |fit_secs| {
            let mut budget = with_fit(1000.0, fit_secs);
            budget.begin(Stage::TuneGaussians, LastStage::TuneGaussians);
            budget.current.expect("a stage").deadline
        };
        let kept = deadline(0.0) - deadline(400.0);
        assert!((kept - 400.0 * LAST_STAGE_SHARE).abs() < 1.0, "{kept}");
        let seeks = |secs| {
            let mut budget = with_fit(secs, 0.0);
            budget.schedule.distill_secs = 400.0;
            budget.has_time_for(Stage::FitDynamics).expect("record")
        };
        assert!(!seeks(300.0) && !seeks(1e6), "as long as laws were sought in the tracks");
        let tunes = |secs| with_fit(secs, 400.0).has_time_for(Stage::TuneGaussians).expect("record");
        assert!(!tunes(405.0) && !tunes(1e6), "a few steps are worse than none");
        let has_time = |secs| with_fit(secs, 400.0).has_time_for(Stage::RetuneGaussians).expect("record");
        assert!(!has_time(300.0) && !has_time(1e6), "decided once");
        std::fs::remove_file(&path).expect("remove");
        assert!(has_time(1e6) && has_time(300.0), "decided once");
    }

    #[test]
    fn a_recorded_schedule_is_followed_to_its_last_digit_and_damage_is_named() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("schedule.json");
        let pace = |stage: Stage, step, pace| Pace { stage: stage.name().to_owned(), step, pace };
        let paces = vec![pace(Stage::Source, 3, 1.0 / 3.0), pace(Stage::TuneGaussians, 0, 0.1 + 0.2)];
        let mut budget = Budget::open(1e9, &path).expect("none yet");
        budget.schedule.paces = paces.clone();
        budget.save().expect("save");
        assert_eq!(read_schedule(&path).expect("read").paces, paces);
        let mut resumed = Budget::open(1e9, &path).expect("open");
        let mut clock = Clock::new(100);
        resumed.begin(Stage::Source, LastStage::TuneGaussians);
        for expected in [1.0, 1.0, 1.0, 1.0 / 3.0, 1.0 / 3.0] {
            resumed.pace(&mut clock);
            assert_eq!(clock.pace(), expected, "{}", clock.taken());
            clock.advance();
        }
        let mut clock = Clock::new(10);
        resumed.begin(Stage::TuneGaussians, LastStage::TuneGaussians);
        resumed.pace(&mut clock);
        assert_eq!(clock.pace(), 0.1 + 0.2);
        std::fs::write(
            &path,
            "{\"used_secs\": 1.0, \"paces\": [{\"stage\": \"source\", \"step\": 1, \"pace\": 0}]}",
        )
        .expect("write");
        let text = Budget::open(1.0, &path).err().expect("damage").to_string();
        assert!(text.contains("positive") && text.ends_with("schedule.json"), "{text}");
    }
}
