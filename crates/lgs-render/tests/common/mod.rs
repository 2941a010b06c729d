//! Conformance vectors: those in the repository and those of the folder that `LAGRANGEGS_VECTORS` names.

pub(crate) mod tensors;

use lgs_core::Camera;
use safetensors::SafeTensors;
use std::path::{Path, PathBuf};

/// A conformance vector: constants and tensors.
pub(crate) struct Vector {
    pub(crate) name: String,
    pub(crate) constants: serde_json::Value,
    bytes: Vec<u8>,
}

impl Vector {
    /// The values of a tensor.
    pub(crate) fn get(&self, tensor: &str) -> Vec<f32> {
        let file = SafeTensors::deserialize(&self.bytes).expect("a safetensors file");
        let view = file.tensor(tensor).unwrap_or_else(|e| panic!("{}: {tensor}: {e}", self.name));
        view.data().chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("four bytes"))).collect()
    }

    /// The values of a tensor in rows of `N`.
    pub(crate) fn rows<const N: usize>(&self, tensor: &str) -> Vec<[f32; N]> {
        self.get(tensor).as_chunks::<N>().0.to_vec()
    }

    /// The shape of a tensor.
    pub(crate) fn shape(&self, tensor: &str) -> Vec<usize> {
        SafeTensors::deserialize(&self.bytes)
            .expect("a safetensors file")
            .tensor(tensor)
            .expect("tensor")
            .shape()
            .to_vec()
    }

    pub(crate) fn number(&self, constant: &str) -> f32 {
        self.constants[constant].as_f64().unwrap_or_else(|| panic!("{}: {constant}", self.name)) as f32
    }

    /// The camera of a `rasterize` vector.
    pub(crate) fn camera(&self) -> Camera {
        let view: [f32; 16] = self.get("view").try_into().expect("16 values");
        Camera {
            width: self.number("width") as u32,
            height: self.number("height") as u32,
            fx: self.number("fx"),
            fy: self.number("fy"),
            cx: self.number("cx"),
            cy: self.number("cy"),
            camera_from_world: glam::Mat4::from_cols_array(&view).transpose(),
            near: lgs_core::DEFAULT_NEAR,
            filter: lgs_core::PixelFilter::Dilation,
        }
    }
}

/// Every vector of a kind; at least one.
pub(crate) fn vectors(kind: &str) -> Vec<Vector> {
    let mut folders = vec![PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/vectors")];
    if let Some(named) = std::env::var_os("LAGRANGEGS_VECTORS") {
        folders.push(PathBuf::from(named));
    }
    folders.iter().flat_map(|folder| of_kind(folder, kind)).collect()
}

fn of_kind(folder: &Path, kind: &str) -> Vec<Vector> {
    let index = folder.join("index.json");
    let text = std::fs::read_to_string(&index).unwrap_or_else(|e| panic!("{}: {e}", index.display()));
    let index: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(&text).expect("a JSON object");
    let found: Vec<Vector> = index
        .into_iter()
        .filter(|(_, constants)| constants["kind"] == kind)
        .map(|(name, constants)| Vector {
            bytes: std::fs::read(folder.join(&name)).expect("a listed vector"),
            name,
            constants,
        })
        .collect();
    assert!(!found.is_empty(), "{} has no vector of kind {kind}", folder.display());
    found
}
