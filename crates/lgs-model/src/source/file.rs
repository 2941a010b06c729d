//! Reading source models: those of this program, whose kind the file names, and those of others.

use std::path::Path;

use lgs_data::frames::read_frames;

use super::carried::CarriedSource;
use super::error::SourceError;
use super::imported::ImportedFrames;
use super::kind::SourceKind;
use super::model::SourceModel;
use super::official::{is_official_defgs, read_official_defgs};
use super::shaded::ShadedSource;
use crate::shading::Shading;
use crate::tensor_file::TensorFile;

/// The kind of source model that [`import_source`] makes of a file or folder.
#[must_use]
pub fn imported_kind(path: &Path) -> SourceKind {
    if is_official_defgs(path) { SourceKind::Defgs } else { SourceKind::Frames }
}

/// Reads a source model that another program wrote: frames ([`lgs_data::frames`]), or an output folder of the
/// authors' DefGS program.
///
/// # Errors
/// If something is absent, malformed, not finite or does not fit together.
pub fn import_source(path: &Path) -> Result<Box<dyn SourceModel>, SourceError> {
    match imported_kind(path) {
        SourceKind::Defgs => Ok(Box::new(read_official_defgs(path)?.model)),
        _ => Ok(Box::new(ImportedFrames::new(read_frames(path)?))),
    }
}

/// Reads a source model of any kind.
///
/// # Errors
/// If the file cannot be read, is damaged, of no known kind or version, or its arrays do not fit together.
pub fn load_source(path: &Path) -> Result<Box<dyn SourceModel>, SourceError> {
    let file = TensorFile::load_one_of(path, &SourceKind::ALL.map(SourceKind::format))?;
    let kind = SourceKind::ALL.into_iter().find(|kind| kind.format() == file.format()).unwrap_or_default();
    let model = CarriedSource::read_over(kind.read(&file, path)?, &file)?;
    Ok(match Shading::read_from(&file, model.len())? {
        Some(shading) => Box::new(ShadedSource::new(model, shading)),
        None => model,
    })
}
