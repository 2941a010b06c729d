//! Places on a training schedule.
//!
//! Settings count a schedule's length in steps. Without a time budget a step of the optimiser covers one step
//! of the schedule; under one it covers more or less (its pace), so that training comes to the schedule's end
//! when its time is over. Learning rates, windows, resolutions and densification follow the place on the
//! schedule; random draws follow the number of steps taken.

use std::ops::RangeInclusive;

use lgs_model::{TensorFile, TensorFileError};

/// Names of the place and the pace in a checkpoint.
const NAMES: [&str; 2] = ["schedule.place", "schedule.pace"];
/// Steps of a schedule by which a sum of paces may miss its end.
const ROUNDING: f64 = 1e-9;

/// A place on a schedule, and the pace at which steps go on from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    length: usize,
    place: f64,
    pace: f64,
    taken: usize,
}

impl Clock {
    /// The start of a schedule of `length` steps, at the pace of one per step taken.
    #[must_use]
    pub fn new(length: usize) -> Self {
        Self { length, place: 0.0, pace: 1.0, taken: 0 }
    }

    /// The start of another schedule after the steps taken so far, at the pace of these.
    #[must_use]
    pub(crate) fn begun_again(&self, length: usize) -> Self {
        Self { length, place: 0.0, ..*self }
    }

    /// Steps of the schedule.
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// Takes a step; returns the steps of the schedule that it completes, counted from 1.
    pub fn advance(&mut self) -> RangeInclusive<usize> {
        let before = self.place;
        self.place += self.pace;
        if self.place > self.length as f64 - ROUNDING {
            self.place = self.length as f64;
        }
        self.taken += 1;
        before as usize + 1..=self.place as usize
    }

    /// Number of steps taken.
    #[must_use]
    pub fn taken(&self) -> usize {
        self.taken
    }

    /// The step of the schedule that goes on or has just been completed, counted from 1.
    #[must_use]
    pub fn iteration(&self) -> usize {
        (self.place as usize).max(1)
    }

    /// Steps of the schedule that are left; a fraction may be.
    #[must_use]
    pub fn left(&self) -> f64 {
        self.length as f64 - self.place
    }

    /// The part of the schedule that is done, in [0, 1].
    #[must_use]
    pub fn progress(&self) -> f64 {
        if self.length == 0 { 1.0 } else { self.place / self.length as f64 }
    }

    /// Steps that will have been taken at the end, if the pace stays.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.taken + (self.left() / self.pace - ROUNDING).ceil().max(0.0) as usize
    }

    /// Steps of the schedule that a step taken covers.
    #[must_use]
    pub fn pace(&self) -> f64 {
        self.pace
    }

    /// Goes on at another pace, a positive one.
    pub fn set_pace(&mut self, pace: f64) {
        self.pace = pace;
    }

    /// Adds place and pace to a checkpoint; numbers are written so that they are read back exactly.
    pub(crate) fn insert_into(&self, file: &mut TensorFile) {
        for (name, value) in NAMES.into_iter().zip([self.place, self.pace]) {
            file.set_metadata(name, value.to_string());
        }
    }

    /// Goes on from a checkpoint of `taken` steps.
    ///
    /// # Errors
    /// If place or pace are absent or cannot be.
    pub(crate) fn restore(&mut self, file: &TensorFile, taken: usize) -> Result<(), TensorFileError> {
        let [place, pace] = [number(file, NAMES[0])?, number(file, NAMES[1])?];
        if !(0.0..=self.length as f64).contains(&place) {
            let expected = format!("a place in a schedule of {} steps", self.length);
            return Err(file.field(NAMES[0], &expected, place.to_string()));
        }
        if !(pace > 0.0 && pace.is_finite()) {
            return Err(file.field(NAMES[1], "a positive number", pace.to_string()));
        }
        *self = Self { place, pace, taken, ..*self };
        Ok(())
    }
}

/// A number of a checkpoint, to the last digit.
fn number(file: &TensorFile, name: &str) -> Result<f64, TensorFileError> {
    let text = file.metadata(name)?;
    text.parse().map_err(|_| file.field(name, "a number", text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_its_own_pace_a_schedule_is_a_count() {
        let mut clock = Clock::new(3);
        assert_eq!((clock.steps(), clock.left()), (3, 3.0));
        let covered: Vec<_> = (0..3).map(|_| clock.advance()).collect();
        assert_eq!(covered, [1..=1, 2..=2, 3..=3]);
        assert_eq!((clock.steps(), clock.taken(), clock.progress()), (3, 3, 1.0));
    }

    #[test]
    fn other_paces_cover_every_step_of_the_schedule_once() {
        for pace in [0.1, 0.3, 1.0, 1.7, 4.0, 250.0] {
            let mut clock = Clock::new(100);
            clock.set_pace(pace);
            let expected = clock.steps();
            let mut covered = Vec::new();
            while clock.left() > 0.0 {
                covered.extend(clock.advance());
            }
            assert_eq!(covered, (1..=100).collect::<Vec<_>>(), "{pace}");
            assert!(clock.taken().abs_diff(expected) <= 1, "{pace}: {} {expected}", clock.taken());
        }
    }

    #[test]
    fn a_checkpoint_goes_on_exactly_and_defects_are_named() {
        let (mut clock, mut other) = (Clock::new(50), Clock::new(50));
        clock.set_pace(1.0 / 3.0);
        for _ in 0..7 {
            clock.advance();
        }
        let mut file = TensorFile::new("test/1");
        clock.insert_into(&mut file);
        other.restore(&file, 7).expect("restore");
        assert_eq!(clock, other);
        let text = Clock::new(1).restore(&file, 7).expect_err("too short").to_string();
        assert!(text.contains("schedule.place") && text.contains("1 steps"), "{text}");
    }
}
