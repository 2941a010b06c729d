//! The conservative accelerations of the laws in `scene.json`.

use glam::DVec3;
use serde_json::Value;

use crate::thresholds::INDEPENDENT;

/// The conservative acceleration of a true object.
#[derive(Clone, Debug, PartialEq)]
pub enum TrueForce {
    /// A uniform acceleration, world units per squared unit of time.
    Uniform(DVec3),
    /// Towards a centre or an axis, `−ω²` times the distance.
    Harmonic {
        /// The position at which it vanishes.
        center: DVec3,
        /// ω², per squared unit of time.
        curvature: f64,
        /// Unit vector along which it does not act, for a rotation.
        axis: Option<DVec3>,
        /// Orthonormal directions in which the object moves: one or two.
        directions: Vec<DVec3>,
    },
}

impl TrueForce {
    /// Reads an object's law from `scene.json`; nothing for a law without a potential of the position alone.
    #[must_use]
    pub fn of_law(law: &Value) -> Option<Self> {
        let vector = |key: &str| -> Option<DVec3> {
            let values: Vec<f64> = law[key].as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
            <[f64; 3]>::try_from(values).ok().map(DVec3::from)
        };
        match law["law"].as_str()? {
            "uniform gravity" => Some(Self::Uniform(law["g"].as_f64()? * DVec3::NEG_Z)),
            "uniform rotation" => {
                let axis = vector("axis")?.try_normalize()?;
                let (first, second) = axis.any_orthonormal_pair();
                Some(Self::Harmonic {
                    center: vector("center")?,
                    curvature: law["omega"].as_f64()?.powi(2),
                    axis: Some(axis),
                    directions: vec![first, second],
                })
            }
            "isotropic harmonic" => {
                let directions = orthonormal([vector("displacement")?, vector("velocity")?]);
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
    pub fn at(&self, q: DVec3) -> DVec3 {
        match self {
            Self::Uniform(g) => *g,
            Self::Harmonic { center, curvature, axis, .. } => {
                let (offset, axis) = (q - *center, axis.unwrap_or_default());
                -*curvature * (offset - axis.dot(offset) * axis)
            }
        }
    }
}

/// Gram–Schmidt; directions that the earlier ones span are left out.
fn orthonormal(vectors: [DVec3; 2]) -> Vec<DVec3> {
    let mut basis: Vec<DVec3> = Vec::new();
    for v in vectors {
        let rest = basis.iter().fold(v, |rest, direction| rest.reject_from_normalized(*direction));
        if rest.length() > INDEPENDENT * v.length() {
            basis.extend(rest.try_normalize());
        }
    }
    basis
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn laws_with_a_potential_give_their_force() {
        let fall = TrueForce::of_law(&json!({"law": "uniform gravity", "g": 0.9})).expect("gravity");
        assert_eq!(fall.at(DVec3::new(3.0, 2.0, 1.0)), 0.9 * DVec3::NEG_Z);
        let throw =
            json!({"law": "uniform gravity", "g": 1.0, "spin": [0.0, 0.0, 2.0], "velocity": [0.5, 0.0, 3.0]});
        let fall = TrueForce::of_law(&throw);
        assert_eq!(fall, Some(TrueForce::Uniform(DVec3::NEG_Z)), "a spin is no force");
        let up = [0.0, 0.0, 1.0];
        let fan = json!({"law": "uniform rotation", "center": up, "axis": up, "omega": 2.0});
        let force = TrueForce::of_law(&fan).expect("rotation").at(DVec3::new(0.5, -0.25, 7.0));
        assert!(force.distance(DVec3::new(-2.0, 1.0, 0.0)) < 1e-12, "{force:?}");
        let (zero, right) = ([0.0; 3], [2.0, 0.0, 0.0]);
        let slide = json!({
            "law": "isotropic harmonic", "center": zero, "displacement": right, "velocity": zero, "k": 9.0
        });
        let Some(TrueForce::Harmonic { directions, .. }) = TrueForce::of_law(&slide) else {
            panic!("harmonic")
        };
        assert_eq!(directions, [DVec3::X], "a push along no direction adds none");
        assert_eq!(TrueForce::of_law(&json!({"law": "linear drag", "drag": 1.0})), None);
        assert_eq!(TrueForce::of_law(&Value::Null), None);
    }
}
