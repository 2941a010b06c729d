//! Formats of splat files as flags, and the names of their frames.

use std::path::Path;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use lgs_data::splats::SplatFormat;

use super::progress::say;

/// Parses the name of a format.
pub(super) fn splat_format() -> impl TypedValueParser<Value = SplatFormat> {
    PossibleValuesParser::new(SplatFormat::ALL.map(SplatFormat::name))
        .map(|name| SplatFormat::named(&name).unwrap_or(SplatFormat::Ply))
}

/// The format that a path asks for by its end; `ply` if it says nothing.
pub(super) fn format_of(path: &Path) -> SplatFormat {
    SplatFormat::of_name(path).unwrap_or(SplatFormat::Ply)
}

/// File name of a frame, counted from 0, as SuperSplat and Brush load them as a sequence.
pub(super) fn frame_name(frame: usize, format: SplatFormat) -> String {
    format!("frame{:04}.{}", frame + 1, format.extension())
}

/// Says what a format has no place for in Gaussians of a degree.
pub(super) fn warn_of_loss(sh_degree: usize, format: SplatFormat) {
    if format == SplatFormat::Splat && sh_degree > 0 {
        say("warning: `.splat` has no place for harmonics above degree 0; they are left out");
    }
}
