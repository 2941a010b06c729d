//! Where the points of an object are in a configuration: `q_i = φ_i(x)`, and how they are turned.

use super::{Coordinates, Modal, Tree};
use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{cross_matrix, exp, fit_rotation, quaternion};

/// An affine map of the points of a body from a reference configuration: `q = linear (X − from) + to`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Linear part: a rotation for rigid bodies.
    pub linear: DMat3,
    /// Rotation of each point's Gaussian: that of the body, or the one nearest to the linear part.
    pub rotation: DQuat,
    /// A point of the reference, world units.
    pub from: DVec3,
    /// Where it is, world units.
    pub to: DVec3,
}

/// Change of a [`Placement`] along a change of the configuration: `δq = linear (X − from) + to`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacementRate {
    /// Change of the linear part.
    pub linear: DMat3,
    /// A point of the reference.
    pub from: DVec3,
    /// Change of where it is.
    pub to: DVec3,
}

impl Placement {
    /// The position of a point whose reference position is `point`.
    #[must_use]
    pub fn apply(&self, point: DVec3) -> DVec3 {
        self.linear * (point - self.from) + self.to
    }

    fn rigid(rotation: DQuat, from: DVec3, to: DVec3) -> Self {
        Self { linear: DMat3::from_quat(rotation), rotation, from, to }
    }
}

impl PlacementRate {
    /// The change of the position of a point whose reference position is `point`.
    #[must_use]
    pub fn apply(&self, point: DVec3) -> DVec3 {
        self.linear * (point - self.from) + self.to
    }

    /// Turning by `spin` (world axes) and moving.
    fn rigid(placed: &Placement, spin: DVec3, to: DVec3) -> Self {
        Self { linear: cross_matrix(spin) * placed.linear, from: placed.from, to }
    }
}

/// The points of an object relative to a reference configuration, in which their positions are known.
///
/// ```
/// use lgs_mechanics::coordinates::{Coordinates, Embedding, Hinge};
///
/// let hinge = Coordinates::Hinge(Hinge { axis: [0.0, 0.0, 1.0], pivot: [1.0, 0.0, 0.0] });
/// let embedding = Embedding::new(&hinge, &[0.0]);
/// let quarter = embedding.placements(&[std::f64::consts::FRAC_PI_2]);
/// let moved = quarter[0].apply(glam::DVec3::new(2.0, 0.0, 0.0));
/// assert!((moved - glam::DVec3::new(1.0, 1.0, 0.0)).length() < 1e-12);
/// ```
#[derive(Clone, Debug)]
pub struct Embedding<'a> {
    coordinates: &'a Coordinates,
    reference: &'a [f64],
}

impl<'a> Embedding<'a> {
    /// The embedding of coordinates whose points have their known positions at `reference`.
    #[must_use]
    pub fn new(coordinates: &'a Coordinates, reference: &'a [f64]) -> Self {
        Self { coordinates, reference }
    }

    /// Where the points of each body are: two bodies for pairs and trees, one for everything else. Modes
    /// beyond the affine ones move points by amounts of their own on top.
    #[must_use]
    pub fn placements(&self, x: &[f64]) -> Vec<Placement> {
        let reference = self.reference;
        let shift = |from: DVec3, to: DVec3| Placement::rigid(DQuat::IDENTITY, from, to);
        let turned = || (quaternion(x) * quaternion(reference).inverse()).normalize();
        let place = |x: &[f64], at: usize| DVec3::from_slice(&x[at..]);
        let one = match self.coordinates {
            Coordinates::Point => shift(place(reference, 0), place(x, 0)),
            Coordinates::Pair => {
                return [0, 3].map(|at| shift(place(reference, at), place(x, at))).to_vec();
            }
            Coordinates::Rigid(_) => Placement::rigid(turned(), place(reference, 4), place(x, 4)),
            Coordinates::Ball(ball) => Placement::rigid(turned(), ball.pivot.into(), ball.pivot.into()),
            Coordinates::Hinge(hinge) => {
                let turn = exp(DVec3::from(hinge.axis) * (x[0] - reference[0]));
                Placement::rigid(turn, hinge.pivot.into(), hinge.pivot.into())
            }
            Coordinates::Slider(slider) => {
                shift(DVec3::ZERO, DVec3::from(slider.direction) * (x[0] - reference[0]))
            }
            Coordinates::Rolling(rolling) => {
                let at = |s: f64| DVec3::from(rolling.center) + DVec3::from(rolling.direction) * s;
                let turn = exp(DVec3::from(rolling.axis) * ((x[0] - reference[0]) / rolling.radius));
                Placement::rigid(turn, at(reference[0]), at(x[0]))
            }
            Coordinates::Modal(modal) => modal.placement(reference, x),
            Coordinates::Tree(tree) => return tree.placements(reference, x).to_vec(),
        };
        vec![one]
    }

