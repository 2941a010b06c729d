//! Where imported weights are kept, and how they get there.
//!
//! A file is recognised by the names and shapes in it, not by its own name, and only the tensors that LPIPS
//! needs are kept. The SHA-256 hash of the file says which published weights they are; other weights are kept
//! too (a checkpoint saved anew has another hash), but they stay marked as unknown, since figures compare
//! only between equal weights.

use std::io::Read;
use std::path::{Path, PathBuf};

use lgs_data::files::FileError;
use lgs_data::hash::ContentHash;
use lgs_data::pth::StateDict;
use lgs_model::{TensorFile, TensorFileError};
use serde::{Deserialize, Serialize};

pub use super::error::WeightsError;
pub use super::weight_kind::WeightKind;

/// Format name and version of a stored file.
const FORMAT: &str = "lagrangegs-weights/1";

/// Linear weights of LPIPS 0.0, whose inputs were scaled otherwise; the shapes are the same as in 0.1.
const SUPERSEDED: [&str; 2] = [
    "b9e4236260c3dd988fc79d2a48d645d885afcbb21f9fd595e6744cf7419b582c",
    "18720f55913d0af89042f13faa7e536a6ce1444a0914e6db9461355ece1e8cd5",
];

/// The file that stored weights were imported from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// The part of a network that they are for.
    pub kind: WeightKind,
    /// Name of the imported file.
    pub file: String,
    /// SHA-256 hash of the imported file, hexadecimal.
    pub sha256: String,
    /// Which published file it is; nothing if the hash is of none.
    pub published: Option<String>,
    /// SHA-256 hash of the tensors that were kept, checked when they are loaded.
    tensors_sha256: String,
}

/// Stored tensors and where they came from.
#[derive(Clone, Debug)]
pub struct Weights {
    file: TensorFile,
    /// The file that they were imported from.
    pub origin: Origin,
}

impl Weights {
    /// A tensor of a given shape.
    ///
    /// # Errors
    /// If it is absent or of another shape.
    pub(super) fn values(&self, name: &str, shape: &[usize]) -> Result<&[f32], TensorFileError> {
        let (found, values) = self.file.values(name)?;
        if found == shape {
            Ok(values)
        } else {
            Err(self.file.field(name, &format!("shape {shape:?}"), format!("{found:?}")))
        }
    }

    /// Weights with given tensors.
    #[cfg(test)]
    pub(super) fn of(kind: WeightKind, tensors: &[(String, Vec<usize>, Vec<f32>)]) -> Self {
        let mut file = TensorFile::new(FORMAT);
        tensors.iter().for_each(|(name, shape, values)| file.insert(name, shape, values));
        let origin = Origin {
            kind,
            file: String::new(),
            sha256: String::new(),
            published: None,
            tensors_sha256: String::new(),
        };
        Self { file, origin }
    }
}

/// A folder of imported weights.
#[derive(Clone, Debug)]
pub struct WeightStore {
    folder: PathBuf,
}

impl WeightStore {
    /// The store in a folder, which need not exist yet.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Imports a PyTorch checkpoint.
    ///
    /// # Errors
    /// If it can't be read, has the weights of none of the networks, a tensor is absent, misshapen or not
    /// finite, its contents do not match the hash in its name, it is of LPIPS 0.0, or the folder can't be
    /// written.
    pub fn import(&self, path: &Path) -> Result<Origin, WeightsError> {
        let dict = StateDict::open(path)?;
        let kind = WeightKind::of(&dict).ok_or_else(|| unknown(path, &dict))?;
        let sha256 = file_hash(path)?;
        if let Some(expected) = hash_in_name(path).filter(|start| !sha256.starts_with(start.as_str())) {
            return Err(WeightsError::Hash { path: path.to_owned(), expected, found: sha256 });
        }
        if SUPERSEDED.contains(&sha256.as_str()) {
            return Err(WeightsError::Superseded { path: path.to_owned() });
        }
        let mut file = TensorFile::new(FORMAT);
        let mut tensors_hash = ContentHash::default();
        for (name, shape) in kind.tensors() {
            let values = dict.values(&name, &shape)?;
            add_to_hash(&mut tensors_hash, &name, &values);
            file.insert(name, &shape, &values);
        }
        let published = kind
            .published()
            .iter()
            .find(|(start, _)| sha256.starts_with(start))
            .map(|(_, name)| (*name).to_owned());
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let origin =
            Origin { kind, file: name, sha256, published, tensors_sha256: tensors_hash.hexadecimal() };
        // Names and hashes always serialise.
        file.set_metadata("origin", serde_json::to_string(&origin).unwrap_or_default());
        std::fs::create_dir_all(&self.folder)
            .map_err(|e| FileError::new("create folder", &self.folder, e))?;
        file.save(&self.path(kind))?;
        Ok(origin)
    }

    /// Stored weights; nothing if none were imported.
    ///
    /// # Errors
    /// If the stored file can't be read, is damaged, or its tensors are not those that were imported.
    pub fn load(&self, kind: WeightKind) -> Result<Option<Weights>, WeightsError> {
        let path = self.path(kind);
        if !path.exists() {
            return Ok(None);
        }
        let file = TensorFile::load(&path, FORMAT)?;
        let origin: Origin = file.metadata_json("origin")?;
        let mut hash = ContentHash::default();
        for (name, _) in kind.tensors() {
            add_to_hash(&mut hash, &name, file.values(&name)?.1);
        }
        let found = hash.hexadecimal();
        if found != origin.tensors_sha256 {
            return Err(file.field("tensors_sha256", &origin.tensors_sha256, found).into());
        }
        Ok(Some(Weights { file, origin }))
    }

