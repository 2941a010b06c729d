//! A FreeGave model as named tensors.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::config::FreeGaveConfig;
use super::model::FreeGave;
use super::network::FreeGaveNetworks;
use crate::scene::{insert_cloud, read_cloud};
use crate::source::error::SourceError;
use crate::source::model::SourceModel;
use crate::source::network::InputFrame;
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

/// The whole model.
pub(super) fn to_tensors(model: &FreeGave) -> TensorFile {
    let FreeGaveNetworks { config, frame, params } = &model.networks;
    let mut file = TensorFile::new(model.kind().format());
    insert_cloud(&mut file, "canonical", &model.canonical);
    let header = Header { config: config.clone(), frame: *frame, time_window: model.time_window };
    // A plain structure of numbers and names always serialises.
    file.set_metadata(NETWORKS, serde_json::to_string(&header).unwrap_or_default());
    file.insert_params(NETWORKS, &config.layout().params(), params);
    file
}

impl FreeGave {
    /// Reads what [`SourceModel::save`] wrote to `path`.
    ///
    /// # Errors
    /// If sizes or arrays are absent, do not fit or are not finite.
    pub fn from_tensors(file: &TensorFile, path: &Path) -> Result<Self, SourceError> {
        let canonical = read_cloud(file, "canonical")?;
        canonical.validate().map_err(|source| SourceError::Cloud { path: path.to_owned(), source })?;
        let Header { config, frame, time_window } = file.metadata_json(NETWORKS)?;
        config.validate().map_err(|(field, reason)| {
            file.field(&format!("{NETWORKS}.{field}"), "a value in range", reason)
        })?;
        let sound = (0.0..1e3).contains(&time_window);
        if let Some(found) = frame.defect().or_else(|| (!sound).then(|| format!("a window of {time_window}")))
        {
            let expected = "a positive scale, a finite centre and a time window";
            return Err(file.field(NETWORKS, expected, found).into());
        }
        let params = file.params(NETWORKS, &config.layout().params())?;
        Ok(Self::new(canonical, FreeGaveNetworks { config, frame, params }, time_window))
    }
}
