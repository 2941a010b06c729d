//! A FreeGave model as named tensors.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::config::FreeGaveConfig;
use super::model::FreeGave;
use super::network::FreeGaveNetworks;
use crate::scene::{insert_cloud, read_cloud};
use crate::source::SourceModel;
use crate::source::file::SourceError;
use crate::source::network::InputFrame;
use crate::tensor_file::TensorFile;

/// Prefix of the networks' parameters, and key of their sizes.
const NETWORKS: &str = "networks";

#[derive(Serialize, Deserialize)]
struct Header {
    config: FreeGaveConfig,
    center: [f32; 3],
    scale: f32,
    time_window: f32,
}

/// The whole model.
pub(super) fn to_tensors(model: &FreeGave) -> TensorFile {
    let FreeGaveNetworks { config, frame, params } = &model.networks;
    let mut file = TensorFile::new(model.kind().format());
    insert_cloud(&mut file, "canonical", &model.canonical);
    let header = Header {
        config: config.clone(),
        center: frame.center,
        scale: frame.scale,
        time_window: model.time_window,
    };
    // A plain structure of numbers and names always serialises.
    file.set_metadata(NETWORKS, serde_json::to_string(&header).unwrap_or_default());
    for param in config.layout().params() {
        file.insert(format!("{NETWORKS}.{}", param.name), &param.shape, &params[param.range]);
    }
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
        let Header { config, center, scale, time_window } = file.metadata_json(NETWORKS)?;
        config.validate().map_err(|(field, reason)| {
            file.field(&format!("{NETWORKS}.{field}"), "a value in range", reason)
        })?;
        let numbers = [scale, time_window].into_iter().chain(center);
        if !(scale > 0.0 && (0.0..1e3).contains(&time_window) && numbers.into_iter().all(f32::is_finite)) {
            let found = format!("{scale}, {center:?} and {time_window}");
            return Err(file
                .field(NETWORKS, "a positive scale, a finite centre and a time window", found)
                .into());
        }
        let layout = config.layout();
        let mut params = vec![0.0; layout.len];
        for param in layout.params() {
            let name = format!("{NETWORKS}.{}", param.name);
            let (shape, values) = file.values(&name)?;
            if shape != param.shape {
                return Err(file
                    .field(&name, &format!("shape {:?}", param.shape), format!("{shape:?}"))
                    .into());
            }
            params[param.range].copy_from_slice(values);
        }
        Ok(Self::new(
            canonical,
            FreeGaveNetworks { config, frame: InputFrame { center, scale }, params },
            time_window,
        ))
    }
}
