//! Named tensors and string metadata in one safetensors file: the form of checkpoints and models.
//!
//! Writing is atomic. Reading checks the format name and version, every tensor's presence, type and shape,
//! and that floats are finite; each defect is an error of its own that names the file and the tensor.

mod error;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lgs_nn::ParamRange;
use safetensors::{Dtype, SafeTensors, tensor::TensorView};

pub use error::TensorFileError;

/// One tensor: shape and values.
#[derive(Clone, Debug, PartialEq)]
enum TensorValues {
    /// 32-bit floats.
    F32(Vec<f32>),
    /// 32-bit unsigned integers.
    U32(Vec<u32>),
}

/// Named tensors and metadata, in name order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TensorFile {
    format: String,
    path: PathBuf,
    metadata: BTreeMap<String, String>,
    tensors: BTreeMap<String, (Vec<usize>, TensorValues)>,
}

/// Metadata key of the format name and version.
const FORMAT_KEY: &str = "format";

impl TensorFile {
    /// An empty file of a format such as `lagrangegs-scene/1`.
    #[must_use]
    pub fn new(format: &str) -> Self {
        Self { format: format.to_owned(), ..Self::default() }
    }

    /// Adds a metadata entry.
    pub fn set_metadata(&mut self, key: &str, value: impl Into<String>) {
        self.metadata.insert(key.to_owned(), value.into());
    }

    /// Adds a float tensor.
    ///
    /// # Panics
    /// If the shape does not multiply to the number of values (a bug, not an input).
    pub fn insert(&mut self, name: impl Into<String>, shape: &[usize], values: &[f32]) {
        assert_eq!(shape.iter().product::<usize>(), values.len(), "shape of the tensor");
        self.tensors.insert(name.into(), (shape.to_vec(), TensorValues::F32(values.to_vec())));
    }

    /// Adds the named arrays of a flat parameter vector, each as `PREFIX.NAME`.
    ///
    /// # Panics
    /// If an array lies outside of the vector.
    pub fn insert_params(&mut self, prefix: &str, arrays: &[ParamRange], params: &[f32]) {
        for array in arrays {
            self.insert(format!("{prefix}.{}", array.name), &array.shape, &params[array.range.clone()]);
        }
    }

    /// The flat parameter vector that [`Self::insert_params`] wrote.
    ///
    /// # Errors
    /// If an array is absent, not finite or of another shape.
    pub fn params(&self, prefix: &str, arrays: &[ParamRange]) -> Result<Vec<f32>, TensorFileError> {
        let len = arrays.iter().map(|array| array.range.end).max().unwrap_or(0);
        let mut params = vec![0.0; len];
        for array in arrays {
            let name = format!("{prefix}.{}", array.name);
            let (shape, values) = self.values(&name)?;
            if shape != array.shape {
                return Err(self.field(&name, &format!("shape {:?}", array.shape), format!("{shape:?}")));
            }
            params[array.range.clone()].copy_from_slice(values);
        }
        Ok(params)
    }

    /// Adds an index tensor.
    ///
    /// # Panics
    /// If the shape does not multiply to the number of values (a bug, not an input).
    pub fn insert_indices(&mut self, name: impl Into<String>, shape: &[usize], values: &[u32]) {
        assert_eq!(shape.iter().product::<usize>(), values.len(), "shape of the tensor");
        self.tensors.insert(name.into(), (shape.to_vec(), TensorValues::U32(values.to_vec())));
    }

