//! A time budget, and the paces at which stages go through their schedules to keep to it.
//!
//! Every stage that follows a [`Clock`] gets a deadline: a part of the time that is left when it begins, less
//! what the choices of laws that come after it are going to take. From then on its schedule runs with time:
//! about once a second the pace is set such that the schedule ends at the deadline if steps go on taking as
//! long as the last ones did, of which the newer count more. All paces are recorded in `schedule.json`, by
//! the step from which they hold. Stage 3 has a part of the budget even where nothing is left of it. A run
//! that is resumed follows the record as far as it goes, so it repeats what was done exactly, whatever the
//! machine does; beyond, it looks at the time again. Whether there was time to refine the Gaussians, to seek
//! laws by the images for objects that have none and after stage 3, and for another round of stage 1 is
//! recorded too, as is which of the longer searches for laws, in the tracks and by the images, there was time
//! for.

use std::path::{Path, PathBuf};
use std::time::Instant;

use lgs_data::files::{FileError, write_atomically};

use crate::checkpoint::Stage;
use crate::clock::Clock;
use crate::config::LastStage;
use crate::error::TrainError;
use crate::schedule::{Pace, Schedule, read_schedule};
use crate::thresholds::{
    DISTILL_SHARE, LAST_STAGE_GRACE, LAST_STAGE_SHARE, LEAST_SHARE, NEWEST_WEIGHT, PACE_SECS, PACE_STEPS,
    REFINEMENT_SHARE, SLOWEST_PACE, SOURCE_SHARE,
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
        let least = if stage == Stage::TuneGaussians { LAST_STAGE_GRACE * self.secs } else { 0.0 };
        let deadline = used + (share(stage, last) * available).max(least);
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
        self.has_time_again_for(stage, 1)
    }

    /// The same of the `round`th time.
    pub(crate) fn has_time_again_for(&mut self, stage: Stage, round: usize) -> Result<bool, TrainError> {
        let name = if round == 1 { stage.name().to_owned() } else { name_of_round(stage, round) };
        if let Some(&has_time) = self.schedule.has_time_for.get(&name) {
            return Ok(has_time);
        }
        let available = self.left() - self.reserve(stage);
        let has_time = match stage {
            Stage::FitDynamics => self.has_time_for_two(self.schedule.distill_secs),
            _ => share(stage, LastStage::TuneGaussians) * available > LEAST_SHARE * self.secs,
        };
        self.schedule.has_time_for.insert(name, has_time);
        self.save()?;
        Ok(has_time)
    }

    /// Whether stage 1 has time to distil all objects another time, the `round`th, which takes as long as
    /// those before did on average: as recorded, or by the time.
    pub(crate) fn has_time_for_round(&mut self, round: usize) -> bool {
        let Some(Current { begun, .. }) = self.current else { return true };
        let of_a_round = (self.used() - begun) / (round - 1) as f64;
        let fits = of_a_round * round as f64 <= DISTILL_SHARE * (self.secs - begun);
        *self.schedule.has_time_for.entry(name_of_round(Stage::Distill, round)).or_insert(fits)
    }

    /// Whether stage 1, or the choice of laws by images, has time for another search, of a given name, beside
    /// a choice by images that comes after it: each takes about as long as all before it. As recorded, or by
    /// the time.
    pub(crate) fn has_time_for_search(&mut self, name: &str) -> bool {
        let taken = self.current.as_ref().map_or(0.0, |current| self.used() - current.begun);
        let fits = self.has_time_for_two(taken);
        *self.schedule.has_time_for.entry(name.to_owned()).or_insert(fits)
    }

    /// Whether a search for laws and the choice that comes after it, each of a length, leave time for the
    /// last stage.
    fn has_time_for_two(&self, secs: f64) -> bool {
        2.0 * secs + LAST_STAGE_GRACE * self.secs <= self.left()
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

/// Name of a stage's round in the record.
fn name_of_round(stage: Stage, round: usize) -> String {
    format!("{}, round {round}", stage.name())
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
mod tests;
