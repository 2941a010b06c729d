//! PyTorch checkpoints (`.pth`) read as data.
//!
//! A checkpoint is a pickle, and unpickling one in Python can run any program. Here the pickle is parsed:
//! calls that rebuild tensors are understood, every other one is kept as a name, and nothing is executed. The
//! ZIP container of today's `torch.save`, the stream that came before it and the TAR before that are told
//! apart by content. A tensor is read when it is asked for, after its type and shape have been checked, so
//! that what a file claims never decides how much memory is taken.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pytorch_reader::{DType, PickleValue, PytorchReader, Tensor};

/// Why a checkpoint, or a tensor in it, can't be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PthError {
    /// Not a checkpoint, damaged, or of a form that is not read.
    #[error("can't read the PyTorch checkpoint: {reason}: {}", path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// The parser's finding.
        reason: String,
    },
    /// A tensor is absent or not as it should be.
    #[error("`{field}`: expected {expected}, found {found}: {}", path.display())]
    Tensor {
        /// The file.
        path: PathBuf,
        /// Name of the tensor in the state dictionary.
        field: String,
        /// The expectation.
        expected: String,
        /// The finding.
        found: String,
    },
}

impl PthError {
    /// The file that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Checkpoint { path, .. } | Self::Tensor { path, .. } => path,
        }
    }
}

/// A state dictionary: tensors by their dotted names.
#[derive(Debug)]
pub struct StateDict {
    path: PathBuf,
    tensors: BTreeMap<String, Tensor>,
}

impl StateDict {
    /// Opens a checkpoint; reads names and shapes only.
    ///
    /// # Errors
    /// If the file can't be read, is no checkpoint or is damaged.
    pub fn open(path: &Path) -> Result<Self, PthError> {
        let failed =
            |e: &dyn std::error::Error| PthError::Checkpoint { path: path.to_owned(), reason: e.to_string() };
        let reader = PytorchReader::new(path).map_err(|e| failed(&e))?;
        Ok(Self { path: path.to_owned(), tensors: reader.into_tensors().into_iter().collect() })
    }

    /// Names of all tensors, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.tensors.keys().map(String::as_str)
    }

    /// Shape of a tensor, outermost extent first.
    #[must_use]
    pub fn shape(&self, name: &str) -> Option<&[usize]> {
        self.tensors.get(name).map(Tensor::shape)
    }

    /// The values of a tensor, row-major.
    ///
    /// # Errors
    /// If it is absent, of another shape, not of 32-bit floats, not whole or not finite.
    pub fn values(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, PthError> {
        let error = |found: String| self.error(name, format!("32-bit floats of shape {shape:?}"), found);
        let Some(tensor) = self.tensors.get(name) else {
            return Err(self.absent(name, format!("32-bit floats of shape {shape:?}")));
        };
        if tensor.dtype() != DType::F32 || tensor.shape() != shape {
            return Err(error(format!("{:?} of shape {:?}", tensor.dtype(), tensor.shape())));
        }
        let bytes = tensor.read().map_err(|e| error(e.to_string()))?;
        // The reader returns values in the machine's own byte order.
        let values: Vec<f32> =
            bytes.as_chunks::<4>().0.iter().map(|word| f32::from_ne_bytes(*word)).collect();
        match values.iter().position(|v| !v.is_finite()) {
            None => Ok(values),
            Some(at) => Err(error(format!("{} at index {at}", values[at]))),
        }
    }

    /// The error that there is no tensor of a name, with what there is in its place.
    #[must_use]
    pub fn absent(&self, name: &str, expected: String) -> PthError {
        self.error(name, expected, self.what_else(name))
    }

    /// An error about a field of this file.
    #[must_use]
    pub fn error(&self, field: &str, expected: String, found: String) -> PthError {
        PthError::Tensor { path: self.path.clone(), field: field.to_owned(), expected, found }
    }

    /// A description of what stands in the place of a tensor: nothing, or a value that is not one, such as a
    /// call that was not made.
    fn what_else(&self, name: &str) -> String {
        match PytorchReader::read_pickle_data(&self.path, None) {
            Ok(PickleValue::Dict(entries)) => match entries.get(name) {
                None => "nothing of that name".to_owned(),
                Some(PickleValue::Unsupported(class)) => {
                    format!("an object of the Python type `{class}`, which is not run")
                }
                Some(_) => "a value that is no tensor".to_owned(),
            },
            Ok(PickleValue::Unsupported(class)) => {
                format!("an object of the Python type `{class}` instead of a dictionary")
            }
            _ => "no dictionary".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{CheckpointEntry, checkpoint};

    fn written(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("net.pth");
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    fn sample() -> Vec<u8> {
        checkpoint(&[
            ("a.weight", CheckpointEntry::Tensor(&[2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
            ("a.bias", CheckpointEntry::Tensor(&[2], &[0.5, f32::NAN])),
            ("epoch", CheckpointEntry::Call("posix", "system", "touch executed")),
        ])
    }

    #[test]
    fn tensors_are_read_by_name_and_shape() {
        let (_folder, path) = written(&sample());
        let dict = StateDict::open(&path).unwrap();
        assert_eq!(dict.names().collect::<Vec<_>>(), ["a.bias", "a.weight"]);
        assert_eq!(dict.shape("a.weight"), Some(&[2, 3][..]));
        assert_eq!(dict.values("a.weight", &[2, 3]).unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn what_is_wrong_with_a_tensor_is_named() {
        let (_folder, path) = written(&sample());
        let dict = StateDict::open(&path).unwrap();
        for (name, shape, part) in [
            ("a.weight", &[3, 2][..], "F32 of shape [2, 3]"),
            ("a.bias", &[2], "NaN at index 1"),
            ("b", &[1], "nothing of that name"),
            ("epoch", &[1], "`posix.system`, which is not run"),
        ] {
            let text = dict.values(name, shape).unwrap_err().to_string();
            assert!(
                text.starts_with(&format!("`{name}`")) && text.contains(part) && text.ends_with("net.pth"),
                "{text}"
            );
        }
    }

    #[test]
    fn nothing_in_a_pickle_is_executed() {
        let folder = tempfile::tempdir().unwrap();
        let (path, witness) = (folder.path().join("bad.pth"), folder.path().join("executed"));
        std::fs::write(&path, format!("cposix\nsystem\n(S'touch {}'\ntR.", witness.display())).unwrap();
        let read = StateDict::open(&path).and_then(|dict| dict.values("a", &[1]));
        assert!(read.unwrap_err().to_string().ends_with("bad.pth"));
        assert!(!witness.exists());
    }

    #[test]
    fn a_checkpoint_cut_at_any_byte_is_an_error_and_no_panic() {
        let whole = sample();
        let (_folder, path) = written(&whole);
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let read = StateDict::open(&path).and_then(|dict| dict.values("a.weight", &[2, 3]));
            assert!(read.unwrap_err().to_string().ends_with("net.pth"), "cut at {length}");
        }
    }
}