    /// Names of all tensors.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.tensors.keys().map(String::as_str)
    }

    /// Writes the file under a temporary name and renames it.
    ///
    /// # Errors
    /// If the folder cannot be written or the disk is full; the path keeps what it held.
    pub fn save(&self, path: &Path) -> Result<(), TensorFileError> {
        let bytes = self.to_bytes(path)?;
        Ok(lgs_data::files::write_atomically(path, |w| w.write_all(&bytes))?)
    }

    fn to_bytes(&self, path: &Path) -> Result<Vec<u8>, TensorFileError> {
        let raw: Vec<(&String, &Vec<usize>, Dtype, Vec<u8>)> = self
            .tensors
            .iter()
            .map(|(name, (shape, values))| match values {
                TensorValues::F32(v) => {
                    (name, shape, Dtype::F32, v.iter().flat_map(|x| x.to_le_bytes()).collect())
                }
                TensorValues::U32(v) => {
                    (name, shape, Dtype::U32, v.iter().flat_map(|x| x.to_le_bytes()).collect())
                }
            })
            .collect();
        let damaged = |e: safetensors::SafeTensorError| TensorFileError::Damaged {
            path: path.to_owned(),
            reason: e.to_string(),
        };
        let mut views = Vec::with_capacity(raw.len());
        for (name, shape, dtype, bytes) in &raw {
            views.push((name.as_str(), TensorView::new(*dtype, (*shape).clone(), bytes).map_err(damaged)?));
        }
        // One JSON string under one key: the library keeps metadata in a hash map, and files must be the same
        // byte for byte.
        let mut metadata = self.metadata.clone();
        metadata.insert(FORMAT_KEY.to_owned(), self.format.clone());
        let json = serde_json::to_string(&metadata)
            .map_err(|e| TensorFileError::Damaged { path: path.to_owned(), reason: e.to_string() })?;
        safetensors::serialize(views, Some([("lagrangegs".to_owned(), json)].into())).map_err(damaged)
    }

    /// Reads a file of a format.
    ///
    /// # Errors
    /// If it cannot be read, is damaged, or is of another format or version.
    pub fn load(path: &Path, format: &str) -> Result<Self, TensorFileError> {
        Self::load_one_of(path, &[format])
    }

    /// Reads a file of any of several formats; [`Self::format`] says which it is.
    ///
    /// # Errors
    /// If it cannot be read, is damaged, or is of another format or version.
    pub fn load_one_of(path: &Path, formats: &[&str]) -> Result<Self, TensorFileError> {
        let bytes =
            std::fs::read(path).map_err(|source| TensorFileError::Read { path: path.to_owned(), source })?;
        let damaged = |reason: String| TensorFileError::Damaged { path: path.to_owned(), reason };
        let (_, header) = SafeTensors::read_metadata(&bytes).map_err(|e| damaged(e.to_string()))?;
        let json = header
            .metadata()
            .as_ref()
            .and_then(|m| m.get("lagrangegs").cloned())
            .unwrap_or_else(|| "{}".to_owned());
        let mut metadata: BTreeMap<String, String> =
            serde_json::from_str(&json).map_err(|e| damaged(e.to_string()))?;
        let found = metadata.remove(FORMAT_KEY).unwrap_or_else(|| "no format name".to_owned());
        if !formats.contains(&found.as_str()) {
            return Err(TensorFileError::Format {
                path: path.to_owned(),
                expected: formats.join("` or `"),
                found,
            });
        }
        let parsed = SafeTensors::deserialize(&bytes).map_err(|e| damaged(e.to_string()))?;
        let mut file = Self { format: found, path: path.to_owned(), metadata, tensors: BTreeMap::new() };
        for (name, view) in parsed.tensors() {
            let words = view.data().as_chunks::<4>().0;
            let values = match view.dtype() {
                Dtype::F32 => TensorValues::F32(words.iter().map(|w| f32::from_le_bytes(*w)).collect()),
                Dtype::U32 => TensorValues::U32(words.iter().map(|w| u32::from_le_bytes(*w)).collect()),
                other => return Err(file.field(&name, "F32 or U32", format!("{other:?}"))),
            };
            file.tensors.insert(name, (view.shape().to_vec(), values));
        }
        Ok(file)
    }

    /// Format name and version.
    #[must_use]
    pub fn format(&self) -> &str {
        &self.format
    }

    /// A metadata entry.
    ///
    /// # Errors
    /// If it is absent.
    pub fn metadata(&self, key: &str) -> Result<&str, TensorFileError> {
        self.metadata.get(key).map(String::as_str).ok_or_else(|| self.missing(key))
    }

    /// A metadata entry, parsed from JSON.
    ///
    /// # Errors
    /// If it is absent or does not parse.
    pub fn metadata_json<T: serde::de::DeserializeOwned>(&self, key: &str) -> Result<T, TensorFileError> {
        let text = self.metadata(key)?;
        serde_json::from_str(text).map_err(|e| self.field(key, "a valid entry", e.to_string()))
    }

    /// A float tensor of any shape, finite.
    ///
    /// # Errors
    /// If it is absent, of another type or not finite.
    pub fn values(&self, name: &str) -> Result<(&[usize], &[f32]), TensorFileError> {
        match self.tensors.get(name) {
            None => Err(self.missing(name)),
            Some((shape, TensorValues::F32(values))) => match values.iter().position(|v| !v.is_finite()) {
                None => Ok((shape, values)),
                Some(at) => Err(self.field(name, "finite values", format!("{} at index {at}", values[at]))),
            },
            Some(_) => Err(self.field(name, "F32", "U32".to_owned())),
        }
    }

    /// A float tensor with rows of `D` values: `[n, D]`.
    ///
    /// # Errors
    /// As [`Self::values`], and if the shape is another.
    pub fn rows<const D: usize>(&self, name: &str) -> Result<Vec<[f32; D]>, TensorFileError> {
        let (shape, values) = self.values(name)?;
        if shape.len() != 2 || shape[1] != D {
            return Err(self.field(name, &format!("shape [n, {D}]"), format!("{shape:?}")));
        }
        Ok(values.as_chunks::<D>().0.to_vec())
    }

    /// An index tensor of any shape.
    ///
    /// # Errors
    /// If it is absent or of another type.
    pub fn indices(&self, name: &str) -> Result<(&[usize], &[u32]), TensorFileError> {
        match self.tensors.get(name) {
            None => Err(self.missing(name)),
            Some((shape, TensorValues::U32(values))) => Ok((shape, values)),
            Some(_) => Err(self.field(name, "U32", "F32".to_owned())),
        }
    }

    /// An error about a field of this file.
    #[must_use]
    pub fn field(&self, field: &str, expected: &str, found: String) -> TensorFileError {
        TensorFileError::Field {
            path: self.path.clone(),
            field: field.to_owned(),
            expected: expected.to_owned(),
            found,
        }
    }

    fn missing(&self, field: &str) -> TensorFileError {
        TensorFileError::Missing { path: self.path.clone(), field: field.to_owned() }
    }
}

#[cfg(test)]
mod tests;
