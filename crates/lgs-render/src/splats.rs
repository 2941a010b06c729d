//! Inputs of the rasterizer and results of its backward pass: parallel arrays, borrowed and
//! owned.

use lgs_core::{GaussianCloud, sh_coefficients};

/// Gaussians to draw, as borrowed parallel arrays of raw parameters.
#[derive(Clone, Copy, Debug)]
pub struct Splats<'a> {
    /// Centres, world units.
    pub means: &'a [[f32; 3]],
    /// Quaternions `[w, x, y, z]`, normalised inside.
    pub rotations: &'a [[f32; 4]],
    /// Natural logarithms of the standard deviations along the principal axes.
    pub log_scales: &'a [[f32; 3]],
    /// Logits of the opacities.
    pub raw_opacities: &'a [f32],
    /// Spherical-harmonic coefficients `[n, sh_coefficients, 3]`.
    pub sh: &'a [f32],
    /// Coefficients stored per Gaussian and channel.
    pub sh_coefficients: usize,
    /// Degree evaluated, 0 to 3; needs `(active_degree + 1)² ≤ sh_coefficients`.
    pub active_degree: usize,
}

impl Splats<'_> {
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

    /// The coefficients of one Gaussian, `[K, 3]` flattened.
    pub(crate) fn sh_row(&self, index: usize) -> &[f32] {
        let stride = 3 * self.sh_coefficients;
        &self.sh[index * stride..(index + 1) * stride]
    }

    /// Unequal lengths are a bug of the caller.
    pub(crate) fn assert_consistent(&self) {
        let n = self.len();
        assert_eq!(self.rotations.len(), n, "rotations and means");
        assert_eq!(self.log_scales.len(), n, "log_scales and means");
        assert_eq!(self.raw_opacities.len(), n, "raw_opacities and means");
        assert_eq!(self.sh.len(), 3 * n * self.sh_coefficients, "sh and means");
        assert!(self.active_degree <= 3, "degree {} is above 3", self.active_degree);
        assert!(
            sh_coefficients(self.active_degree) <= self.sh_coefficients,
            "degree {} asks for more than the {} coefficients stored",
            self.active_degree,
            self.sh_coefficients
        );
    }
}

impl<'a> From<&'a GaussianCloud> for Splats<'a> {
    fn from(cloud: &'a GaussianCloud) -> Self {
        Self {
            means: &cloud.means,
            rotations: &cloud.rotations,
            log_scales: &cloud.log_scales,
            raw_opacities: &cloud.raw_opacities,
            sh: &cloud.sh,
            sh_coefficients: sh_coefficients(cloud.sh_degree),
            active_degree: cloud.sh_degree,
        }
    }
}

/// Cotangents of every input of the rasterizer; zero for what was not drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SplatGradients {
    /// Gradient by the centres, per world unit.
    pub means: Vec<[f32; 3]>,
    /// Gradient by the raw quaternions.
    pub rotations: Vec<[f32; 4]>,
    /// Gradient by the log scales.
    pub log_scales: Vec<[f32; 3]>,
    /// Gradient by the opacity logits.
    pub raw_opacities: Vec<f32>,
    /// Gradient by the spherical-harmonic coefficients, `[n, K, 3]`.
    pub sh: Vec<f32>,
    /// Gradient by the projected centres, per pixel: the statistic that drives densification.
    pub means2d: Vec<[f32; 2]>,
    /// Gradient by a small motion of the scene in camera axes ([`lgs_core::Camera::seeing_moved`]): by its
    /// rotation vector about the camera's centre, then by its translation.
    pub pose: [f32; 6],
}

impl SplatGradients {
    /// Sets the lengths; values are left as they are.
    pub(crate) fn resize(&mut self, splats: &Splats) {
        let n = splats.len();
        self.means.resize(n, [0.0; 3]);
        self.rotations.resize(n, [0.0; 4]);
        self.log_scales.resize(n, [0.0; 3]);
        self.raw_opacities.resize(n, 0.0);
        self.sh.resize(splats.sh.len(), 0.0);
        self.means2d.resize(n, [0.0; 2]);
    }
}
