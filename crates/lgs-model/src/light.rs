//! Light that stands still while bodies turn in it.
//!
//! Distant light of any kind lights a matt surface by its normal alone, and to within some per cent by a
//! polynomial of second degree of that (Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance
//! Environment Maps", 2001). A factor of each dynamic Gaussian's colour, beside those of [`crate::Shading`]:
//! these know the captured window alone, light goes on after it and under edits.

use glam::{DMat3, DVec3};
use lgs_core::GaussianCloud;
use lgs_core::geometry::{quaternion, wide};
use lgs_dynamics::State;

use crate::shading::multiply_colors;
use crate::tensor_file::{TensorFile, TensorFileError};
use crate::thresholds::LEAST_IRRADIANCE;

/// Name of the coefficients in a file.
const IRRADIANCE: &str = "light.irradiance";
/// Name of the normals in a file.
const NORMALS: &str = "light.normals";

/// Irradiance of a surface over its mean for all normals, as a polynomial of the normal and a sun beside it:
/// `1 + b·n + nᵀ A n + max(0, s·n) − |s|/4` with a traceless A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Irradiance {
    /// b.
    pub linear: DVec3,
    /// A, symmetric.
    pub quadratic: DMat3,
    /// s: towards the sun, as long as it is strong.
    pub sun: DVec3,
}

impl Irradiance {
    /// The same light for every normal.
    pub const EVEN: Self = Self { linear: DVec3::ZERO, quadratic: DMat3::ZERO, sun: DVec3::ZERO };
    /// The least that there is for any normal: no polynomial says where light ends.
    pub const LEAST: f64 = LEAST_IRRADIANCE;

    /// That of a surface with a normal of unit length.
    #[must_use]
    pub fn of(&self, normal: DVec3) -> f64 {
        let smooth = 1.0 + self.linear.dot(normal) + normal.dot(self.quadratic * normal);
        let of_sun = self.sun.dot(normal).max(0.0) - 0.25 * self.sun.length();
        (smooth + of_sun).max(Self::LEAST)
    }
}

/// The light of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// How it lights surfaces, world axes.
    pub irradiance: Irradiance,
    /// Normals of the dynamic Gaussians as they are at t = 0, world axes, of unit length.
    pub normals: Vec<[f32; 3]>,
}

impl Light {
    /// Factors of the dynamic Gaussians' colours in a state.
    pub fn gains(&self, state: &State) -> impl Iterator<Item = f32> {
        let gain = |(normal, rotation): (&[f32; 3], &[f32; 4])| {
            let turn = quaternion(&rotation.map(f64::from)).normalize();
            self.irradiance.of(turn * wide(*normal)) as f32
        };
        self.normals.iter().zip(&state.rotation).map(gain)
    }

    /// Gives Gaussians, the last of which are the dynamic ones, the colours that they have in a state.
    pub(crate) fn shade(&self, cloud: &mut GaussianCloud, state: &State) {
        let first = cloud.len() - self.normals.len();
        multiply_colors(cloud, first, self.gains(state));
    }

    /// Adds the light to a file.
    pub(crate) fn insert_into(&self, file: &mut TensorFile) {
        let Irradiance { linear: b, quadratic: a, sun: s } = self.irradiance;
        let own = [b.x, b.y, b.z, a.x_axis.x, a.y_axis.y, a.y_axis.x, a.z_axis.x, a.z_axis.y, s.x, s.y, s.z];
        file.insert(IRRADIANCE, &[11], &own.map(|value| value as f32));
        file.insert(NORMALS, &[self.normals.len(), 3], self.normals.as_flattened());
    }

    /// Reads what [`Self::insert_into`] wrote, for so many Gaussians; nothing where a file has none.
    ///
    /// # Errors
    /// If an array is absent, not finite or of another shape, or a normal not of unit length.
    pub(crate) fn read_from(file: &TensorFile, gaussians: usize) -> Result<Option<Self>, TensorFileError> {
        if !file.names().any(|name| name == IRRADIANCE) {
            return Ok(None);
        }
        let (shape, values) = file.values(IRRADIANCE)?;
        let &[x, y, z, xx, yy, xy, xz, yz, sx, sy, sz] = values else {
            return Err(file.field(IRRADIANCE, "11 coefficients", format!("shape {shape:?}")));
        };
        let [linear, diagonal, beside] = [[x, y, z], [xx, yy, -xx - yy], [xy, xz, yz]].map(wide);
        let [xy, xz, yz] = beside.to_array();
        let quadratic =
            DMat3::from_cols_array_2d(&[[diagonal.x, xy, xz], [xy, diagonal.y, yz], [xz, yz, diagonal.z]]);
        let normals = file.rows::<3>(NORMALS)?;
        if normals.len() != gaussians {
            return Err(file.field(NORMALS, &format!("{gaussians} rows"), normals.len().to_string()));
        }
        if let Some(row) = normals.iter().position(|&normal| (wide(normal).length() - 1.0).abs() > 1e-3) {
            let found = format!("{:?} in row {row}", normals[row]);
            return Err(file.field(NORMALS, "vectors of unit length", found));
        }
        Ok(Some(Self { irradiance: Irradiance { linear, quadratic, sun: wide([sx, sy, sz]) }, normals }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LagrangianScene;
    use crate::lit_testing::{brightness_from_file, defect_of_file, two_gaussians};

    fn irradiance() -> Irradiance {
        let quadratic = DMat3::from_cols_array_2d(&[[0.2, 0.1, 0.0], [0.1, -0.1, 0.3], [0.0, 0.3, -0.1]]);
        Irradiance { linear: DVec3::new(0.1, -0.2, 0.4), quadratic, sun: DVec3::new(0.0, 0.3, 0.4) }
    }

    #[test]
    fn irradiance_is_a_polynomial_of_the_normal_with_a_sun_beside_it() {
        let normal = DVec3::new(0.6, 0.0, 0.8);
        assert!((irradiance().of(normal) - (1.0 + 0.38 + 0.008 + 0.32 - 0.125)).abs() < 1e-12);
        let strong = Irradiance { linear: DVec3::new(0.0, 0.0, 3.0), ..irradiance() };
        assert!((strong.of(-DVec3::Z) - Irradiance::LEAST).abs() < 1e-12);
    }

    #[test]
    fn scenes_carry_a_light_and_defects_are_named() {
        let light = Light { irradiance: irradiance(), normals: vec![[0.0, 0.0, 1.0]] };
        let with = |light: &Light| LagrangianScene { light: Some(light.clone()), ..two_gaussians() };
        let found = brightness_from_file(&with(&light), 0.4);
        for (found, expected) in found.into_iter().zip([0.4, 0.4 * (1.3 + 0.4 - 0.125)]) {
            assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
        }
        let long = defect_of_file(&with(&Light { normals: vec![[0.0, 0.0, 2.0]], ..light.clone() }));
        assert!(long.contains(NORMALS) && long.contains("unit length"), "{long}");
        let few = defect_of_file(&with(&Light { normals: Vec::new(), ..light }));
        assert!(few.contains(NORMALS) && few.contains("1 rows"), "{few}");
    }
}
