//! Ground truth at any time, and which of its points each moving Gaussian belongs to.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use lgs_core::geometry::{fit_affine, narrow, nearest_rotation, outer, trace, wide};
use lgs_core::{mean_squared_neighbor_distance, nearest_indices};
use lgs_data::synth::GroundTruth;
use lgs_mechanics::bands::Verdict;

use super::numbers::{distance, most_common, percentile};
use crate::thresholds::{AFFINE, NEARLY_ALL, RIGID, TIME_TOLERANCE};

/// Ground-truth points with their state at t = 0.
pub struct Truth<'a> {
    truth: &'a GroundTruth,
    start: Vec<[f32; 3]>,
}

/// True points at a time, and the linear map of each object since t = 0.
pub struct TruthAt {
    /// Points, in the order of the file.
    pub points: Vec<[f32; 3]>,
    /// Linear map of offsets of each object by its label; static parts (−1) have one too.
    maps: BTreeMap<i32, DMat3>,
}

impl<'a> Truth<'a> {
    /// Prepares a truth; nothing if it has no points or does not cover t = 0.
    #[must_use]
    pub fn new(truth: &'a GroundTruth) -> Option<Self> {
        let start = points_at(truth, 0.0).filter(|points| !points.is_empty())?;
        Some(Self { truth, start })
    }

    /// For each position at t = 0 the nearest true point.
    #[must_use]
    pub fn matches(&self, positions: &[[f32; 3]]) -> Vec<usize> {
        nearest_indices(&self.start, positions).into_iter().map(|i| i as usize).collect()
    }

    /// The same for the Gaussians of one object. Points of the true object that most of them are nearest to
    /// are taken also where others lie nearer, by less than its points lie apart: the foot of a body is as
    /// near to the floor.
    #[must_use]
    pub fn matches_of_object(&self, positions: &[[f32; 3]]) -> Vec<usize> {
        let nearest = self.matches(positions);
        let Some(label) = most_common(nearest.iter().map(|&p| self.object(p))) else { return nearest };
        let own: Vec<usize> = (0..self.start.len()).filter(|&p| self.object(p) == label).collect();
        let points: Vec<[f32; 3]> = own.iter().map(|&p| self.start[p]).collect();
        let gaps =
            mean_squared_neighbor_distance(&points, 1).into_iter().map(|square| f64::from(square).sqrt());
        let gap = percentile(gaps.collect(), NEARLY_ALL).unwrap_or(0.0);
        let of_own = nearest_indices(&points, positions).into_iter().map(|i| own[i as usize]);
        let chosen = |((any, own), &position): ((usize, usize), &[f32; 3])| {
            let to = |point: usize| distance(position, self.start[point]);
            if to(own) <= to(any) + gap { own } else { any }
        };
        nearest.into_iter().zip(of_own).zip(positions).map(chosen).collect()
    }

    /// Points at t = 0.
    #[must_use]
    pub fn start(&self) -> &[[f32; 3]] {
        &self.start
    }

    /// Object label of a point, −1 for static parts.
    #[must_use]
    pub fn object(&self, point: usize) -> i32 {
        self.truth.object[point]
    }

