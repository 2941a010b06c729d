//! Spread of objects and reach of dynamic Gaussians in space, against the truth.

use lgs_model::{LagrangianScene, Motion, SceneState};

use super::super::truth::Truth;
use super::super::{centroid, distance, long_steps, mean, most_common, percentile, window_steps};
use super::Range;
use crate::finite::finite;
use crate::thresholds::STATE_STRIDE;

/// Spread of every object relative to t = 0, over the same of the true object that most of its Gaussians
/// match; range over objects and steps in [0, 3 τ_max].
#[must_use]
pub fn spread_against_truth(
    scene: &LagrangianScene,
    motion: &mut Motion<'_>,
    truth: &Truth<'_>,
) -> Option<Range> {
    let matches = truth.matches(&scene.dynamic_gaussians.means);
    let dt = scene.motion.dt;
    let states: Vec<(f32, &SceneState)> = motion
        .states(long_steps(&scene.motion))
        .iter()
        .enumerate()
        .step_by(STATE_STRIDE)
        .map(|(i, s)| (i as f32 * dt, s))
        .collect();
    let mut ratios = Vec::new();
    for object in scene.objects.iter().filter(|o| o.members.len() > 1) {
        let label = most_common(matches[object.members.clone()].iter().map(|&p| truth.object(p)));
        let true_points = |points: &[[f32; 3]]| -> Vec<[f32; 3]> {
            points
                .iter()
                .enumerate()
                .filter(|&(p, _)| Some(truth.object(p)) == label)
                .map(|(_, &q)| q)
                .collect()
        };
        let start = (
            spread(&scene.dynamic_gaussians.means[object.members.clone()]),
            spread(&true_points(truth.start())),
        );
        for (t, state) in &states {
            let Some(at) = truth.at(*t) else { continue };
            let now = (spread(&state.q[object.members.clone()]), spread(&true_points(&at.points)));
            ratios.push((now.0 / start.0) / (now.1 / start.1));
        }
    }
    Range::of(ratios)
}

/// Root-mean-square distance to the centroid.
fn spread(points: &[[f32; 3]]) -> f64 {
    let center = centroid(points).map(|c| c as f32);
    let squares: Vec<f64> = points.iter().map(|&p| distance(p, center).powi(2)).collect();
    mean(&squares).unwrap_or(0.0).sqrt()
}

/// Farthest distance of moving Gaussians, and its 99th percentile, from the centre of the true paths' box,
/// over the true points' farthest.
#[must_use]
pub fn reach_against_truth(
    scene: &LagrangianScene,
    motion: &mut Motion<'_>,
    truth: &Truth<'_>,
) -> Option<(f64, f64)> {
    let moving = truth.moving();
    let visited: Vec<[f32; 3]> = truth
        .samples()
        .iter()
        .flat_map(|points| points.iter().zip(&moving).filter(|&(_, &m)| m).map(|(&p, _)| p))
        .collect();
    let (low, high) = visited.iter().fold(([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), |(low, high), p| {
        (std::array::from_fn(|c| low[c].min(p[c])), std::array::from_fn(|c| high[c].max(p[c])))
    });
    let center: [f32; 3] = std::array::from_fn(|c| 0.5 * (low[c] + high[c]));
    let true_reach = visited.iter().map(|&p| distance(p, center)).fold(0.0, f64::max);
    let mut farthest = vec![0.0_f64; scene.dynamic_gaussians.len()];
    let mut include = |states: &[SceneState]| {
        for state in states.iter().step_by(STATE_STRIDE) {
            for (far, &q) in farthest.iter_mut().zip(&state.q) {
                let d = distance(q, center);
                // Infinity instead of NaN, so that a diverged Gaussian cannot vanish in a maximum.
                *far = if d.is_nan() { f64::INFINITY } else { far.max(d) };
            }
        }
    };
    include(motion.states(long_steps(&scene.motion)));
    include(motion.past_states(window_steps(&scene.motion)));
    let p99 = percentile(farthest.clone(), 0.99)?;
    Some((finite(farthest.into_iter().fold(0.0, f64::max) / true_reach)?, finite(p99 / true_reach)?))
}