    /// How the placements change along a change of the configuration `[freedoms]`: velocities for `change =
    /// v`, columns of Jacobians for unit changes.
    #[must_use]
    pub fn rates(&self, x: &[f64], change: &[f64]) -> Vec<PlacementRate> {
        let placed = self.placements(x);
        let vector = |at: usize| DVec3::from_slice(&change[at..]);
        let spin = || quaternion(x) * vector(0);
        let rate = |spin: DVec3, to: DVec3| PlacementRate::rigid(&placed[0], spin, to);
        let one = match self.coordinates {
            Coordinates::Point => rate(DVec3::ZERO, vector(0)),
            Coordinates::Pair => {
                let rates = [0, 1].map(|i| PlacementRate::rigid(&placed[i], DVec3::ZERO, vector(3 * i)));
                return rates.to_vec();
            }
            Coordinates::Rigid(_) => rate(spin(), vector(3)),
            Coordinates::Ball(_) => rate(spin(), DVec3::ZERO),
            Coordinates::Hinge(hinge) => rate(DVec3::from(hinge.axis) * change[0], DVec3::ZERO),
            Coordinates::Slider(slider) => rate(DVec3::ZERO, DVec3::from(slider.direction) * change[0]),
            Coordinates::Rolling(rolling) => {
                let spin = DVec3::from(rolling.axis) * (change[0] / rolling.radius);
                rate(spin, DVec3::from(rolling.direction) * change[0])
            }
            Coordinates::Modal(modal) => modal.rate(self.reference, change),
            Coordinates::Tree(tree) => {
                let axis = DVec3::from(tree.axis);
                let link = exp(axis * x[0]) * DVec3::from(tree.link);
                let joint = (axis * change[0]).cross(link);
                return vec![
                    PlacementRate::rigid(&placed[0], axis * change[0], DVec3::ZERO),
                    PlacementRate::rigid(&placed[1], axis * change[1], joint),
                ];
            }
        };
        vec![one]
    }
}

impl Tree {
    /// The two bodies, each about its own hinge.
    fn placements(&self, reference: &[f64], x: &[f64]) -> [Placement; 2] {
        let [axis, pivot, link] = [self.axis, self.pivot, self.link].map(DVec3::from_array);
        let joint = |angle: f64| pivot + exp(axis * angle) * link;
        let turn = |body: usize| exp(axis * (x[body] - reference[body]));
        [Placement::rigid(turn(0), pivot, pivot), Placement::rigid(turn(1), joint(reference[0]), joint(x[0]))]
    }
}

impl Modal {
    /// `(Σ x_k A_k, Σ x_k b_k)`.
    fn sum(&self, x: &[f64]) -> (DMat3, DVec3) {
        let mut sum = (DMat3::ZERO, DVec3::ZERO);
        for (mode, &amplitude) in self.affine.iter().zip(x) {
            sum.0 += DMat3::from_cols_array_2d(&mode.linear).transpose() * amplitude;
            sum.1 += DVec3::from(mode.shift) * amplitude;
        }
        sum
    }

    /// From the reference to the rest and on to `x`.
    fn placement(&self, reference: &[f64], x: &[f64]) -> Placement {
        let (linear, shift) = self.sum(reference);
        let (next, to) = self.sum(x);
        let linear = (DMat3::IDENTITY + next) * (DMat3::IDENTITY + linear).inverse();
        Placement { linear, rotation: fit_rotation(&linear).rotation, from: shift, to }
    }

    fn rate(&self, reference: &[f64], change: &[f64]) -> PlacementRate {
        let (linear, from) = self.sum(reference);
        let (rate, to) = self.sum(change);
        PlacementRate { linear: rate * (DMat3::IDENTITY + linear).inverse(), from, to }
    }
}
