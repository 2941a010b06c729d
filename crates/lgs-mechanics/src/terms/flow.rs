//! Forces of what surrounds a body and moves, or has energy to give.
//!
//! - Wind: quadratic drag against air that moves at a constant velocity, `Q = −k |w − u| (w − u)`.
//! - Swirl: `Q = s × (y − c)`, which together with a linear drag `−d w` is the drag against a liquid that
//!   turns about `c` at the rate `s / d`.
//! - Self-excitation: `Q = (g + b · z − h |z|²) w`, `z = y − m` about the middle `m` of the observed path,
//!   which is `(g' − h |z − c|²) w` about `c = b / 2h`: a push along the velocity near a centre and a drag
//!   far from it (Van der Pol), so that motions end on a cycle. Slopes have a prior, since a path along a
//!   line tells nothing of those across it.

use super::kind::{At, Block, Derivatives, Label, Role, TermKind, default_start};
use super::quadratic::{dot, offset};
use crate::parameter::{Entry, Parameter, Quantity, Scales, Space, axis_name};
use crate::thresholds::{SLOPE_SPREAD, STARTING_WIND};
use glam::DVec3;
use smallvec::SmallVec;

/// The kind `wind-drag`.
pub(super) const WIND: Wind = Wind;
/// The kind `swirl`.
pub(super) const SWIRL: Swirl = Swirl;
/// The kind `self-excitation`.
pub(super) const SELF_EXCITATION: SelfExcitation = SelfExcitation;

/// Drag against wind.
#[derive(Debug)]
pub(super) struct Wind;

/// A force around an axis.
#[derive(Debug)]
pub(super) struct Swirl;

/// A push near a centre and a drag far from it.
#[derive(Debug)]
pub(super) struct SelfExcitation;

impl SelfExcitation {
    /// Places of saturation and middle among the parameters, after growth and slopes.
    const SATURATION: usize = 4;
    const MIDDLE: usize = 5;

    /// Offset from the middle, and the coefficient of the velocity.
    fn rate(p: &[f64], y: &[f64]) -> (SmallVec<[f64; 6]>, f64) {
        let offset = offset(&p[Self::MIDDLE..], y);
        let square = dot(&offset, &offset);
        let rate = p[0] + dot(&p[1..Self::SATURATION], &offset) - p[Self::SATURATION] * square;
        (offset, rate)
    }
}

fn is_place(space: Space) -> bool {
    space.dimension == 3 && space.quantity == Quantity::Place
}

impl TermKind for Wind {
    fn label(&self) -> Label {
        Label { name: "wind-drag", role: Role::Drives }
    }

    fn suits(&self, space: Space) -> bool {
        is_place(space)
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let drag = Parameter::linear("drag", -1, 0).within(0.0, f64::INFINITY);
        let wind = |axis| Parameter::nonlinear(format!("wind-{}", axis_name(space.dimension, axis)), 1, -1);
        std::iter::once(drag).chain((0..space.dimension).map(wind)).collect()
    }

    fn depends_on_velocity(&self) -> bool {
        true
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let against = offset(&p[1..], at.w);
        let speed = dot(&against, &against).sqrt();
        force.iter_mut().zip(&against).for_each(|(f, a)| *f = -p[0] * speed * a);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let against = offset(&p[1..], at.w);
        let speed = dot(&against, &against).sqrt();
        // The derivative in still air is zero, whatever the direction.
        let slope = if speed > 0.0 { p[0] / speed } else { 0.0 };
        for (i, a) in against.iter().enumerate() {
            for (j, b) in against.iter().enumerate() {
                out.w[(i, j)] = -slope * a * b - if i == j { p[0] * speed } else { 0.0 };
                out.p[(i, 1 + j)] = -out.w[(i, j)];
            }
            out.p[(i, 0)] = -speed * a;
        }
    }

    fn starts(&self, space: Space, scales: &Scales) -> Vec<Vec<f64>> {
        let parameters = self.parameters(space);
        let still = default_start(&parameters, space, scales);
        let speed = STARTING_WIND * scales.of(&parameters[1], space);
        let along = |axis: &Vec<f64>| {
            [-1.0, 1.0].map(|side| {
                let mut start = still.clone();
                start[1..].iter_mut().zip(axis).for_each(|(u, a)| *u = side * speed * a);
                start
            })
        };
        let windy: Vec<Vec<f64>> = scales.directions_of(space).iter().flat_map(along).collect();
        std::iter::once(still).chain(windy).collect()
    }
}

impl TermKind for Swirl {
    fn label(&self) -> Label {
        Label { name: "swirl", role: Role::Drives }
    }

    fn suits(&self, space: Space) -> bool {
        is_place(space)
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let swirl = |axis| Parameter::linear(format!("swirl-{}", axis_name(space.dimension, axis)), 0, -2);
        let center = |axis| Parameter::place("center", axis, space);
        (0..space.dimension).map(swirl).chain((0..space.dimension).map(center)).collect()
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let around = DVec3::from_slice(p).cross(DVec3::from_slice(at.y) - DVec3::from_slice(&p[3..]));
        force.copy_from_slice(&around.to_array());
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let swirl = DVec3::from_slice(p);
        let arm = DVec3::from_slice(at.y) - DVec3::from_slice(&p[3..]);
        for (j, axis) in DVec3::AXES.into_iter().enumerate() {
            let (by_place, by_swirl) = (swirl.cross(axis), axis.cross(arm));
            for i in 0..3 {
                out.y[(i, j)] = by_place[i];
                out.p[(i, j)] = by_swirl[i];
                out.p[(i, 3 + j)] = -by_place[i];
            }
        }
    }

