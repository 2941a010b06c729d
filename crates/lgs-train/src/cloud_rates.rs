//! Learning rates of trainable Gaussians.

/// Learning rates of a cloud's attributes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CloudRates {
    pub(crate) means: f64,
    pub(crate) rotations: f64,
    pub(crate) log_scales: f64,
    pub(crate) raw_opacities: f64,
    pub(crate) sh_constant: f64,
    pub(crate) sh_rest: f64,
    pub(crate) features: f64,
    pub(crate) shading: f64,
}

impl CloudRates {
    /// All rates multiplied by a factor.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self {
            means: factor * self.means,
            rotations: factor * self.rotations,
            log_scales: factor * self.log_scales,
            raw_opacities: factor * self.raw_opacities,
            sh_constant: factor * self.sh_constant,
            sh_rest: factor * self.sh_rest,
            features: factor * self.features,
            shading: factor * self.shading,
        }
    }
}
