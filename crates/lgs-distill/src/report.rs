//! The report of stage 1 on an object.

use crate::config::DistillConfig;
use crate::laws::linear::law::Law;
use crate::laws::linear::terms::Terms;
use crate::motion::object_motion::{ObjectMotion, PathKind};
use crate::thresholds::{RESIDUAL_TOLERANCE, UNRESOLVED_ERRORS};
use lgs_mechanics::bands::Verdict;
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
    /// The law in generalised coordinates, if the object follows one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub generalised: Option<GeneralisedReport>,
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

/// A law in generalised coordinates, and what is known of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeneralisedReport {
    /// Coordinates, terms and the values of all parameters with their standard deviations, world units.
    pub law: lgs_mechanics::Law,
    /// χ² of the whitened poses for each degree of freedom: near 1 for a law that explains them.
    pub chi_square: f64,
    /// Whether the law explains the motion.
    pub verdict: Verdict,
    /// Times since the first sample between which the forecast is trusted.
    pub trusted: [f64; 2],
    /// Laws in the same coordinates that the evidence hardly tells from this one, the likeliest first, this
    /// one among them.
    pub rivals: Vec<Rival>,
    /// The 90 % band around the forecast; empty where no law describes the motion.
    pub band: PositionBand,
}

/// A law among its rivals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rival {
    /// Names of its terms, joined by ` + `.
    pub terms: String,
    /// Its share of the weights of all.
    pub weight: f64,
}

/// Radius around the forecast positions of an object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionBand {
    /// Times since the first sample, ascending.
    pub times: Vec<f64>,
    /// Root mean square over the particles, world units; none where rivals cannot be followed.
    pub radius: Vec<Option<f64>>,
}

impl DistillReport {
    /// Whether the dynamics stay with the object's paths inside of the window: as well as a source model
    /// follows a motion, or closer than images resolve.
    #[must_use]
    pub fn describes_window(&self, config: &DistillConfig) -> bool {
        let resolved = UNRESOLVED_ERRORS * f64::from(config.forecast_tolerance);
        self.window_error <= resolved.max(RESIDUAL_TOLERANCE * self.displacement)
    }

    /// The part of the report that precedes any fit.
    pub(crate) fn of_motion(motion: &ObjectMotion) -> Self {
        Self {
            particles: motion.paths.len(),
            paths: motion.path_kind(),
            independent_noise: motion.noise,
            shared_residual: motion.shared.as_ref().map_or(0.0, |motion| motion.shared.residual),
            displacement: motion.displacement,
            degree: motion.degree,
            terms: None,
            law: None,
            generalised: None,
            rigid_constraint: false,
            forecast_error: None,
            window_error: 0.0,
            networks: false,
            force_ratio: 0.0,
        }
    }
}
