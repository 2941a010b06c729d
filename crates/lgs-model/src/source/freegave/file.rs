//! A FreeGave model as named tensors.

use std::path::Path;

use lgs_core::GaussianCloud;
use lgs_nn::NamedLayers;
use serde::{Deserialize, Serialize};

use super::config::FreeGaveConfig;
use super::network::FreeGaveNetworks;
use crate::scene::{insert_cloud, read_cloud};
use crate::source::error::SourceError;
use crate::source::input::InputFrame;
use crate::source::kind::SourceKind;
use crate::tensor_file::TensorFile;

/// Prefix of the networks' parameters, and key of their sizes.
const NETWORKS: &str = "networks";

#[derive(Serialize, Deserialize)]
struct Header {
    config: FreeGaveConfig,
    #[serde(flatten)]
    frame: InputFrame,
    time_window: f32,
}

/// Parts of a model: canonical Gaussians, networks, end of the captured window.
pub(super) type Parts = (GaussianCloud, FreeGaveNetworks, f32);

/// The whole model.
pub(super) fn to_tensors(
    canonical: &GaussianCloud,
    FreeGaveNetworks { config, frame, params }: &FreeGaveNetworks,
    time_window: f32,
) -> TensorFile {
    let mut file = TensorFile::new(SourceKind::Freegave.format());
    insert_cloud(&mut file, "canonical", canonical);
    let header = Header { config: config.clone(), frame: *frame, time_window };
    // A plain structure of numbers and names always serialises.
    file.set_metadata(NETWORKS, serde_json::to_string(&header).unwrap_or_default());
    file.insert_params(NETWORKS, &config.layout().params(), params);
    file
}

/// The parts of a model that [`to_tensors`] wrote; errors name `path`.
///
/// # Errors
/// If sizes or arrays are absent, do not fit or are not finite.
pub(super) fn from_tensors(file: &TensorFile, path: &Path) -> Result<Parts, SourceError> {
    let canonical = read_cloud(file, "canonical")?;
    canonical.validate().map_err(|source| SourceError::Cloud { path: path.to_owned(), source })?;
    let Header { config, frame, time_window } = file.metadata_json(NETWORKS)?;
    config
        .validate()
        .map_err(|(field, reason)| file.field(&format!("{NETWORKS}.{field}"), "a value in range", reason))?;
    let sound = (0.0..1e3).contains(&time_window);
    if let Some(found) = frame.defect().or_else(|| (!sound).then(|| format!("a window of {time_window}"))) {
        let expected = "a positive scale, a finite centre and a time window";
        return Err(file.field(NETWORKS, expected, found).into());
    }
    let params = file.params(NETWORKS, &config.layout().params())?;
    Ok((canonical, FreeGaveNetworks { config, frame, params }, time_window))
}
