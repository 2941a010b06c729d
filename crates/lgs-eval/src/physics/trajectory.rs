//! Position errors against ground truth.
//!
//! Every moving Gaussian is matched to the nearest true point at t = 0, in doubt to one of the true object
//! that most Gaussians of its object are nearest to ([`Truth::matches_of_object`]), and then expected to stay
//! fixed to that point's object: its small offset from the point turns with the object (least-squares
//! rotation of the object's points), and stretches with one whose points move by a linear map. The error at a
//! time is the mean distance to where it is expected, over the mean path length of the matched points from 0
//! to that time. All moving Gaussians count, however far their point was; the median and the distance to the
//! bare point are reported beside it.

use std::collections::BTreeMap;

use lgs_model::{LagrangianScene, Motion};

use super::truth::Truth;
use super::{distance, mean, percentile};
use crate::finite::finite;
use crate::metrics::TrajectoryDetail;
use crate::thresholds::TIME_TOLERANCE;

/// Times of the report, in units of the captured sequence.
pub const TIMES: [f32; 5] = [-0.75, 0.75, 1.0, 1.5, 2.25];

/// Error and detail by time, as labelled in the report.
pub type TrajectoryErrors = (BTreeMap<String, Option<f64>>, BTreeMap<String, TrajectoryDetail>);

/// Errors at all [`TIMES`]; without a truth, or outside it or the scene's range, there is none.
#[must_use]
pub fn trajectory_errors(
    scene: &LagrangianScene,
    motion: &mut Motion<'_>,
    truth: Option<&Truth<'_>>,
) -> TrajectoryErrors {
    let (low, high) = scene.motion.time_range();
    let (mut errors, mut details) = (BTreeMap::new(), BTreeMap::new());
    for t in TIMES {
        let allowed = t >= low - TIME_TOLERANCE && t <= high + TIME_TOLERANCE;
        let found = truth.filter(|_| allowed).and_then(|truth| trajectory_error(scene, motion, truth, t));
        errors.insert(format!("{t:?}"), found.map(|(error, _)| error));
        if let Some((_, detail)) = found {
            details.insert(format!("{t:?}"), detail);
        }
    }
    (errors, details)
}

/// Mean relative error at one time, and more about it; nothing if nothing moves or the truth does not reach
/// there.
#[must_use]
pub fn trajectory_error(
    scene: &LagrangianScene,
    motion: &mut Motion<'_>,
    truth: &Truth<'_>,
    t: f32,
) -> Option<(f64, TrajectoryDetail)> {
    let at = truth.at(t)?;
    let paths = truth.path_lengths(t)?;
    let means = &scene.dynamic_gaussians.means;
    let members = scene.objects.iter().map(|object| object.members.clone());
    let matches: Vec<usize> = members.flat_map(|rows| truth.matches_of_object(&means[rows])).collect();
    let positions = motion.state_at(t).q;
    let starts = means.iter().zip(&matches);
    let errors: Vec<f64> =
        starts.zip(&positions).map(|((&start, &p), &q)| distance(truth.carried(&at, p, start), q)).collect();
    let to_points: Vec<f64> =
        matches.iter().zip(&positions).map(|(&p, &q)| distance(at.points[p], q)).collect();
    let path = mean(&matches.iter().map(|&p| paths[p]).collect::<Vec<_>>()).filter(|&path| path > 0.0)?;
    let error = finite(mean(&errors)? / path)?;
    let detail = TrajectoryDetail {
        gaussians: errors.len(),
        median: percentile(errors, 0.5)? / path,
        to_nearest_point: mean(&to_points)? / path,
        path,
    };
    Some((error, detail))
}
