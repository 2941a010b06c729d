//! The properties of the kinds of source models. All that the program knows of a kind is its [`Kind`], which
//! the kind's own file declares; the parent module lists them.

use std::path::Path;

use super::error::SourceError;
use super::kind::SourceKind;
use super::model::SourceModel;
use super::motion::{Captured, MotionConfig, SourceMotion};
use crate::tensor_file::TensorFile;

/// A model that was read.
type ReadModel = Result<Box<dyn SourceModel>, SourceError>;

/// The properties of a kind of source model.
pub(super) struct Kind {
    /// Name in configurations, messages and file names.
    pub(super) name: &'static str,
    /// Format name and version of its file.
    pub(super) format: &'static str,
    /// Reads a model from its file, whose path errors name.
    pub(super) read: fn(&TensorFile, &Path) -> ReadModel,
    /// Whether a model can be imported from another program's files.
    pub(super) imports: Imports,
    /// Training from images.
    pub(super) training: Option<Training>,
}

/// Whether models of a kind come from another program's files.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Imports {
    Possible,
    Impossible,
}

/// Training of a kind of source model.
pub(super) struct Training {
    /// Checks the settings; a refusal is (key below `source`, reason).
    pub(super) validate: fn(&MotionConfig<'_>) -> Result<(), (String, String)>,
    /// The motion of validated settings.
    pub(super) motion: fn(&MotionConfig<'_>, Captured) -> Box<dyn SourceMotion>,
}

impl SourceKind {
    /// Its name in configurations, messages and file names.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.kind().name
    }

    /// Format name and version of its file.
    #[must_use]
    pub fn format(self) -> &'static str {
        self.kind().format
    }

    /// Reads a model from a file of the kind's format; errors name `path`.
    ///
    /// # Errors
    /// If an array is absent, not finite or of another shape.
    pub(super) fn read(self, file: &TensorFile, path: &Path) -> ReadModel {
        (self.kind().read)(file, path)
    }

    /// Checks whether a model of the kind can be had: imported from `import`, or trained with settings if
    /// that is empty. A refusal is (key below `source`, reason).
    ///
    /// # Errors
    /// The first setting that is refused.
    pub fn validate(self, import: &str, config: &MotionConfig<'_>) -> Result<(), (String, String)> {
        let Kind { name, imports, training, .. } = self.kind();
        let refuse = |reason: String| Err(("import".to_owned(), reason));
        match training {
            _ if !import.is_empty() && *imports == Imports::Impossible => {
                refuse(format!("a source `{name}` can only be trained"))
            }
            None if import.is_empty() => refuse(format!("the source `{name}` needs a file or folder")),
            Some(training) => (training.validate)(config),
            None => config.deformation_only(),
        }
    }

    /// Whether models of the kind are trained from images.
    #[must_use]
    pub fn is_trained(self) -> bool {
        self.kind().training.is_some()
    }

    /// The motion that training of the kind learns with validated settings; nothing for a kind that is only
    /// imported.
    #[must_use]
    pub fn motion(self, config: &MotionConfig<'_>, captured: Captured) -> Option<Box<dyn SourceMotion>> {
        self.kind().training.as_ref().map(|training| (training.motion)(config, captured))
    }
}
