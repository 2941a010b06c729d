//! Sizes of the corrections of training cameras.

use serde::{Deserialize, Serialize};

/// How far a run has corrected its training cameras.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CameraCorrections {
    /// Number of cameras.
    pub cameras: usize,
    /// Root mean square displacement of their images by corrections of poses, pixels.
    pub pose_rms_pixels: f64,
    /// Largest such displacement of a camera, pixels.
    pub pose_max_pixels: f64,
    /// Root mean square change of a middle grey by exposures, as a fraction of it.
    pub exposure_rms: f64,
    /// Largest such change.
    pub exposure_max: f64,
}

impl CameraCorrections {
    /// The sizes of corrections of poses.
    #[must_use]
    pub fn pose_text(&self) -> String {
        let Self { pose_rms_pixels: rms, pose_max_pixels: most, cameras, .. } = self;
        format!("{rms:.2} px rms, {most:.2} px at most, {cameras} cameras")
    }

    /// The sizes of corrections of exposures, of a middle grey.
    #[must_use]
    pub fn exposure_text(&self) -> String {
        let percent = [self.exposure_rms, self.exposure_max].map(|v| 100.0 * v);
        format!("{:.1} % rms, {:.1} % at most", percent[0], percent[1])
    }
}