    /// Law and constants of an object, as `scene.json` has them.
    #[must_use]
    pub fn law(&self, object: i32) -> Option<&'a serde_json::Value> {
        self.truth.law["objects"].get(usize::try_from(object).ok()?)
    }

    /// Verdict on its motions that a synthetic scene expects, if `scene.json` tells.
    #[must_use]
    pub fn expected_verdict(&self) -> Option<Verdict> {
        serde_json::from_value(self.truth.law.get("expected")?.clone()).ok()
    }

    /// Whether each point belongs to a dynamic object.
    #[must_use]
    pub fn moving(&self) -> Vec<bool> {
        self.truth.object.iter().map(|&object| object >= 0).collect()
    }

    /// Points at all sampled times.
    #[must_use]
    pub fn samples(&self) -> &[Vec<[f32; 3]>] {
        &self.truth.points
    }

    /// Sampled times between 0 and `t`, both included, going away from 0.
    fn times_from_zero(&self, t: f32) -> Vec<f32> {
        let mut times: Vec<f32> =
            self.truth.times.iter().copied().filter(|s| s.abs() < t.abs() && s * t > 0.0).collect();
        times.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        times.insert(0, 0.0);
        times.push(t);
        times
    }

    /// Points and linear maps at a time; nothing outside the sampled times.
    #[must_use]
    pub fn at(&self, t: f32) -> Option<TruthAt> {
        let points = points_at(self.truth, t)?;
        let mut labels = self.truth.object.clone();
        labels.sort_unstable();
        labels.dedup();
        let maps = labels.into_iter().map(|label| (label, self.linear_map(label, &points))).collect();
        Some(TruthAt { points, maps })
    }

    /// Path length of every point from 0 to `t`, along the sampled times.
    #[must_use]
    pub fn path_lengths(&self, t: f32) -> Option<Vec<f64>> {
        let mut lengths = vec![0.0; self.start.len()];
        let mut last = self.start.clone();
        for time in self.times_from_zero(t) {
            let next = points_at(self.truth, time)?;
            for (length, (&a, &b)) in lengths.iter_mut().zip(last.iter().zip(&next)) {
                *length += distance(a, b);
            }
            last = next;
        }
        Some(lengths)
    }

    /// Where a position at t = 0 that belongs to a point is at another time, if it is fixed to the point's
    /// object.
    #[must_use]
    pub fn carried(&self, at: &TruthAt, point: usize, position: [f32; 3]) -> [f32; 3] {
        let offset = wide(position) - wide(self.start[point]);
        narrow(wide(at.points[point]) + at.maps[&self.object(point)] * offset)
    }

    /// How offsets from an object's points have changed since t = 0: by their least-squares rotation, and by
    /// their linear map where that leaves a small part of what the rotation does, as for a body that
    /// stretches.
    fn linear_map(&self, label: i32, points: &[[f32; 3]]) -> DMat3 {
        let members: Vec<usize> = (0..points.len()).filter(|&p| self.object(p) == label).collect();
        let center =
            |of: &[[f32; 3]]| members.iter().map(|&p| wide(of[p])).sum::<DVec3>() / members.len() as f64;
        let (from, to) = (center(&self.start), center(points));
        let pairs: Vec<[DVec3; 2]> =
            members.iter().map(|&p| [wide(self.start[p]) - from, wide(points[p]) - to]).collect();
        let moment: DMat3 = pairs.iter().map(|&[before, after]| outer(after, before)).sum();
        let covariance: DMat3 = pairs.iter().map(|&[before, _]| outer(before, before)).sum();
        let rotation = nearest_rotation(&moment);
        let linear = fit_affine(&moment, &covariance, &rotation);
        let left = |map: &DMat3| pairs.iter().map(|&[a, b]| (*map * a).distance_squared(b)).sum::<f64>();
        let [of_rotation, of_linear] = [left(&rotation), left(&linear)];
        let is_seen = of_rotation > RIGID.powi(2) * trace(&covariance);
        if is_seen && of_linear < AFFINE.powi(2) * of_rotation { linear } else { rotation }
    }
}

