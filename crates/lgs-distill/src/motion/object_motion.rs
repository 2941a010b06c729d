//! An object's denoised motion, as every later step reads it.

use super::paths::Paths;
use super::pose::PoseKind;
use super::smooth_motion::SmoothMotion;
use lgs_dynamics::Normalisation;
use serde::{Deserialize, Serialize};

/// The origin of the smooth paths that an object's law is fitted to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathKind {
    /// One rotation and shift for all particles.
    Rigid,
    /// One linear map and shift for all particles.
    Affine,
    /// Every particle by itself.
    #[default]
    Independent,
}

/// An object's denoised motion.
pub(crate) struct ObjectMotion {
    /// The motion that the particles share, if they do.
    pub(crate) shared: Option<SmoothMotion>,
    /// Smooth paths of all particles.
    pub(crate) paths: Paths,
    /// Degree of the paths' polynomials in time.
    pub(crate) degree: usize,
    /// Validation particles: those on which errors and scales are measured.
    pub(crate) validation: Vec<usize>,
    /// Typical length, speed and acceleration.
    pub(crate) scales: Normalisation,
    /// Standard deviation per coordinate of the trajectories' noise that is independent between samples.
    pub(crate) noise: f64,
    /// Root mean square displacement from the first sample.
    pub(crate) displacement: f64,
}

impl ObjectMotion {
    /// The origin of the paths.
    pub(crate) fn path_kind(&self) -> PathKind {
        match self.shared.as_ref().map(|motion| motion.shared.kind) {
            Some(kind) => kind.into(),
            None => PathKind::Independent,
        }
    }
}

impl From<PoseKind> for PathKind {
    fn from(kind: PoseKind) -> Self {
        match kind {
            PoseKind::Rigid => Self::Rigid,
            PoseKind::Affine => Self::Affine,
        }
    }
}
