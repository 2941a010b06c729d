//! Generalised coordinates: the configuration of an object, its kinetic energy and its embedding in space.
//!
//! | coordinates | `x` | `v` | kinetic energy per mass |
//! |---|---|---|---|
//! | `Point` | centre, 3 | its velocity | `½ |v|²` |
//! | `Rigid` | quaternion and centre, 7 | angular and linear velocity, 6 | `½ |ċ|² + ½ ω · I ω` |
//! | `Hinge`, `Slider`, `Rolling` | angle or offset, 1 | its rate | `½ v²` |
//! | `Ball` | quaternion, 4 | angular velocity, 3 | `½ ω · I ω`, about the pivot |
//! | `Modal` | amplitudes | their rates | `½ |v|²` |
//! | `Tree` | two absolute angles | their rates | `½ v · M(x) v` |
//! | `Pair` | two centres, 6 | their velocities | `½ |v₁|² + ½ μ |v₂|²` |
//!
//! Quaternions (w, x, y, z) turn the principal axes of the inertia to the world's; angular velocities are in
//! principal axes, everything else in the world's.
//!
//! Changes of `x` are tangent vectors of as many components as `v`: [`Coordinates::retract`] applies one,
//! [`Coordinates::difference`] finds it. For a rotation `R` it is the rotation vector `δ` in body axes,
//! `R exp(δ)`.

mod bodies;
mod embedding;
mod energy;
mod geometry;
mod inertia;
mod joint;
mod layout;
mod modal;
mod port;
mod tree;

pub use bodies::Bodies;
pub use embedding::{Embedding, Placement, PlacementRate};
pub(crate) use inertia::BESIDE;
pub use inertia::{Inertia, InertiaForm};
pub use joint::{Ball, Hinge, Rolling, Slider};
pub use modal::{AffineMode, Modal};
pub use port::Port;
pub(crate) use port::Site;
pub use tree::Tree;

use serde::{Deserialize, Serialize};

/// The coordinates of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Coordinates {
    /// The centre of a body or a single particle.
    Point,
    /// Rotation and centre of a rigid body.
    Rigid(Inertia),
    /// A body that turns about a fixed axis.
    Hinge(Hinge),
    /// A body that slides along a line without turning.
    Slider(Slider),
    /// A round body that rolls along a line.
    Rolling(Rolling),
    /// A body that turns about a fixed point.
    Ball(Ball),
    /// A deforming body.
    Modal(Modal),
    /// Two bodies on a chain of two parallel hinges.
    Tree(Tree),
    /// Two points, each a fixed vector from where it acts on the other one.
    Pair,
}

/// Configuration and velocity at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Configuration.
    pub x: Vec<f64>,
    /// Velocity.
    pub v: Vec<f64>,
}