    /// Columns `e_i × y` of the swirl, and the identity for `−s × c`.
    fn columns(&self, _space: Space) -> usize {
        6
    }

    fn design(&self, _p: &[f64], at: At<'_>, _linear: &[usize], out: &mut Block) {
        for (j, axis) in DVec3::AXES.into_iter().enumerate() {
            let around = axis.cross(DVec3::from_slice(at.y));
            (0..3).for_each(|i| out[(i, j)] = around[i]);
            out[(j, 3 + j)] = 1.0;
        }
    }

    fn regressed(&self, p: &[f64], coefficients: &[f64], _space: Space) -> Vec<f64> {
        let [swirl, offset] = [0, 3].map(|first| DVec3::from_slice(&coefficients[first..]));
        // Any point of the axis: that nearest to the origin.
        let center = swirl.cross(offset) / swirl.length_squared();
        let center = if center.is_finite() { center } else { DVec3::from_slice(&p[3..]) };
        [swirl.to_array(), center.to_array()].concat()
    }
}

impl TermKind for SelfExcitation {
    fn label(&self) -> Label {
        Label { name: "self-excitation", role: Role::Drives }
    }

    fn suits(&self, space: Space) -> bool {
        is_place(space)
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let name = |what: &str, axis| format!("{what}-{}", axis_name(space.dimension, axis));
        let slope = |axis| Parameter::linear(name("slope", axis), -1, -1).spread(SLOPE_SPREAD);
        let middle = |axis| {
            let free = Parameter::nonlinear(name("middle", axis), 1, 0);
            Parameter { entry: Entry::Constant, ..free }
        };
        let saturation = Parameter::linear("saturation", -2, -1).within(0.0, f64::INFINITY);
        let (slopes, middles) = ((0..space.dimension).map(slope), (0..space.dimension).map(middle));
        let growth = Parameter::linear("growth", 0, -1);
        std::iter::once(growth).chain(slopes).chain([saturation]).chain(middles).collect()
    }

    fn depends_on_velocity(&self) -> bool {
        true
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let (_, rate) = Self::rate(p, at.y);
        force.iter_mut().zip(at.w).for_each(|(f, w)| *f = rate * w);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let (offset, rate) = Self::rate(p, at.y);
        let (square, saturation) = (dot(&offset, &offset), p[Self::SATURATION]);
        for (i, w) in at.w.iter().enumerate() {
            out.w[(i, i)] = rate;
            out.p[(i, 0)] = *w;
            out.p[(i, Self::SATURATION)] = -square * w;
            for (j, offset) in offset.iter().enumerate() {
                out.y[(i, j)] = (p[1 + j] - 2.0 * saturation * offset) * w;
                out.p[(i, 1 + j)] = offset * w;
                out.p[(i, Self::MIDDLE + j)] = -out.y[(i, j)];
            }
        }
    }

    fn starts(&self, space: Space, scales: &Scales) -> Vec<Vec<f64>> {
        let mut start = default_start(&self.parameters(space), space, scales);
        start[Self::MIDDLE..].copy_from_slice(&scales.origin_of(space));
        vec![start]
    }
}

#[cfg(test)]
mod tests {
    use super::{At, SELF_EXCITATION, SWIRL, TermKind};
    use crate::parameter::Space;

    #[test]
    fn the_axis_of_a_swirl_is_read_off_its_regression() {
        // 2 e_z × (y − c) with c = (0.5, −1, 0): the swirl, and −s × c.
        let p = SWIRL.regressed(&[0.0; 6], &[0.0, 0.0, 2.0, -2.0, -1.0, 0.0], Space::PLACE);
        assert_eq!(p, [0.0, 0.0, 2.0, 0.5, -1.0, 0.0]);
        let mut force = [1.0; 3];
        SWIRL.force(&p, At { y: &[1.5, -1.0, 4.0], w: &[0.0; 3] }, &mut force);
        assert_eq!(force, [0.0, 2.0, 0.0]);
    }

    #[test]
    fn self_excitation_is_the_same_about_any_middle() {
        // (3 − 2 |y − c|²) w with c = (0.5, −1, 0), about c and about the origin.
        let about_center = [3.0, 0.0, 0.0, 0.0, 2.0, 0.5, -1.0, 0.0];
        let about_origin = [0.5, 2.0, -4.0, 0.0, 2.0, 0.0, 0.0, 0.0];
        for p in [about_center, about_origin] {
            let mut force = [9.0; 3];
            SELF_EXCITATION.force(&p, At { y: &[1.5, -1.0, 0.0], w: &[1.0, 0.0, 2.0] }, &mut force);
            assert_eq!(force, [1.0, 0.0, 2.0]);
        }
    }
}
