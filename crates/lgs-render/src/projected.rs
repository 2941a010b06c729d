//! Gaussians on the image plane, and the constants of how they are drawn (method §2.1, §2.2).

/// Low-pass filter added to the diagonal of the image covariance, square pixels.
pub const BLUR: f32 = 0.3;
/// Variance of the Mip filter, square pixels: that of a Gaussian about as wide as a pixel (Yu et al. 2024).
pub const MIP_VARIANCE: f32 = 0.1;
/// Least square of the factor by which the Mip filter lowers opacities, as published; below it the factor is
/// constant, so that Gaussians without area keep finite gradients.
pub(crate) const LEAST_ENERGY: f32 = 2.5e-5;
/// A Gaussian contributes to a pixel if its alpha there is at least this.
pub const ALPHA_MIN: f32 = 1.0 / 255.0;
/// Alpha never exceeds this.
pub const ALPHA_MAX: f32 = 0.99;
/// Blending stops before the Gaussian that would bring transmittance below this.
pub const TRANSMITTANCE_STOP: f32 = 1e-4;
/// `log2(255)`.
pub(crate) const LOG2_255: f32 = 7.994_353_4;

/// A Gaussian on the image plane: one cache line, all that tiling and blending need.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct Projected {
    /// Centre in pixels.
    pub mean: [f32; 2],
    /// `[f₀, f₁, f₂]` of the exponent in base 2 (module header).
    pub factor: [f32; 3],
    /// `log2(opacity)`.
    pub log2_opacity: f32,
    /// RGB.
    pub color: [f32; 3],
    /// Distance along the viewing axis.
    pub depth: f32,
    /// `log2(255 · opacity)`: the `u² + w²` at which alpha falls to 1/255. Positive, and 0 marks an invisible
    /// Gaussian.
    pub reach: f32,
    /// Half width and half height of the ellipse on which alpha is 1/255, pixels.
    pub half: [f32; 2],
    /// The ellipse's rightmost point is this far below the centre, pixels.
    pub rightmost: f32,
}
