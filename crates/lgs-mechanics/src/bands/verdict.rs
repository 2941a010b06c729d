//! How far a scene may claim to know an object's motion.

use serde::{Deserialize, Serialize};

/// What is known of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The law describes the window, and its forecast stays within its own band.
    Explained,
    /// The law describes the window; rival laws disagree soon beyond it, or a forecast inside it failed.
    Described,
    /// No law describes the window.
    #[default]
    Outside,
}
