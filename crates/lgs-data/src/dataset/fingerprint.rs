//! A hash of an image set: the files that describe its splits, the length of every image they name, and the
//! contents of the training images.
//!
//! It is FNV-1a over 64 bits, which is stable across versions and machines, and independent of the options
//! the set is loaded with. It guards against resuming a run on other data by mistake; it is no protection
//! against malice.

use super::{DatasetError, DatasetFormat};
use crate::files;
use rayon::prelude::*;
use std::path::Path;

const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0100_0000_01b3;

/// The fingerprint of the set in a folder.
pub(super) fn of(root: &Path, format: DatasetFormat) -> Result<String, DatasetError> {
    let mut hash = OFFSET;
    for name in format.all_splits(root)? {
        hash = fnv(hash, name.as_bytes());
        hash = fnv(hash, &files::read_bytes(&format.split_file(root, &name))?);
        // A split that is not being loaded may be broken; its bytes above are all that can be said of it.
        let Ok(specs) = format.frames(root, &name) else { continue };
        let images: Vec<u64> =
            specs.par_iter().map(|spec| image_hash(&spec.image_path, name == "train")).collect();
        hash = images.iter().fold(hash, |h, image| fnv(h, &image.to_le_bytes()));
    }
    Ok(format!("{hash:016x}"))
}

fn image_hash(path: &Path, with_contents: bool) -> u64 {
    if with_contents {
        return std::fs::read(path).map_or(0, |bytes| fnv(OFFSET, &bytes));
    }
    std::fs::metadata(path).map_or(0, |m| m.len())
}

fn fnv(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |h, &b| (h ^ u64::from(b)).wrapping_mul(PRIME))
}
