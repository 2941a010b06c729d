//! The geometry of coordinates as something that can change: where an axis, a pivot, a centre of mass or a
//! normal mode lies. The points of the object stay where they are in the configuration of the start.

use super::{AffineMode, Coordinates, Modal, Rolling, State};
use glam::DVec3;
use lgs_core::geometry::{exp, quaternion};

impl Coordinates {
    /// Number of constants of the geometry that [`Self::change_geometry`] changes: the centre of mass of a
    /// free body, one that deforms in flight included, and the pivot of a ball joint have three, an axis has
    /// two for its direction and two for its place, a second one on the first body two more; a rolling body
    /// has two for its direction, four for its axis and one for its radius, and each mode has one for every
    /// other one.
    #[must_use]
    pub fn geometry(&self) -> usize {
        match self {
            Self::Rigid(_) | Self::Ball(_) => 3,
            Self::Hinge(_) => 4,
            Self::Tree(_) => 6,
            Self::Rolling(_) => 7,
            Self::Modal(modal) => modal.shares() + if modal.flies() { 3 } else { 0 },
            Self::Point | Self::Slider(_) | Self::Pair => 0,
        }
    }

    /// Whether each of the changes is one of a direction, radians or shares, and not a length.
    #[must_use]
    pub fn geometry_turns(&self) -> Vec<bool> {
        let turns = match self {
            Self::Hinge(_) | Self::Tree(_) => 2,
            Self::Rolling(_) => 4,
            Self::Modal(modal) => modal.shares(),
            _ => 0,
        };
        (0..self.geometry()).map(|i| i < turns).collect()
    }

    /// Changes the geometry by some lengths and angles, one for each of [`Self::geometry`]; `start` is where
    /// the motion begins.
    pub fn change_geometry(&mut self, start: &mut State, by: &[f64]) {
        match self {
            Self::Rigid(_) => {
                // Another point of the body, in its own axes, takes the part of the centre of mass.
                let (offset, turn) = (DVec3::from_slice(by), quaternion(&start.x).normalize());
                let spin = DVec3::from_slice(&start.v);
                add(&mut start.x[4..], turn * offset);
                add(&mut start.v[3..], turn * spin.cross(offset));
            }
            Self::Ball(ball) => {
                let offset = DVec3::from_slice(by);
                add(&mut ball.pivot, offset);
                // A body that turns about its centre goes on to, and has no parameters of an arm.
                if DVec3::from(ball.arm) != DVec3::ZERO {
                    add(&mut ball.arm, -(quaternion(&start.x).normalize().inverse() * offset));
                }
            }
            Self::Hinge(hinge) => change_axis(by, &mut hinge.axis, &mut hinge.pivot),
            Self::Tree(tree) => {
                let (first, second) = DVec3::from_array(tree.axis).any_orthonormal_pair();
                let joint =
                    exp(DVec3::from_array(tree.axis) * -start.x[0]) * (first * by[4] + second * by[5]);
                change_axis(by, &mut tree.axis, &mut tree.pivot);
                add(&mut tree.link, joint);
            }
            Self::Rolling(rolling) => rolling.change(by),
            Self::Modal(modal) => {
                let (shares, center) = by.split_at(modal.shares());
                modal.mix(shares);
                if modal.flies() {
                    modal.move_center(DVec3::from_slice(center));
                }
            }
            Self::Point | Self::Slider(_) | Self::Pair => {}
        }
    }
}

impl Rolling {
    fn change(&mut self, by: &[f64]) {
        self.direction = turned(self.direction, &by[..2]);
        change_axis(&[by[2], by[3], by[4], by[5]], &mut self.axis, &mut self.center);
        self.radius += by[6];
    }
}

impl Modal {
    /// Shares of each mode in every other one, the translations of a body in flight not among them.
    fn shares(&self) -> usize {
        let modes = self.deformation().len();
        modes * modes.saturating_sub(1)
    }

    /// Adds to each of them a share of every other one, mode by mode.
    fn mix(&mut self, by: &[f64]) {
        let old = self.deformation().to_vec();
        let mut shares = by.iter();
        for (to, mode) in self.affine.iter_mut().take(old.len()).enumerate() {
            for (_, other) in old.iter().enumerate().filter(|(from, _)| *from != to) {
                mode.add(other, shares.next().copied().unwrap_or(0.0));
            }
        }
    }
}

impl AffineMode {
    /// Adds a share of another mode.
    pub fn add(&mut self, other: &Self, share: f64) {
        let (own, others) = (self.linear.as_flattened_mut(), other.linear.as_flattened());
        own.iter_mut().zip(others).for_each(|(own, other)| *own += share * other);
        self.shift.iter_mut().zip(other.shift).for_each(|(own, other)| *own += share * other);
    }
}

