//! The band of a forecast: draws from the posteriors of all likely laws, in all coordinates, by their
//! weights. A law that the evidence hardly tells from the chosen one and that forecasts something else widens
//! it.

use super::rated::Rated;
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{BAND_POINTS, LIGHTEST};
use glam::DVec3;
use lgs_mechanics::Edit;
use lgs_mechanics::bands::{drawn, holding, shares};
use lgs_mechanics::coordinates::State;

/// Share of the posterior of positions that a band holds.
const HELD: f64 = 0.9;

/// Radius around the positions of a forecast that holds 90 % of the posterior of positions, over the
/// particles of all bodies, at each of some times; infinite where too many draws cannot be followed.
/// `forecast` has the poses of all bodies at these times under the same edit.
pub(super) fn radius(
    rated: &Rated,
    (bodies, forecast): (&[&SharedMotion], &[Vec<Pose>]),
    (times, edit): (&[f64], Edit),
    seed: u64,
) -> Vec<f64> {
    let points: Vec<Vec<DVec3>> = bodies.iter().map(|motion| spread_points(motion)).collect();
    let mut distances: Vec<Vec<f64>> = vec![Vec::new(); times.len()];
    let counts = shares(&rated.weights());
    for (index, (law, count)) in rated.laws.iter().zip(counts).enumerate() {
        let system = &rated.systems[law.system];
        let mut fitted = law.judged.fitted.clone();
        fitted.covariance *= rated.inflation;
        for motion in drawn(&fitted, count, (times, edit), (seed, index as u64)) {
            for (at, distances) in distances.iter_mut().enumerate() {
                let moved = motion.as_ref().map(|states: &Vec<State>| system.poses_in(&states[at].x));
                for (place, &body) in system.order.iter().enumerate() {
                    let (points, forecast) = (&points[body], &forecast[at][body]);
                    let apart = |point: &DVec3| match &moved {
                        Some(poses) => poses[place].apply(*point).distance(forecast.apply(*point)),
                        None => f64::INFINITY,
                    };
                    distances.extend(points.iter().map(apart));
                }
            }
        }
    }
    distances.into_iter().map(|distances| holding(HELD, distances)).collect()
}

/// Some of the points of a body, spread evenly over their order, without outliers.
fn spread_points(motion: &SharedMotion) -> Vec<DVec3> {
    let least = LIGHTEST / motion.weights.len().max(1) as f64;
    let heavy = motion.shape.iter().zip(&motion.weights).filter(|(_, weight)| **weight >= least);
    let heavy: Vec<DVec3> = heavy.map(|(point, _)| *point).collect();
    let count = heavy.len().min(BAND_POINTS);
    (0..count).map(|i| heavy[i * heavy.len() / count]).collect()
}
