//! A hash of an image set: the files that describe its splits, the length of every image they name, and the
//! contents of the training images.
//!
//! It is independent of the options the set is loaded with. It guards against resuming a run on other data by
//! mistake.

use super::error::DatasetError;
use super::formats::DatasetFormat;
use crate::files;
use crate::hash::ContentHash;
use rayon::prelude::*;
use std::path::Path;

/// The fingerprint of the set in a folder: 16 hexadecimal digits.
pub(super) fn of(root: &Path, format: DatasetFormat) -> Result<String, DatasetError> {
    let mut hash = ContentHash::default();
    for name in format.all_splits(root)? {
        hash.add(name.as_bytes());
        for source in format.sources(root, &name) {
            hash.add(&files::read_bytes(&source)?);
        }
        // A split that is not being loaded may be broken; its bytes above are all that can be said of it.
        let Ok(specs) = format.frames(root, &name) else { continue };
        let identify = if name == "train" { contents } else { length };
        let images: Vec<String> = specs.par_iter().map(|spec| identify(&spec.image_path)).collect();
        images.iter().for_each(|image| hash.add(image.as_bytes()));
    }
    Ok(hash.short())
}

/// The hash of a file; empty if it cannot be read.
fn contents(path: &Path) -> String {
    std::fs::read(path).map_or_else(|_| String::new(), |bytes| ContentHash::of(&bytes).hexadecimal())
}

/// The length of a file; empty if there is none.
fn length(path: &Path) -> String {
    std::fs::metadata(path).map_or_else(|_| String::new(), |file| format!("{} bytes ", file.len()))
}
