//! Falling time against the potential's scale (method §7): `t ∝ β^−½` for a fall from rest.
//!
//! The fall is that of the mean height (world z) of all moving Gaussians; the time is when it has dropped by
//! 70 % of the drop seen in the captured window at β = 1, linear between steps. A scene counts as falling if,
//! over that window, the mean acceleration points down, the drop is most of the path, and the start is
//! (nearly) at rest; elsewhere the exponent has no theory and is not reported. The integrator alone shifts
//! the exponent by a few thousandths at dt 0.01: its positions are half a kick ahead.

use std::collections::BTreeMap;

use lgs_dynamics::{Edit, Reversal};
use lgs_model::{LagrangianScene, Motion, SceneState};

use super::{centroid, distance, long_steps, window_steps};
use crate::finite::finite;
use crate::metrics::FallTime;
use crate::thresholds::{DOWNWARD, DROP_FRACTION, FALL_STEPS, MOSTLY_DOWN, NEARLY_AT_REST, STATE_STRIDE};

/// Scales β of the potential at which a fall is timed.
pub const SCALES: [f32; 7] = [0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0];

/// The regression with force scale γ; empty where nothing falls from rest.
#[must_use]
pub fn fall_time_exponent(scene: &LagrangianScene, force_scale: f32) -> FallTime {
    let Some(drop) = observed_drop(scene) else { return FallTime::default() };
    let times: Vec<(f32, Option<f64>)> = SCALES
        .iter()
        .map(|&beta| {
            let edit = Edit { potential_scale: beta, force_scale, ..Edit::default() };
            (beta, fall_time(scene, edit, DROP_FRACTION * drop))
        })
        .collect();
    let logs: Option<Vec<(f64, f64)>> =
        times.iter().map(|&(b, t)| t.map(|t| (f64::from(b).ln(), t.ln()))).collect();
    let fit = logs.and_then(|points| regression(&points));
    FallTime {
        slope: fit.map(|(slope, _)| slope),
        r: fit.map(|(_, r)| r.abs()),
        times: times.into_iter().map(|(b, t)| (format!("{b:?}"), t)).collect::<BTreeMap<_, _>>(),
    }
}

/// Drop of the mean height over the captured window, if the scene falls from rest.
fn observed_drop(scene: &LagrangianScene) -> Option<f64> {
    if scene.dynamic_gaussians.is_empty() {
        return None;
    }
    let mut motion = Motion::new(scene, Edit::default(), Reversal::Exact);
    let states = motion.states(window_steps(&scene.motion));
    let centers: Vec<[f32; 3]> = states.iter().map(|s| centroid(&s.q).map(|c| c as f32)).collect();
    let path: f64 = centers.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
    let drop = f64::from(centers.first()?[2]) - f64::from(centers.last()?[2]);
    let speed = |s: &SceneState| centroid(&s.v)[2].abs();
    let at_rest = speed(states.first()?) <= NEARLY_AT_REST * speed(states.last()?);
    (drop > MOSTLY_DOWN * path && at_rest && accelerates_downwards(&mut motion)).then_some(drop)
}

/// Whether the mean of −∇U over the visited states points down.
fn accelerates_downwards(motion: &mut Motion<'_>) -> bool {
    let mut sum = [0.0_f64; 3];
    let (steps, objects) = (window_steps(&motion.scene().motion), motion.scene().objects.len());
    for step in (0..=steps).step_by(STATE_STRIDE) {
        for a in (0..objects).flat_map(|object| motion.fields(object, step).conservative) {
            (0..3).for_each(|c| sum[c] += f64::from(a[c]));
        }
    }
    let norm = sum.iter().map(|v| v * v).sum::<f64>().sqrt();
    -sum[2] > DOWNWARD * norm
}

/// When the mean height has dropped by `drop`; nothing if it does not within 3 τ_max.
fn fall_time(scene: &LagrangianScene, edit: Edit, drop: f64) -> Option<f64> {
    let mut motion = Motion::new(scene, edit, Reversal::Exact);
    let last = long_steps(&scene.motion);
    let mut steps = 0;
    // A little at a time: a rollout is the cost, and a strong pull is over soon.
    while steps < last {
        steps = (steps + FALL_STEPS).min(last);
        let heights: Vec<f64> = motion.states(steps).iter().map(|s| centroid(&s.q)[2]).collect();
        let dropped: Vec<f64> = heights.iter().map(|h| heights[0] - h).collect();
        if let Some(step) = crossing(&dropped, drop) {
            return Some(step * f64::from(scene.motion.dt));
        }
    }
    None
}

/// Where a sequence first reaches a level, in fractional steps.
fn crossing(values: &[f64], level: f64) -> Option<f64> {
    let step = values.windows(2).position(|pair| pair[0] < level && pair[1] >= level)?;
    Some(step as f64 + (level - values[step]) / (values[step + 1] - values[step]))
}

/// Slope of the least-squares line and Pearson's correlation.
fn regression(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|&(x, y)| f(x - mx, y - my)).sum::<f64>();
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    Some((finite(xy / xx)?, finite(xy / (xx * yy).sqrt())?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_has_its_exponent_as_slope() {
        let points: Vec<(f64, f64)> =
            SCALES.iter().map(|&b| (f64::from(b).ln(), (0.6 * f64::from(b).powf(-0.5)).ln())).collect();
        let (slope, r) = regression(&points).expect("fit");
        assert!((slope + 0.5).abs() < 1e-12 && (r + 1.0).abs() < 1e-12);
    }

    #[test]
    fn crossings_are_found_between_steps() {
        assert_eq!(crossing(&[0.0, 1.0, 3.0], 2.0), Some(1.5));
        assert_eq!(crossing(&[0.0, 1.0], 2.0), None);
    }
}
