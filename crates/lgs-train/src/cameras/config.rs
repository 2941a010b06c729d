//! Settings of the refinement of cameras.

use lgs_data::dataset::CameraOrigin;
use serde::{Deserialize, Serialize};

/// Whether something is refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Refine {
    /// Where the origin of the cameras says that there is something to refine.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// Refinement of the training cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CamerasConfig {
    /// Refine exposure and white balance: a gain and an offset per channel and camera (paper: off). `auto`:
    /// unless the images were rendered, which a set in the D-NeRF layout is taken to be.
    pub refine_exposure: Refine,
    /// Refine poses: a rotation and a translation per camera (paper: off). `auto`: no, since exact cameras
    /// lose a little by it and nothing tells yet how far those of a set are off.
    pub refine_poses: Refine,
    /// Rate of gains and offsets at the start, per step.
    pub exposure_start: f64,
    /// Rate of gains and offsets at the end.
    pub exposure_end: f64,
    /// Weight of the squared changes of gains and offsets in the loss, which keeps what images do not
    /// determine as it was.
    pub exposure_weight: f32,
    /// Part of the iterations before poses are refined: the coarse shape has to stand.
    pub pose_after: f32,
    /// Rate of poses at the start, pixels per step.
    pub pose_start: f64,
    /// Rate of poses at the end, pixels per step.
    pub pose_end: f64,
    /// Weight of the squared corrections of poses, square pixels, in the loss.
    pub pose_weight: f32,
}

impl Default for CamerasConfig {
    fn default() -> Self {
        Self {
            refine_exposure: Refine::Auto,
            refine_poses: Refine::Auto,
            exposure_start: 3e-3,
            exposure_end: 1e-4,
            exposure_weight: 0.01,
            pose_after: 0.1,
            pose_start: 0.02,
            pose_end: 2e-3,
            pose_weight: 1e-4,
        }
    }
}

impl CamerasConfig {
    /// Cameras are taken as they are.
    #[must_use]
    pub fn off() -> Self {
        Self { refine_exposure: Refine::Off, refine_poses: Refine::Off, ..Self::default() }
    }

    /// The settings for cameras of an origin, without `auto`.
    #[must_use]
    pub(crate) fn resolved(&self, origin: CameraOrigin) -> Self {
        let chosen = |asked: Refine, is_needed: bool| match asked {
            Refine::Auto if is_needed => Refine::On,
            Refine::Auto => Refine::Off,
            asked => asked,
        };
        Self {
            refine_exposure: chosen(self.refine_exposure, origin != CameraOrigin::Exact),
            refine_poses: chosen(self.refine_poses, false),
            ..self.clone()
        }
    }

    /// Checks the values; a refusal is (key below `source.cameras`, reason).
    ///
    /// # Errors
    /// The first value out of range.
    pub(crate) fn validate(&self) -> Result<(), (&'static str, String)> {
        let refuse = |key, value: f64, what| Err((key, format!("{value} is {what}")));
        for (key, rate) in [
            ("exposure_start", self.exposure_start),
            ("exposure_end", self.exposure_end),
            ("pose_start", self.pose_start),
            ("pose_end", self.pose_end),
        ] {
            if !(rate > 0.0 && rate.is_finite()) {
                return refuse(key, rate, "not a positive number");
            }
        }
        for (key, weight) in [("exposure_weight", self.exposure_weight), ("pose_weight", self.pose_weight)] {
            if !(weight >= 0.0 && weight.is_finite()) {
                return refuse(key, f64::from(weight), "negative or not finite");
            }
        }
        if (0.0..=1.0).contains(&self.pose_after) {
            return Ok(());
        }
        refuse("pose_after", f64::from(self.pose_after), "not in [0, 1]")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_origin_of_cameras_decides_what_is_refined() {
        let of = |origin| {
            let found = CamerasConfig::default().resolved(origin);
            (found.refine_exposure == Refine::On, found.refine_poses == Refine::On)
        };
        assert_eq!(of(CameraOrigin::Exact), (false, false));
        assert_eq!(of(CameraOrigin::Calibrated), (true, false));
        assert_eq!(of(CameraOrigin::Estimated), (true, false));
        let asked = CamerasConfig { refine_poses: Refine::On, ..CamerasConfig::off() };
        assert_eq!(asked.resolved(CameraOrigin::Exact), asked);
    }
}
