//! The conservative accelerations of the laws in `scene.json`.

use serde_json::Value;

use crate::thresholds::{INDEPENDENT, NEARLY_VERTICAL};

/// The conservative acceleration of a true object.
#[derive(Clone, Debug, PartialEq)]
pub enum TrueForce {
    /// A uniform acceleration, world units per squared unit of time.
    Uniform([f64; 3]),
    /// Towards a centre or an axis, `−ω²` times the distance.
    Harmonic {
        /// The position at which it vanishes.
        center: [f64; 3],
        /// ω², per squared unit of time.
        curvature: f64,
        /// Unit vector along which it does not act, for a rotation.
        axis: Option<[f64; 3]>,
        /// Orthonormal directions in which the object moves: one or two.
        directions: Vec<[f64; 3]>,
    },
}

impl TrueForce {
    /// Reads an object's law from `scene.json`; nothing for a law without a potential of the position alone.
    #[must_use]
    pub fn of_law(law: &Value) -> Option<Self> {
        let vector = |key: &str| -> Option<[f64; 3]> {
            let values: Vec<f64> = law[key].as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
            values.try_into().ok()
        };
        match law["law"].as_str()? {
            "uniform gravity" => Some(Self::Uniform([0.0, 0.0, -law["g"].as_f64()?])),
            "uniform rotation" => {
                let axis = *orthonormal(&[vector("axis")?]).first()?;
                let helper = if axis[2].abs() < NEARLY_VERTICAL { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
                let directions =
                    orthonormal(&[axis, helper, cross(axis, helper)]).into_iter().skip(1).collect();
                Some(Self::Harmonic {
                    center: vector("center")?,
                    curvature: law["omega"].as_f64()?.powi(2),
                    axis: Some(axis),
                    directions,
                })
            }
            "isotropic harmonic" => {
                let directions = orthonormal(&[vector("displacement")?, vector("velocity")?]);
                Some(Self::Harmonic {
                    center: vector("center")?,
                    curvature: law["k"].as_f64()?,
                    axis: None,
                    directions,
                })
            }
            _ => None,
        }
    }

    /// Whether it is the force that keeps particles on circles about an axis.
    #[must_use]
    pub fn is_of_rotation(&self) -> bool {
        matches!(self, Self::Harmonic { axis: Some(_), .. })
    }

    /// The acceleration at a position.
    #[must_use]
    pub fn at(&self, q: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Uniform(g) => *g,
            Self::Harmonic { center, curvature, axis, .. } => {
                let from_center: [f64; 3] = std::array::from_fn(|c| q[c] - center[c]);
                let axis = axis.unwrap_or_default();
                let along = dot(axis, from_center);
                std::array::from_fn(|c| -curvature * (from_center[c] - along * axis[c]))
            }
        }
    }
}

/// Gram–Schmidt; directions that the earlier ones span are left out.
fn orthonormal(vectors: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut basis: Vec<[f64; 3]> = Vec::new();
    for v in vectors {
        let rest = basis.iter().fold(*v, |r, e| {
            let along = dot(r, *e);
            std::array::from_fn(|c| r[c] - along * e[c])
        });
        if norm(rest) > INDEPENDENT * norm(*v) && norm(rest) > 0.0 {
            basis.push(rest.map(|c| c / norm(rest)));
        }
    }
    basis
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn laws_with_a_potential_give_their_force() {
        let fall = TrueForce::of_law(&json!({"law": "uniform gravity", "g": 0.9})).expect("gravity");
        assert_eq!(fall.at([3.0, 2.0, 1.0]), [0.0, 0.0, -0.9]);
        let throw =
            json!({"law": "uniform gravity", "g": 1.0, "spin": [0.0, 0.0, 2.0], "velocity": [0.5, 0.0, 3.0]});
        let fall = TrueForce::of_law(&throw);
        assert_eq!(fall, Some(TrueForce::Uniform([0.0, 0.0, -1.0])), "a spin is no force");
        let up = [0.0, 0.0, 1.0];
        let fan = json!({"law": "uniform rotation", "center": up, "axis": up, "omega": 2.0});
        let force = TrueForce::of_law(&fan).expect("rotation").at([0.5, -0.25, 7.0]);
        assert!(norm(std::array::from_fn(|c| force[c] - [-2.0, 1.0, 0.0][c])) < 1e-12, "{force:?}");
        let (zero, right) = ([0.0; 3], [2.0, 0.0, 0.0]);
        let slide = json!({
            "law": "isotropic harmonic", "center": zero, "displacement": right, "velocity": zero, "k": 9.0
        });
        let Some(TrueForce::Harmonic { directions, .. }) = TrueForce::of_law(&slide) else {
            panic!("harmonic")
        };
        assert_eq!(directions, [[1.0, 0.0, 0.0]], "a push along no direction adds none");
        assert_eq!(TrueForce::of_law(&json!({"law": "linear drag", "drag": 1.0})), None);
        assert_eq!(TrueForce::of_law(&Value::Null), None);
    }
}
