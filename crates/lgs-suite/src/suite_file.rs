//! The tables and keys of a suite file.

use std::collections::BTreeMap;

use lgs_data::synth::SynthOptions;
use lgs_train::Preset;
use serde::Deserialize;

use crate::field::Field;
use crate::published::Published;
use crate::scenes::Folders;
use crate::variants::VariantTable;

/// Settings of some cells.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Override {
    pub(crate) scenes: Vec<String>,
    pub(crate) methods: Vec<String>,
    pub(crate) variants: Vec<String>,
    pub(crate) settings: Vec<String>,
}

/// The file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    pub(crate) name: String,
    pub(crate) title: String,
    pub(crate) scenes: Vec<String>,
    pub(crate) methods: Vec<String>,
    #[serde(default)]
    pub(crate) variants: Vec<String>,
    pub(crate) seeds: Vec<u64>,
    #[serde(default)]
    pub(crate) preset: Preset,
    #[serde(default)]
    pub(crate) settings: Vec<String>,
    pub(crate) synthetic: Option<Synthetic>,
    pub(crate) folders: Option<Folders>,
    pub(crate) published: Option<Published>,
    pub(crate) field: Option<Field>,
    #[serde(default)]
    pub(crate) half_resolution: bool,
    #[serde(default)]
    pub(crate) variant: BTreeMap<String, OwnVariant>,
    #[serde(default, rename = "override")]
    pub(crate) overrides: Vec<Override>,
}

/// The options of synthetic scenes.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Synthetic {
    pub(crate) size: u32,
    pub(crate) views: usize,
    pub(crate) seed: u64,
    pub(crate) train_fps: u32,
    pub(crate) laws_by_seed: bool,
}

impl Default for Synthetic {
    fn default() -> Self {
        let SynthOptions { size, views, seed, train_fps, .. } = SynthOptions::default();
        Self { size, views, seed, train_fps, laws_by_seed: false }
    }
}

impl From<Synthetic> for SynthOptions {
    fn from(made: Synthetic) -> Self {
        let Synthetic { size, views, seed, train_fps, .. } = made;
        Self { size, views, seed, train_fps, ..Self::default() }
    }
}

/// A variant that the file defines.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OwnVariant {
    pub(crate) title: String,
    #[serde(default)]
    pub(crate) table: VariantTable,
    pub(crate) settings: Vec<String>,
    #[serde(default)]
    pub(crate) remark: String,
}
