//! Other people's figures, as a suite file quotes them, and the protocol under which ours stand beside them.

use std::collections::BTreeMap;

use serde::Deserialize;

/// The table `[field]` of a suite file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// Protocol of our own figures, one phrase.
    pub protocol: String,
    /// The split on which ours are measured.
    pub split: String,
    /// Scenes for which it is another one.
    #[serde(default)]
    pub splits: BTreeMap<String, String>,
    /// Published figures.
    #[serde(default)]
    pub quoted: Vec<Quoted>,
}

/// Figures of one publication.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quoted {
    /// Name of the method.
    pub method: String,
    /// Where the figures stand, and the protocol under which they were measured.
    pub protocol: String,
    /// Mean over images of PSNR by scene, dB.
    pub psnr: BTreeMap<String, f64>,
}

impl Field {
    /// The split of a scene.
    #[must_use]
    pub fn split_of(&self, scene: &str) -> &str {
        self.splits.get(scene).unwrap_or(&self.split)
    }

    /// All scenes that the table names.
    pub(crate) fn scenes(&self) -> Vec<String> {
        let quoted = self.quoted.iter().flat_map(|quoted| quoted.psnr.keys());
        self.splits.keys().chain(quoted).cloned().collect()
    }
}