/// Points at a time, linear between samples.
fn points_at(truth: &GroundTruth, t: f32) -> Option<Vec<[f32; 3]>> {
    let times = &truth.times;
    let (first, last) = (*times.first()?, *times.last()?);
    if !(first - TIME_TOLERANCE..=last + TIME_TOLERANCE).contains(&t) {
        return None;
    }
    if times.len() == 1 {
        return truth.points.first().cloned();
    }
    let after = times.partition_point(|&s| s <= t).clamp(1, times.len() - 1);
    let (t0, t1) = (times[after - 1], times[after]);
    let weight = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
    let blend = |(p, q): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| p[c] + weight * (q[c] - p[c]));
    Some(truth.points[after - 1].iter().zip(&truth.points[after]).map(blend).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight corners of a cube that turns about z and falls.
    fn cube() -> GroundTruth {
        let times: Vec<f32> = (-75..=225).map(|i| i as f32 * 0.01).collect();
        let corner = |i: usize, t: f32| {
            let signs: [f32; 3] = std::array::from_fn(|c| if i >> c & 1 == 0 { -0.3 } else { 0.2 });
            let (s, c) = (3.0 * t).sin_cos();
            [c * signs[0] - s * signs[1], s * signs[0] + c * signs[1], signs[2] - t * t]
        };
        let points = times.iter().map(|&t| (0..8).map(|i| corner(i, t)).collect()).collect();
        GroundTruth { times, points, object: vec![0; 8], ..GroundTruth::default() }
    }

    #[test]
    fn a_point_beside_the_surface_is_carried_with_the_object() {
        let cube = cube();
        let truth = Truth::new(&cube).expect("truth");
        let at = truth.at(2.0).expect("time");
        let carried = truth.carried(&at, 0, [0.0, 0.0, 0.1]);
        assert!(distance(carried, [0.0, 0.0, 0.1 - 4.0]) < 1e-3, "the axis only falls: {carried:?}");
    }

    #[test]
    fn a_point_inside_of_a_body_that_stretches_is_stretched_with_it() {
        let mut cube = cube();
        let start = cube.points[75].clone();
        for (points, &time) in cube.points.iter_mut().zip(&cube.times) {
            *points = start.iter().map(|&[x, y, z]| [(1.0 + time) * x, y + time * z, z]).collect();
        }
        let truth = Truth::new(&cube).expect("truth");
        let at = truth.at(0.5).expect("time");
        let carried = truth.carried(&at, 0, [0.1, 0.05, -0.1]);
        assert!(distance(carried, [0.15, 0.0, -0.1]) < 1e-5, "{carried:?}");
    }

    #[test]
    fn the_foot_of_a_body_belongs_to_it_and_not_to_the_floor_below() {
        let mut cube = cube();
        for points in &mut cube.points {
            // A floor just below the lower corners, and far beside them.
            points.extend([[-0.3, -0.3, -0.31], [2.0, 0.0, -0.31]]);
        }
        cube.object.extend([-1, -1]);
        let truth = Truth::new(&cube).expect("truth");
        let positions =
            [[-0.3, -0.3, -0.306], [0.2, 0.2, 0.2], [-0.3, 0.2, 0.2], [0.2, -0.3, 0.2], [1.9, 0.0, -0.3]];
        assert_eq!(truth.object(truth.matches(&positions)[0]), -1);
        let objects: Vec<i32> =
            truth.matches_of_object(&positions).into_iter().map(|point| truth.object(point)).collect();
        assert_eq!(objects, [0, 0, 0, 0, -1], "what is far from it is not on it");
    }

    #[test]
    fn a_truth_of_one_time_is_known_then_alone() {
        let still = GroundTruth {
            times: vec![0.0],
            points: vec![vec![[1.0, 2.0, 3.0]]],
            object: vec![0],
            ..GroundTruth::default()
        };
        let truth = Truth::new(&still).expect("truth");
        assert!(truth.at(0.0).is_some_and(|at| at.points == [[1.0, 2.0, 3.0]]) && truth.at(0.5).is_none());
    }

    #[test]
    fn paths_count_away_from_zero_both_ways() {
        let cube = cube();
        let truth = Truth::new(&cube).expect("truth");
        let (future, past) =
            (truth.path_lengths(0.5).expect("future"), truth.path_lengths(-0.5).expect("past"));
        for (a, b) in future.iter().zip(past) {
            assert!((a - b).abs() < 1e-3 && *a > 0.5);
        }
        assert!(truth.path_lengths(2.5).is_none() && truth.at(-0.76).is_none());
    }
}
