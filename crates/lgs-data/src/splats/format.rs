//! Which format a file has, or is to have.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::error::{SplatError, SplatProblem};
use crate::files::FileError;
use crate::ply::is_packed;
use crate::thresholds::MAX_HEADER;

/// A format of splat files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplatFormat {
    /// Polygon file with raw values.
    Ply,
    /// Polygon file with packed values.
    CompressedPly,
    /// 32 bytes for each Gaussian.
    Splat,
    /// Compressed columns.
    Spz,
}

impl SplatFormat {
    /// Every format.
    pub const ALL: [Self; 4] = [Self::Ply, Self::CompressedPly, Self::Splat, Self::Spz];

    /// Name in commands.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::CompressedPly => "compressed-ply",
            Self::Splat => "splat",
            Self::Spz => "spz",
        }
    }

    /// End of a file's name, without the point before it.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::CompressedPly => "compressed.ply",
            other => other.name(),
        }
    }

    /// The format of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// The format that the end of a file's name asks for.
    #[must_use]
    pub fn of_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?.to_ascii_lowercase();
        // The longest end first: `.compressed.ply` is no `.ply`.
        let ends = [Self::CompressedPly, Self::Ply, Self::Splat, Self::Spz];
        ends.into_iter().find(|format| name.ends_with(&format!(".{}", format.extension())))
    }

    /// The format of a file that exists.
    ///
    /// # Errors
    /// If it can't be read, or neither its contents nor its name are known.
    pub fn of_file(path: &Path) -> Result<Self, SplatError> {
        let mut head = Vec::new();
        let failed = |e| FileError::new("read file", path, e);
        let file = File::open(path).map_err(failed)?;
        file.take(MAX_HEADER as u64).read_to_end(&mut head).map_err(failed)?;
        if head.starts_with(b"ply") {
            return Ok(if is_packed(&head) { Self::CompressedPly } else { Self::Ply });
        }
        let known = Self::of_name(path).map(|format| match format {
            // What is wrong with its contents its reader says.
            Self::CompressedPly => Self::Ply,
            other => other,
        });
        known.ok_or_else(|| SplatError::new(path, SplatProblem::Format))
    }
}
