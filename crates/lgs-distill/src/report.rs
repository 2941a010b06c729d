//! The report of stage 1 on an object.

use crate::laws::linear::law::Law;
use crate::laws::linear::terms::Terms;
use crate::motion::object_motion::PathKind;
use serde::{Deserialize, Serialize};

/// Figures of one object's stage 1. Lengths are world units, root mean squares over particles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DistillReport {
    /// Particles.
    pub particles: usize,
    /// Origin of the paths.
    pub paths: PathKind,
    /// Standard deviation per coordinate of the noise that is independent from sample to sample.
    pub independent_noise: f64,
    /// Residual per coordinate of the trajectories around the paths (0 for independent ones).
    pub shared_residual: f64,
    /// Root mean square displacement from the first sample.
    pub displacement: f64,
    /// Degree of the polynomials in time.
    pub degree: usize,
    /// Terms of the linear law, if there is one.
    pub terms: Option<Terms>,
    /// Constants of the linear law, if there is one.
    pub law: Option<Law>,
    /// Whether the object is under the rigid constraint (see [`crate::Distilled::supports`]).
    pub rigid_constraint: bool,
    /// Position error at held-out samples of a fit without them, if it was measured.
    pub forecast_error: Option<f64>,
    /// Position error inside of the window.
    pub window_error: f64,
    /// Whether networks learned what the linear law leaves.
    pub networks: bool,
    /// `‖Q‖/‖∇U‖` at the visited states (Q alone if there is no potential).
    pub force_ratio: f64,
}
