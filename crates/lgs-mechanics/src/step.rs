//! The step that resolves a motion.

use crate::coordinates::State;
use crate::edit::Edit;
use crate::error::MechanicsError;
use crate::law::Law;
use crate::system::System;
use crate::thresholds::{
    COMPARED_STATES, ERROR_OF_DIFFERENCE, FORECAST_ERROR, MOST_HALVINGS, RESOLVED_PARTS,
};
use std::borrow::Cow;

/// What halving a law's step has come to.
enum Halved {
    /// The longest step that resolves its motion.
    Resolved(Law),
    /// The last step tried, which does not resolve it, or why that has no motion.
    Finest(Result<Law, MechanicsError>),
}

impl Law {
    /// The same law with the longest step, among its own and its halves, whose error over `duration` from
    /// `start` stays below `tolerance` times the farthest that the configuration gets from it. A motion that
    /// none resolves for so long, as one that falls into a centre after a while, is resolved for a half or a
    /// quarter of it, or keeps its step.
    pub fn resolved(self, start: &State, duration: f64, tolerance: f64) -> Result<Self, MechanicsError> {
        let mut finest = Ok(self.clone());
        for part in RESOLVED_PARTS {
            match self.clone().halved(Edit::NONE, start, part * duration, tolerance) {
                Halved::Resolved(law) => return Ok(law),
                Halved::Finest(law) => finest = law,
            }
        }
        if self.states(Edit::NONE, start, &[duration]).is_ok() { Ok(self) } else { finest }
    }

    /// The law with a step that resolves an edited motion up to a time; its own without an edit, and for a
    /// body that collides: a small error before an impact is a large one after it, and no two steps agree.
    #[must_use]
    pub fn under(&self, edit: Edit, start: &State, until: f64) -> Cow<'_, Self> {
        if edit == Edit::NONE || self.contact.is_some() {
            return Cow::Borrowed(self);
        }
        let resolved = self.clone().resolved_under(edit, start, until, FORECAST_ERROR);
        resolved.map_or(Cow::Borrowed(self), Cow::Owned)
    }

    /// The same as [`Self::resolved`] for an edited motion, which may come nearer to a centre or move faster
    /// than its own. The tolerance is a part of the longer of the two paths: a motion that an edit stops has
    /// none, and rounding errors alone.
    pub fn resolved_under(
        self,
        edit: Edit,
        start: &State,
        duration: f64,
        tolerance: f64,
    ) -> Result<Self, MechanicsError> {
        match self.halved(edit, start, duration, tolerance) {
            Halved::Resolved(law) => Ok(law),
            Halved::Finest(law) => law,
        }
    }

    fn halved(mut self, edit: Edit, start: &State, duration: f64, tolerance: f64) -> Halved {
        let times: Vec<f64> =
            (1..=COMPARED_STATES).map(|i| duration * i as f64 / COMPARED_STATES as f64).collect();
        let at_rest = vec![start.clone(); times.len()];
        let own = if edit == Edit::NONE {
            Vec::new()
        } else {
            self.states(Edit::NONE, start, &times).unwrap_or_default()
        };
        let own_path = self.farthest(&at_rest, &own);
        let mut coarse = self.states(edit, start, &times);
        for _ in 0..MOST_HALVINGS {
            let mut half = self.clone();
            half.step *= 0.5;
            let fine = half.states(edit, start, &times);
            if let (Ok(coarse), Ok(fine)) = (&coarse, &fine) {
                let path = self.farthest(&at_rest, fine).max(own_path);
                if ERROR_OF_DIFFERENCE * self.farthest(coarse, fine) <= tolerance * path {
                    return Halved::Resolved(self);
                }
            }
            self = half;
            coarse = fine;
        }
        Halved::Finest(coarse.map(|_| self))
    }

    fn states(&self, edit: Edit, start: &State, times: &[f64]) -> Result<Vec<State>, MechanicsError> {
        System::new(self, edit).states(start, times)
    }

    /// The farthest that configurations get from others, pair by pair.
    fn farthest(&self, some: &[State], others: &[State]) -> f64 {
        let apart = |(a, b): (&State, &State)| length(&self.coordinates.difference(&a.x, &b.x));
        some.iter().zip(others).map(apart).fold(0.0, f64::max)
    }
}

fn length(vector: &[f64]) -> f64 {
    vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}
