//! Source models: what learns a scene's motion from images, and what a Lagrangian scene is then distilled
//! from.
//!
//! A [`SourceModel`] answers where every Gaussian is at a time of the captured window; nothing else of it is
//! used downstream, so a learned deformation ([`DefGs`]), another method or trajectories from a file are
//! interchangeable. A new kind is a file with an implementation of the trait, that of [`SourceMotion`] if it
//! can be trained, a variant of [`SourceKind`], and its line in the list of kinds below. The deformation
//! network ([`network`]) runs as one fused operation on slices; [`tensor`] makes it differentiable inside
//! Burn, and [`mod@reference`] is its twin in plain tensor operations.

mod blocks;
mod carried;
mod config;
#[cfg(feature = "gpu")]
mod cube;
mod defgs;
mod error;
mod file;
pub mod freegave;
mod imported;
mod input;
mod kind;
mod linear;
mod model;
mod motion;
pub mod network;
pub mod nodes;
mod official;
pub mod pose;
mod pose_network;
pub mod reference;
mod registry;
mod shaded;
pub mod tensor;
#[cfg(test)]
mod testing;
mod time_part;

pub use carried::{CarriedMotion, CarryingPath, place_at};
pub use config::{
    AdvectionConfig, DELTAS, DeformationConfig, HeadInit, MotionHead, NetworkLayout, NodesConfig,
    RotationForm, ScaleMode, VelocityConfig,
};
pub use defgs::{DEFORMED_SCALE_FLOOR, DefGs, compose};
pub use error::SourceError;
pub use file::{import_source, imported_kind, load_source};
pub use freegave::{FreeGave, FreeGaveConfig};
pub use imported::ImportedFrames;
pub use input::InputFrame;
pub use kind::SourceKind;
pub use linear::LinearMotion;
pub use model::SourceModel;
pub use motion::{Canonical, Captured, Learned, Moment, MotionConfig, Remade, SourceMotion};
pub use network::Deformation;
pub use nodes::ControlNodes;
pub use official::{OfficialDefGs, OfficialSettings, is_official_defgs, read_official_defgs};
pub use pose_network::{NetworkInput, Networks, PoseGradients, PoseNetwork};
pub use shaded::ShadedSource;

use registry::Kind;

impl SourceKind {
    /// Every kind.
    pub const ALL: [Self; 5] = [Self::Defgs, Self::Freegave, Self::Nodes, Self::Linear, Self::Frames];

    fn kind(self) -> &'static Kind {
        match self {
            Self::Defgs => &defgs::KIND,
            Self::Freegave => &freegave::KIND,
            Self::Nodes => &nodes::KIND,
            Self::Linear => &linear::KIND,
            Self::Frames => &imported::KIND,
        }
    }
}