/// A direction turned by two small angles across it.
fn turned(direction: [f64; 3], by: &[f64]) -> [f64; 3] {
    let old = DVec3::from_array(direction);
    let (first, second) = old.any_orthonormal_pair();
    (old + first * by[0] + second * by[1]).normalize().to_array()
}

/// Turns an axis by the first two of some changes, and moves its point across it by the next two.
fn change_axis(by: &[f64], axis: &mut [f64; 3], pivot: &mut [f64; 3]) {
    let (first, second) = DVec3::from_array(*axis).any_orthonormal_pair();
    *axis = turned(*axis, by);
    add(pivot, first * by[2] + second * by[3]);
}

fn add(values: &mut [f64], change: DVec3) {
    values.iter_mut().zip(change.to_array()).for_each(|(value, change)| *value += change);
}

#[cfg(test)]
mod tests {
    use crate::coordinates::{
        AffineMode, Ball, Coordinates, Embedding, Inertia, InertiaForm, Modal, Rolling, State,
    };
    use glam::DVec3;

    #[test]
    fn modes_take_shares_of_each_other() {
        let mode = |x: f64| AffineMode { linear: [[x, 0.0, 0.0]; 3], shift: [0.0, x, 0.0] };
        let modes = Modal { affine: vec![mode(1.0), mode(10.0)], further: 0 };
        let mut coordinates = Coordinates::Modal(modes);
        assert_eq!(coordinates.geometry_turns(), [true; 2]);
        coordinates.change_geometry(&mut State { x: vec![0.0; 2], v: vec![0.0; 2] }, &[0.1, 0.5]);
        let expected = Modal { affine: vec![mode(2.0), mode(10.5)], further: 0 };
        assert_eq!(coordinates, Coordinates::Modal(expected));
    }

    #[test]
    fn a_body_that_turns_about_its_centre_gets_no_parameters_of_an_arm() {
        let inertia = Inertia { form: InertiaForm::Whole, ..Inertia::ball(1.0) };
        let ball = Ball { pivot: [0.0; 3], arm: [0.0; 3], inertia };
        let mut coordinates = Coordinates::Ball(ball);
        let mut start = State { x: vec![1.0, 0.0, 0.0, 0.0], v: vec![0.0; 3] };
        coordinates.change_geometry(&mut start, &[0.1, 0.2, 0.3]);
        assert_eq!(coordinates, Coordinates::Ball(Ball { pivot: [0.1, 0.2, 0.3], ..ball }));
    }

    #[test]
    fn a_changed_body_rolls_about_another_axis_by_another_length() {
        let (direction, axis) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let rolling = Rolling { direction, axis, radius: 0.5, center: [0.0; 3] };
        let mut coordinates = Coordinates::Rolling(rolling);
        let mut start = State { x: vec![0.0], v: vec![1.0] };
        coordinates.change_geometry(&mut start, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.2, 0.5]);
        let Coordinates::Rolling(Rolling { center, radius, .. }) = &coordinates else { panic!() };
        let (center, radius) = (DVec3::from(*center), *radius);
        assert!((radius - 1.0).abs() < 1e-12 && (center.length() - 0.2).abs() < 1e-12);
        // The points of the new axis stay on the line along which it moves.
        let moved = Embedding::new(&coordinates, &[0.0]).placements(&[0.3])[0].apply(center);
        assert!((moved - center).distance(DVec3::new(0.3, 0.0, 0.0)) < 1e-12, "{moved}");
    }

    #[test]
    fn another_centre_of_a_body_in_flight_stays_while_the_body_deforms() {
        let stretch = AffineMode { linear: [[0.5, 0.0, 0.0], [0.0; 3], [0.0; 3]], shift: [0.0; 3] };
        let mut coordinates = Coordinates::Modal(Modal::in_flight(&[stretch]));
        assert_eq!(coordinates.geometry_turns(), [false; 3]);
        let mut start = State { x: vec![0.0; 4], v: vec![0.0; 4] };
        let center = DVec3::new(0.2, 0.1, -0.3);
        coordinates.change_geometry(&mut start, &center.to_array());
        let placed = Embedding::new(&coordinates, &start.x).placements(&[0.7, 1.0, 2.0, 3.0])[0];
        let moved = DVec3::new(1.0, 2.0, 3.0);
        assert!((placed.apply(center) - center - moved).length() < 1e-12);
        assert!((placed.apply(DVec3::X) - DVec3::X - moved - 0.35 * 0.8 * DVec3::X).length() < 1e-12);
    }
}
