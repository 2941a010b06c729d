//! The cameras that a run has refined, and their file.

use std::path::Path;

use glam::Mat4;
use lgs_core::Exposure;
use lgs_data::dataset::{Dataset, Frame};
use lgs_model::{TensorFile, TensorFileError};

/// Format of the file.
const FORMAT: &str = "lagrangegs-cameras/1";

/// The corrections of the cameras that a run was trained on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RefinedCameras {
    /// One for every pose that the dataset gives to training images.
    pub cameras: Vec<RefinedCamera>,
}

/// The correction of one camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefinedCamera {
    /// `camera_from_world` as the dataset gives it.
    pub given: Mat4,
    /// Motion of the scene in camera axes ([`lgs_core::Camera::seeing_moved`]): rotation vector, translation.
    pub motion: [f32; 6],
    /// What the camera makes of the scene's colours.
    pub exposure: Exposure,
    /// Root mean square over the image of the displacement by the motion, pixels.
    pub pixels: f32,
}

/// How large the corrections of a run's cameras are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CorrectionSizes {
    /// Number of cameras.
    pub cameras: usize,
    /// Root mean square over cameras of the displacement of the image by corrections of poses, pixels.
    pub pose_rms: f64,
    /// Largest of these displacements, pixels.
    pub pose_max: f64,
    /// Root mean square change of a middle grey by exposures, as a fraction of it.
    pub exposure_rms: f64,
    /// Largest such change of a channel.
    pub exposure_max: f64,
}

impl RefinedCameras {
    /// A dataset with the corrections on all frames of the cameras that were refined, in whatever split.
    /// Other cameras stay as they are given.
    #[must_use]
    pub fn applied_to(&self, dataset: &Dataset) -> Dataset {
        let mut corrected = dataset.clone();
        corrected.splits.values_mut().flatten().for_each(|frame| self.correct(frame));
        corrected
    }

    /// Corrects a frame, if its camera was refined.
    pub(crate) fn correct(&self, frame: &mut Frame) {
        let given = frame.camera.camera_from_world;
        if let Some(found) = self.cameras.iter().find(|camera| camera.given == given) {
            if found.motion != [0.0; 6] {
                frame.camera = frame.camera.seeing_moved(found.motion);
            }
            frame.exposure = found.exposure;
        }
    }

    /// How large the corrections are.
    #[must_use]
    pub fn sizes(&self) -> CorrectionSizes {
        let count = self.cameras.len().max(1) as f64;
        let largest = |of: fn(&RefinedCamera) -> f64| self.cameras.iter().map(of).fold(0.0, f64::max);
        let root = |of: fn(&RefinedCamera) -> f64| {
            (self.cameras.iter().map(|camera| of(camera).powi(2)).sum::<f64>() / count).sqrt()
        };
        CorrectionSizes {
            cameras: self.cameras.len(),
            pose_rms: root(|camera| f64::from(camera.pixels)),
            pose_max: largest(|camera| f64::from(camera.pixels)),
            exposure_rms: root(|camera| camera.exposure.change_of_grey().1),
            exposure_max: largest(|camera| camera.exposure.change_of_grey().0),
        }
    }

    /// Writes the corrections.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), TensorFileError> {
        let n = self.cameras.len();
        let mut file = TensorFile::new(FORMAT);
        let mut insert = |name: &str, width: usize, row: fn(&RefinedCamera) -> Vec<f32>| {
            let values: Vec<f32> = self.cameras.iter().flat_map(row).collect();
            file.insert(name, &[n, width], &values);
        };
        insert("given", 16, |camera| camera.given.transpose().to_cols_array().to_vec());
        insert("motions", 6, |camera| camera.motion.to_vec());
        insert("gains", 3, |camera| camera.exposure.gain.to_vec());
        insert("offsets", 3, |camera| camera.exposure.offset.to_vec());
        insert("pixels", 1, |camera| vec![camera.pixels]);
        file.save(path)
    }

    /// Reads what [`Self::save`] wrote.
    ///
    /// # Errors
    /// If the file cannot be read, or a tensor is absent, not finite or of another shape.
    pub fn load(path: &Path) -> Result<Self, TensorFileError> {
        let file = TensorFile::load(path, FORMAT)?;
        let (given, motions) = (file.rows::<16>("given")?, file.rows::<6>("motions")?);
        let (gains, offsets) = (file.rows::<3>("gains")?, file.rows::<3>("offsets")?);
        let pixels = file.rows::<1>("pixels")?;
        let n = given.len();
        for (name, found) in [
            ("motions", motions.len()),
            ("gains", gains.len()),
            ("offsets", offsets.len()),
            ("pixels", pixels.len()),
        ] {
            if found != n {
                return Err(file.field(name, &format!("{n} rows"), found.to_string()));
            }
        }
        let camera = |i: usize| RefinedCamera {
            given: Mat4::from_cols_array(&given[i]).transpose(),
            motion: motions[i],
            exposure: Exposure { gain: gains[i], offset: offsets[i] },
            pixels: pixels[i][0],
        };
        Ok(Self { cameras: (0..n).map(camera).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::Camera;

    fn frame(camera: Camera) -> Frame {
        let (name, exposure) = (String::new(), Exposure::IDENTITY);
        Frame { name, camera_id: 0, camera, time: 0.0, exposure, pixels: vec![0; 4].into() }
    }

    #[test]
    fn files_keep_corrections_and_only_their_cameras_are_corrected() {
        let [own, other] =
            [[0.0, -3.0, 1.0], [3.0, 0.0, 1.0]].map(|eye| Camera::look_at(eye, [0.0; 3], 0.8, 1, 1));
        let refined = RefinedCameras {
            cameras: vec![RefinedCamera {
                given: own.camera_from_world,
                motion: [0.01, 0.0, 0.02, 0.0, -0.01, 0.0],
                exposure: Exposure { gain: [1.1, 1.0, 0.9], offset: [0.0, 0.01, 0.0] },
                pixels: 0.7,
            }],
        };
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("cameras");
        refined.save(&path).expect("save");
        assert_eq!(RefinedCameras::load(&path).expect("load"), refined);
        let mut dataset = Dataset::none([1.0; 3]);
        dataset.splits.insert("train".to_owned(), vec![frame(own), frame(other)]);
        let corrected = refined.applied_to(&dataset);
        let [first, second] = corrected.split("train") else { panic!("two frames") };
        assert_eq!(first.camera, own.seeing_moved(refined.cameras[0].motion));
        assert_eq!(first.exposure, refined.cameras[0].exposure);
        assert_eq!((second.camera, second.exposure), (other, Exposure::IDENTITY));
        let sizes = refined.sizes();
        assert!((sizes.pose_max - 0.7).abs() < 1e-6 && (sizes.exposure_max - 0.1).abs() < 1e-6);
    }
}
