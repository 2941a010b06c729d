//! Settings of source training for a dataset: what they leave to the data is filled in.

use super::config::SourceConfig;
use super::config_groups::WarmupFrames;
use crate::data_summary::DataSummary;
use crate::thresholds::{
    COARSEST_WIDTH, FEWEST_BUDGETED, FIRST_SHARE, FIRST_VIEWPOINTS, MAX_STRETCH, MOST_BUDGETED,
    REFERENCE_DISTANCE, REFERENCE_WIDTH,
};

/// The factor of all counts of iterations: the one given or, if that is 0, one that follows from the images'
/// width.
#[must_use]
pub(crate) fn stretch_factor(given: f32, width: u32) -> f64 {
    f64::from(if given > 0.0 { given } else { (width as f32 / REFERENCE_WIDTH).clamp(1.0, MAX_STRETCH) })
}

/// The unit of rates of positions, world units: the one given or, if that is 0, one that follows from the
/// distance of the cameras from what they look at.
#[must_use]
pub(crate) fn position_unit(given: f64, viewing_distance: f32) -> f64 {
    if given > 0.0 || viewing_distance <= 0.0 {
        given.max(f64::MIN_POSITIVE)
    } else {
        f64::from(viewing_distance / REFERENCE_DISTANCE)
    }
}

impl SourceConfig {
    /// The settings for a dataset, with every count of iterations multiplied out. What was resolved stays as
    /// it is if it is resolved again.
    #[must_use]
    pub fn resolved(&self, data: &DataSummary) -> Self {
        let mut config = self.stretched(data.size[0]);
        let rates = &mut config.learning_rates;
        let unit = position_unit(rates.position_unit, data.viewing_distance);
        (rates.position_start, rates.position_end) = (unit * rates.position_start, unit * rates.position_end);
        rates.position_unit = 1.0;
        let densify = &mut config.densify;
        if densify.max_gaussians == 0 && densify.per_pixel > 0.0 {
            let count = f64::from(densify.per_pixel) * data.pixels();
            densify.max_gaussians = (count as usize).clamp(FEWEST_BUDGETED, MOST_BUDGETED);
        }
        if densify.max_gaussians > 0 {
            // Room to grow where images ask for it: first points are hardly ever in the right places.
            let most = (FIRST_SHARE * densify.max_gaussians as f64) as usize;
            config.initial_gaussians = config.initial_gaussians.min(most.max(1));
        }
        while config.sh_degree > 0 && !has_views_for(config.sh_degree, config.views_per_coefficient, data) {
            config.sh_degree -= 1;
        }
        while data.size[0] >> config.coarse_levels < COARSEST_WIDTH && config.coarse_levels > 0 {
            config.coarse_levels -= 1;
        }
        config.cameras = config.cameras.resolved(data.cameras);
        if config.warmup_frames == WarmupFrames::ByCameras {
            config = config.with_frames_by_cameras(data);
        }
        if data.times == 1 { config.without_motion() } else { config }
    }

    fn with_frames_by_cameras(self, data: &DataSummary) -> Self {
        if data.has_jumping_camera() {
            let warmup_cameras = self.warmup_cameras.max(FIRST_VIEWPOINTS);
            let warmup_frames = WarmupFrames::AllThenFirst;
            Self { warmup_frames, warmup_cameras, window_steps: 1, ..self }
        } else {
            Self { warmup_frames: WarmupFrames::First, ..self }
        }
    }

    /// The settings with every count of iterations multiplied out for images of a width.
    fn stretched(&self, width: u32) -> Self {
        let factor = stretch_factor(self.stretch, width);
        let mut stretched = Self { stretch: 1.0, ..self.clone() };
        let (rates, densify) = (&mut stretched.learning_rates, &mut stretched.densify);
        let of_nodes = stretched.nodes.as_mut().map(|nodes| &mut nodes.chosen_before);
        let counts = [
            &mut stretched.iterations,
            &mut stretched.warmup_iterations,
            &mut stretched.window_interval,
            &mut stretched.sh_interval,
            &mut stretched.static_regulariser_after,
            &mut stretched.shading.after,
            &mut stretched.shading.trial,
            &mut rates.position_steps,
            &mut rates.deformation_ramp,
            &mut rates.deformation_steps,
            &mut densify.after,
            &mut densify.before,
            &mut densify.prune_large_after,
        ];
        for count in counts.into_iter().chain(of_nodes) {
            *count = (*count as f64 * factor).round() as usize;
        }
        stretched
    }
}

/// Whether colours of a degree have enough views per coefficient.
fn has_views_for(degree: usize, per_coefficient: f32, data: &DataSummary) -> bool {
    data.views as f32 >= per_coefficient * lgs_core::sh_coefficients(degree) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    const SET: DataSummary = DataSummary::JUMPING;

    #[test]
    fn nothing_assumes_a_size_of_images_or_of_the_world() {
        let config = SourceConfig::standard();
        let of = |data: DataSummary| config.resolved(&data);
        assert_eq!(of(SET).resolved(&SET), of(SET), "once");
        let far = of(DataSummary { viewing_distance: 400.0, ..SET });
        let rate = |c: &SourceConfig| c.position_rate(c.iterations);
        assert!((rate(&far) / rate(&of(SET)) - 100.0).abs() < 1e-3);
        let budget = |size| of(DataSummary { size, ..SET }).densify.max_gaussians;
        assert!(budget([160, 160]) < budget([300, 300]) && budget([300, 300]) < budget([800, 800]));
        assert_eq!([[50, 50], [4000, 3000]].map(budget), [FEWEST_BUDGETED, MOST_BUDGETED]);
        let levels = |width| of(DataSummary { size: [width, 300], ..SET }).coarse_levels;
        assert!(levels(120) == 0 && levels(200) == 1 && levels(800) == 2);
        let given = SourceConfig {
            densify: DensifyConfig { max_gaussians: 50_000, ..config.densify.clone() },
            ..config.clone()
        };
        assert_eq!(given.resolved(&SET).densify.max_gaussians, 50_000, "what is given wins");
    }

    #[test]
    fn views_decide_degrees_and_standing_cameras_the_window() {
        let config = SourceConfig::standard();
        let degree = |views| config.resolved(&DataSummary { views, ..SET }).sh_degree;
        assert_eq!([2, 12, 30, 100].map(degree), [0, 1, 2, 3]);
        let jumping = config.resolved(&SET);
        assert_eq!((jumping.warmup_cameras, jumping.window_steps), (FIRST_VIEWPOINTS, 1));
        let sees_all = |iteration| jumping.sees_all_times(iteration);
        let end = jumping.warmup_iterations;
        assert!(sees_all(0) && !sees_all(end - 1) && jumping.is_warmup(end - 1));
        let standing = config.resolved(&DataSummary { views: 12, images: 600, ..SET });
        assert!(standing.warmup_frames == WarmupFrames::First && standing.window_steps > 1);
        assert!(config.resolved(&DataSummary { times: 1, ..SET }).is_warmup(jumping.iterations));
        let quick = SourceConfig::quick();
        let position_unit = position_unit(0.0, SET.viewing_distance);
        let learning_rates = LearningRates { position_unit, ..quick.learning_rates.clone() };
        assert_eq!(
            quick.resolved(&DataSummary { size: [160, 160], ..SET }),
            SourceConfig { stretch: 1.0, cameras: CamerasConfig::off(), learning_rates, ..quick }
        );
    }

    use super::super::config_groups::{DensifyConfig, LearningRates};
    use crate::cameras::CamerasConfig;
}