    fn path(&self, kind: WeightKind) -> PathBuf {
        self.folder.join(format!("lpips-{}.safetensors", kind.name()))
    }
}

fn unknown(path: &Path, dict: &StateDict) -> WeightsError {
    let mut names = dict.names();
    let found = match names.next() {
        None => "no tensors".to_owned(),
        Some(first) => format!("`{first}` and {} other tensors", names.count()),
    };
    WeightsError::Unknown { path: path.to_owned(), found }
}

/// The eight digits that torchvision puts at the end of a file's name.
fn hash_in_name(path: &Path) -> Option<String> {
    let stem = path.file_stem()?.to_str()?;
    let (_, digits) = stem.rsplit_once('-')?;
    let lower = digits.to_ascii_lowercase();
    (lower.len() == 8 && lower.bytes().all(|b| b.is_ascii_hexdigit())).then_some(lower)
}

fn file_hash(path: &Path) -> Result<String, FileError> {
    let failed = |reason| FileError::new("read file", path, reason);
    let mut file = std::fs::File::open(path).map_err(failed)?;
    let mut hash = ContentHash::default();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer).map_err(failed)? {
            0 => return Ok(hash.hexadecimal()),
            n => hash.add(&buffer[..n]),
        }
    }
}

fn add_to_hash(hash: &mut ContentHash, name: &str, values: &[f32]) {
    hash.add(name.as_bytes());
    values.iter().for_each(|v| hash.add(&v.to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use super::super::features::tests::tensors;
    use super::*;
    use lgs_data::testing::{CheckpointEntry, checkpoint};

    fn checkpoint_of(tensors: &[(String, Vec<usize>, Vec<f32>)]) -> Vec<u8> {
        let entries: Vec<_> = tensors
            .iter()
            .map(|(name, shape, v)| (name.as_str(), CheckpointEntry::Tensor(shape, v)))
            .collect();
        checkpoint(&entries)
    }

    #[test]
    fn every_kind_is_recognised_by_content_and_comes_back_as_it_was() {
        let folder = tempfile::tempdir().expect("folder");
        let store = WeightStore::new(folder.path().join("weights"));
        for kind in [WeightKind::AlexLinear, WeightKind::AlexTrunk, WeightKind::VggLinear] {
            assert!(store.load(kind).expect("load").is_none());
            let path = folder.path().join("anything.pth");
            std::fs::write(&path, checkpoint_of(&tensors(kind))).expect("write");
            let origin = store.import(&path).expect("import");
            assert_eq!((origin.kind, origin.published.as_deref(), origin.sha256.len()), (kind, None, 64));
            let weights = store.load(kind).expect("load").expect("there");
            assert_eq!(weights.origin, origin);
            for (name, shape, values) in tensors(kind) {
                assert_eq!(weights.values(&name, &shape).expect("tensor"), values);
            }
        }
    }

    #[test]
    fn defects_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let store = WeightStore::new(folder.path().join("weights"));
        let refused = |name: &str, tensors: &[(String, Vec<usize>, Vec<f32>)]| {
            let path = folder.path().join(name);
            std::fs::write(&path, checkpoint_of(tensors)).expect("write");
            let text = store.import(&path).expect_err("refused").to_string();
            assert!(text.ends_with(name), "{text}");
            text
        };
        let good = tensors(WeightKind::VggLinear);
        assert!(refused("vgg-397923af.pth", &good).contains("starts with 397923af"));
        assert!(
            refused("other.pth", &[("fc.weight".to_owned(), vec![1], vec![0.0])])
                .contains("`fc.weight` and 0 other tensors")
        );
        let squeeze = |(i, (name, ..)): (usize, &(String, Vec<usize>, Vec<f32>))| {
            let n = [64, 128, 256, 384, 384][i];
            (name.clone(), vec![1, n, 1, 1], vec![0.5; n])
        };
        let squeeze: Vec<_> = good.iter().enumerate().map(squeeze).collect();
        assert!(refused("squeeze.pth", &squeeze).contains("`lin3.model.1.weight`"));
        assert!(refused("cut.pth", &good[..4]).contains("`lin4.model.1.weight`"));
        assert!(!folder.path().join("weights").exists(), "nothing is stored of what was refused");
    }

    #[test]
    fn stored_tensors_that_changed_are_refused() {
        let folder = tempfile::tempdir().expect("folder");
        let store = WeightStore::new(folder.path());
        let path = folder.path().join("alex.pth");
        std::fs::write(&path, checkpoint_of(&tensors(WeightKind::AlexLinear))).expect("write");
        store.import(&path).expect("import");
        let stored = store.path(WeightKind::AlexLinear);
        let mut bytes = std::fs::read(&stored).expect("bytes");
        let last = bytes.len() - 4;
        bytes[last] ^= 1;
        std::fs::write(&stored, bytes).expect("write");
        let text = store.load(WeightKind::AlexLinear).expect_err("changed").to_string();
        assert!(text.contains("tensors_sha256"), "{text}");
    }
}
