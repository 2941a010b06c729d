//! The scenes of a suite.

use lgs_data::synth::SynthOptions;
use serde::Deserialize;

/// The origin of a suite's scenes.
#[derive(Clone, Debug, PartialEq)]
pub enum Scenes {
    /// Made from the catalogue of synthetic scenes.
    Synthetic(SynthOptions),
    /// Datasets in the D-NeRF layout, one folder each.
    Folders(Folders),
}

/// Datasets on disk.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Folders {
    /// Folder with one folder per scene, if none is given at the command line; relative to where the
    /// program is called.
    pub path: String,
    /// Description of the folder's contents, for the message that it is absent.
    pub about: String,
}
