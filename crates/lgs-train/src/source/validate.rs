//! Checks of the settings of source training.

use super::config::SourceConfig;
use super::config_groups::DensifyMethod;

/// A key below `source` and what is wrong with its value.
type Refusal = (String, String);

impl SourceConfig {
    /// Checks the values; a refusal is (key below `source`, reason).
    ///
    /// # Errors
    /// The first value out of range.
    pub fn validate(&self) -> Result<(), (String, String)> {
        self.kind.validate(&self.import, &self.motion())?;
        self.validate_rates()?;
        self.validate_counts()?;
        let of_cameras = |(key, reason)| (format!("cameras.{key}"), reason);
        self.cameras.validate().map_err(of_cameras)?;
        let weights = [
            ("initial_half_extent", self.initial_half_extent),
            ("views_per_coefficient", self.views_per_coefficient),
            ("densify.per_pixel", self.densify.per_pixel),
            ("near", self.near),
            ("densify.gradient_threshold", self.densify.gradient_threshold),
            ("rigidity.weight", self.rigidity.weight),
            ("guide.weight", self.guide.weight),
            ("guide.below_images_per_time", self.guide.below_images_per_time),
            ("stretch", self.stretch),
            ("static_regulariser", self.static_regulariser),
            ("densify.prune_outside", self.densify.prune_outside),
            ("densify.mcmc.growth", self.densify.mcmc.growth),
            ("densify.mcmc.noise", self.densify.mcmc.noise),
            ("densify.opacity_weight", self.densify.opacity_weight),
            ("densify.scale_weight", self.densify.scale_weight),
        ];
        weights.into_iter().try_for_each(|(key, value)| not_negative(key, f64::from(value)))?;
        let is_bounded = self.densify.max_gaussians > 0 || self.densify.per_pixel > 0.0;
        let has_budget = self.densify.method != DensifyMethod::Mcmc || is_bounded;
        require(has_budget, "densify.max_gaussians", format_args!("0 is no budget for the method `mcmc`"))?;
        positive("rigidity.robust_scale", f64::from(self.rigidity.robust_scale))?;
        fraction("front_share", self.front_share)?;
        fraction("coarse_share", self.coarse_share)?;
        fraction("random_background", self.random_background)?;
        fraction("ssim_weight", self.ssim_weight)
    }

    fn validate_rates(&self) -> Result<(), Refusal> {
        let rates = &self.learning_rates;
        not_negative("learning_rates.position_unit", rates.position_unit)?;
        positive("learning_rates.position_start", rates.position_start)?;
        positive("learning_rates.position_end", rates.position_end)?;
        positive("learning_rates.deformation_start", rates.deformation_start)?;
        positive("learning_rates.deformation_end", rates.deformation_end)?;
        not_negative("learning_rates.sh", rates.sh)?;
        not_negative("learning_rates.sh_rest", rates.sh_rest)?;
        not_negative("learning_rates.opacity", rates.opacity)?;
        not_negative("learning_rates.scale", rates.scale)?;
        not_negative("learning_rates.rotation", rates.rotation)?;
        not_negative("learning_rates.while_growing", rates.while_growing)?;
        let shading = &self.shading;
        positive("shading.rate_start", shading.rate_start)?;
        positive("shading.rate_end", shading.rate_end)?;
        not_negative("shading.weight", f64::from(shading.weight))?;
        not_negative("shading.change_weight", f64::from(shading.change_weight))
    }

    fn validate_counts(&self) -> Result<(), Refusal> {
        let counts = [
            ("iterations", self.iterations, 1, usize::MAX),
            ("initial_gaussians", self.initial_gaussians, 1, 2_000_000),
            ("sh_degree", self.sh_degree, 0, 3),
            ("coarse_levels", self.coarse_levels, 0, 8),
            ("densify.interval", self.densify.interval, 1, usize::MAX),
            ("rigidity.neighbors", self.rigidity.neighbors, 1, 64),
            ("shading.times", self.shading.times, 0, 256),
        ];
        counts.into_iter().try_for_each(|(key, value, least, most)| {
            let limit = if value < least { format!("below {least}") } else { format!("above {most}") };
            require((least..=most).contains(&value), key, format_args!("{value} is {limit}"))
        })
    }
}

fn positive(key: &str, value: f64) -> Result<(), Refusal> {
    require(value > 0.0 && value.is_finite(), key, format_args!("{value} is not a positive number"))
}

fn not_negative(key: &str, value: f64) -> Result<(), Refusal> {
    require(value >= 0.0 && value.is_finite(), key, format_args!("{value} is negative or not finite"))
}

fn fraction(key: &str, value: f32) -> Result<(), Refusal> {
    require((0.0..=1.0).contains(&value), key, format_args!("{value} is not in [0, 1]"))
}

fn require(holds: bool, key: &str, reason: std::fmt::Arguments<'_>) -> Result<(), Refusal> {
    if holds { Ok(()) } else { Err((key.to_owned(), reason.to_string())) }
}
