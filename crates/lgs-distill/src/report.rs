//! The report of stage 1 on an object.

use crate::config::DistillConfig;
use crate::laws::linear::law::Law;
use crate::laws::linear::terms::Terms;
use crate::motion::object_motion::{ObjectMotion, PathKind};
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{RESIDUAL_TOLERANCE, UNDESCRIBED_FRACTION};
use lgs_mechanics::bands::Known;
use serde::{Deserialize, Serialize};

/// Figures of one object's stage 1. Lengths are world units, root mean squares over particles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Laws of parts of the window that explain these, where none explains all of it.
    #[serde(default, skip_serializing_if = "PartLaws::is_empty")]
    pub parts: PartLaws,
    /// Whether the object is under the rigid constraint (see [`crate::DistilledParticles::supports`]).
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
    /// How well it is known.
    pub known: Known,
}

/// Laws that explain the beginning or the end of a window.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartLaws {
    /// Of its beginning, by which the past is forecast.
    pub first: Option<PartLaw>,
    /// Of its end, by which the future is.
    pub last: Option<PartLaw>,
}

impl PartLaws {
    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.first.is_none() && self.last.is_none()
    }
}

/// A law in generalised coordinates of a part of the window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartLaw {
    /// First and last time of the part, normalised.
    pub times: [f64; 2],
    /// Coordinates, terms and the values of all parameters.
    pub law: lgs_mechanics::Law,
    /// Configuration and velocity at the first of them.
    pub start: lgs_mechanics::coordinates::State,
    /// How well it is known; times count from the first of them.
    pub known: Known,
}

impl DistillReport {
    /// Whether the dynamics stay with the object's paths inside of the window: as well as a source model
    /// follows a motion, or closer than images resolve.
    #[must_use]
    pub fn describes_window(&self, config: &DistillConfig) -> bool {
        if self.generalised.as_ref().is_some_and(|law| !law.law.is_smooth()) {
            // Errors grow at every impact; without the plane a body would go through it. Samples beside an
            // impulse are smeared.
            return self.window_error <= UNDESCRIBED_FRACTION * self.displacement;
        }
        self.window_error <= config.unresolved().max(RESIDUAL_TOLERANCE * self.displacement)
    }

    /// The same for poses without trajectories.
    pub(crate) fn of_poses(motion: &SharedMotion) -> Self {
        Self {
            particles: motion.shape.len(),
            paths: motion.kind.into(),
            independent_noise: 0.0,
            shared_residual: motion.residual,
            displacement: motion.rms_displacement(),
            degree: 0,
            ..Self::default()
        }
    }

    /// Objects as one, before any fit of both.
    pub(crate) fn joined(reports: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> f64| {
            let weighted: f64 =
                reports.iter().map(|report| report.particles as f64 * of(report).powi(2)).sum();
            let particles: usize = reports.iter().map(|report| report.particles).sum();
            (weighted / particles.max(1) as f64).sqrt()
        };
        Self {
            particles: reports.iter().map(|report| report.particles).sum(),
            paths: reports.first().map_or(PathKind::default(), |report| report.paths),
            independent_noise: mean(|report| report.independent_noise),
            shared_residual: mean(|report| report.shared_residual),
            displacement: mean(|report| report.displacement),
            degree: reports.iter().map(|report| report.degree).max().unwrap_or(0),
            ..Self::default()
        }
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
            ..Self::default()
        }
    }
}
