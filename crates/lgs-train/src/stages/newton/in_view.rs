//! Whether images can judge a step: those of a body that has gone far away show nothing of it, which may be
//! better than a body that is drawn badly.

use lgs_core::linear::{norm, sub};

use super::{Newton, Observed};
use crate::stages::body::Positions;

impl Newton {
    /// Whether changes of all objects' unknowns leave each of them within the distance of its nearest camera
    /// from where it is, at the times of the images.
    pub(super) fn keeps_in_view(&self, changes: &[Vec<f64>], observed: &Observed<'_>) -> bool {
        let times = &observed.times.0;
        changes.iter().enumerate().all(|(object, change)| {
            let at = |change| self.bodies[object].positions(&self.parts[object], change, times);
            let distance = observed.frames.iter().filter_map(|frame| {
                let first = observed.responses[object][observed.times.index(frame)].first()?;
                Some(norm(sub(frame.camera.center_in_world(), first.center)))
            });
            stay_near([&at(&self.changes[object]), &at(change)], distance.fold(f32::INFINITY, f32::min))
        })
    }
}

/// Whether no position is farther than a distance from where it was; what is no number is far.
fn stay_near([before, after]: [&Positions; 2], distance: f32) -> bool {
    let pairs = before.iter().flatten().zip(after.iter().flatten());
    pairs.into_iter().all(|(&before, &after)| norm(sub(after, before)) <= distance)
}

#[cfg(test)]
mod tests {
    use super::stay_near;

    #[test]
    fn a_body_that_runs_away_or_is_nowhere_is_out_of_view() {
        let at = |x: f32| vec![vec![[0.0; 3]], vec![[x, 0.0, 0.0]]];
        let near = |x: f32| stay_near([&at(0.0), &at(x)], 2.0);
        assert!(near(1.9) && !near(2.1) && !near(f32::INFINITY) && !near(f32::NAN));
    }
}
