//! Moments of inertia of a body, up to their scale.

use crate::parameter::Parameter;
use crate::thresholds::MOST_LOG_FACTOR;
use serde::{Deserialize, Serialize};

/// Which moments of inertia are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InertiaForm {
    /// All moments equal, as for a ball: a free spin is uniform.
    Isotropic,
    /// Those of the prior.
    Prior,
    /// Their ratios are fitted, with the prior as the centre.
    Free,
}

/// Principal axes and moments of a body; the middle moment keeps its value, since a torque's scale and that
/// of the moments cannot be told apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertia {
    /// Which moments are fitted.
    pub form: InertiaForm,
    /// Quaternion (w, x, y, z) that takes principal axes to the axes of the shape.
    pub frame: [f64; 4],
    /// Moments about the principal axes per mass, length², sorted either way: the second is the middle one.
    pub moments: [f64; 3],
}

impl Inertia {
    /// Equal moments in the axes of the shape.
    #[must_use]
    pub fn ball(moment: f64) -> Self {
        Self { form: InertiaForm::Isotropic, frame: [1.0, 0.0, 0.0, 0.0], moments: [moment; 3] }
    }

    /// Parameters: logarithms of the outer moments over those of the prior.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let names: &[&str] = match self.form {
            InertiaForm::Free => &["log-moment-1", "log-moment-3"],
            InertiaForm::Isotropic | InertiaForm::Prior => &[],
        };
        let bounded =
            |name: &&str| Parameter::nonlinear(*name, 0, 0).within(-MOST_LOG_FACTOR, MOST_LOG_FACTOR);
        names.iter().map(bounded).collect()
    }

    /// Values of [`Self::parameters`] at the prior.
    #[must_use]
    pub fn start(&self) -> Vec<f64> {
        vec![0.0; self.parameters().len()]
    }

    /// The moments with parameters `p` (the law's first ones).
    #[must_use]
    pub fn moments(&self, p: &[f64]) -> [f64; 3] {
        let [first, middle, last] = self.moments;
        match self.form {
            InertiaForm::Isotropic => [middle; 3],
            InertiaForm::Prior => self.moments,
            InertiaForm::Free => [first * p[0].exp(), middle, last * p[1].exp()],
        }
    }
}
