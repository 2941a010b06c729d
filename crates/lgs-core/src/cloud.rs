//! A set of 3D Gaussians as parallel arrays of raw parameters.

use crate::harmonics::SH_C0;

/// Number of spherical-harmonic coefficients per colour channel at a degree.
#[must_use]
pub const fn sh_coefficients(degree: usize) -> usize {
    (degree + 1) * (degree + 1)
}

/// A defect of a cloud's arrays.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum CloudError {
    /// An array has another length than the means ask for.
    Length {
        /// The array.
        field: &'static str,
        /// Length asked for.
        expected: usize,
        /// Length found.
        found: usize,
    },
    /// A value is NaN or infinite.
    NonFinite {
        /// The array.
        field: &'static str,
        /// The Gaussian.
        index: usize,
    },
    /// The spherical-harmonic degree is above 3.
    Degree(usize),
}

impl std::fmt::Display for CloudError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Length { field, expected, found } => {
                write!(f, "`{field}` has {found} values where {expected} are expected")
            }
            Self::NonFinite { field, index } => write!(f, "`{field}` of Gaussian {index} is not finite"),
            Self::Degree(degree) => write!(f, "spherical-harmonic degree {degree} is above 3"),
        }
    }
}

impl std::error::Error for CloudError {}

/// Gaussians as parallel arrays of equal length (`sh` holds `K` coefficients of three channels per Gaussian).
///
/// All values are raw: the scale of an axis is `exp(log_scale)`, the opacity is `sigmoid(raw_opacity)` and
/// the rotation is the normalised quaternion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GaussianCloud {
    /// Centres, world units.
    pub means: Vec<[f32; 3]>,
    /// Quaternions `[w, x, y, z]`, not necessarily of unit length.
    pub rotations: Vec<[f32; 4]>,
    /// Natural logarithms of the standard deviations along the principal axes.
    pub log_scales: Vec<[f32; 3]>,
    /// Logits of the opacities.
    pub raw_opacities: Vec<f32>,
    /// Spherical-harmonic coefficients `[n, K, 3]`, `K = (sh_degree + 1)²`.
    pub sh: Vec<f32>,
    /// Degree of the coefficients, 0 to 3.
    pub sh_degree: usize,
}

impl GaussianCloud {
    /// Round Gaussians of one size, colour and opacity, degree 0.
    #[must_use]
    pub fn isotropic(means: Vec<[f32; 3]>, scale: f32, rgb: [f32; 3], opacity: f32) -> Self {
        let n = means.len();
        Self {
            means,
            rotations: vec![[1.0, 0.0, 0.0, 0.0]; n],
            log_scales: vec![[scale.ln(); 3]; n],
            raw_opacities: vec![(opacity / (1.0 - opacity)).ln(); n],
            sh: rgb.map(|c| (c - 0.5) / SH_C0).repeat(n),
            sh_degree: 0,
        }
    }

    /// Number of Gaussians.
    #[must_use]
    pub fn len(&self) -> usize {
        self.means.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.means.is_empty()
    }

    /// Floats of `sh` per Gaussian.
    #[must_use]
    pub fn sh_stride(&self) -> usize {
        3 * sh_coefficients(self.sh_degree)
    }

    /// The opacity of a Gaussian, in (0, 1).
    #[must_use]
    pub fn opacity(&self, index: usize) -> f32 {
        1.0 / (1.0 + (-self.raw_opacities[index]).exp())
    }

    /// Checks lengths, degree and finiteness.
    ///
    /// # Errors
    /// The first defect found, with the array's name.
    pub fn validate(&self) -> Result<(), CloudError> {
        if self.sh_degree > 3 {
            return Err(CloudError::Degree(self.sh_degree));
        }
        let n = self.len();
        let lengths = [
            ("rotations", n, self.rotations.len()),
            ("log_scales", n, self.log_scales.len()),
            ("raw_opacities", n, self.raw_opacities.len()),
            ("sh", n * self.sh_stride(), self.sh.len()),
        ];
        for (field, expected, found) in lengths {
            if expected != found {
                return Err(CloudError::Length { field, expected, found });
            }
        }
        let arrays = [
            ("means", self.means.as_flattened(), 3),
            ("rotations", self.rotations.as_flattened(), 4),
            ("log_scales", self.log_scales.as_flattened(), 3),
            ("raw_opacities", self.raw_opacities.as_slice(), 1),
            ("sh", self.sh.as_slice(), self.sh_stride()),
        ];
        for (field, values, width) in arrays {
            if let Some(at) = values.iter().position(|v| !v.is_finite()) {
                return Err(CloudError::NonFinite { field, index: at / width });
            }
        }
        Ok(())
    }

    /// The Gaussians at `indices`, in that order.
    #[must_use]
    pub fn select(&self, indices: &[usize]) -> Self {
        let stride = self.sh_stride();
        Self {
            means: indices.iter().map(|&i| self.means[i]).collect(),
            rotations: indices.iter().map(|&i| self.rotations[i]).collect(),
            log_scales: indices.iter().map(|&i| self.log_scales[i]).collect(),
            raw_opacities: indices.iter().map(|&i| self.raw_opacities[i]).collect(),
            sh: indices.iter().flat_map(|&i| &self.sh[i * stride..(i + 1) * stride]).copied().collect(),
            sh_degree: self.sh_degree,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validation_names_the_array_and_the_gaussian() {
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 4], 0.1, [0.2; 3], 0.5);
        assert_eq!(cloud.validate(), Ok(()));
        cloud.log_scales[2][1] = f32::NAN;
        assert_eq!(cloud.validate(), Err(CloudError::NonFinite { field: "log_scales", index: 2 }));
        cloud.log_scales.pop();
        assert_eq!(cloud.validate(), Err(CloudError::Length { field: "log_scales", expected: 4, found: 3 }));
    }

    #[test]
    fn selection_keeps_rows_together() {
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3], [1.0; 3], [2.0; 3]], 0.1, [0.5; 3], 0.5);
        cloud.sh = (0..9).map(|v| v as f32).collect();
        let picked = cloud.select(&[2, 0]);
        assert_eq!(picked.means, [[2.0; 3], [0.0; 3]]);
        assert_eq!(picked.sh, [6.0, 7.0, 8.0, 0.0, 1.0, 2.0]);
    }
}
