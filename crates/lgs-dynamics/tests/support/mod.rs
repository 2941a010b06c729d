//! Helpers of several test binaries: conformance vectors, random particles, comparisons.
#![expect(clippy::unwrap_used, reason = "a test stops at what it did not expect")]
#![allow(dead_code, reason = "each test binary uses a part of it")]

#[cfg(feature = "gpu")]
pub(crate) mod devices;
pub(crate) mod motions;
pub(crate) mod rollouts;

use lgs_dynamics::{ForceKind, Normalisation, PotentialKind, System, SystemConfig};
use rand::RngExt;
use safetensors::SafeTensors;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// One conformance vector: its constants and its arrays.
pub(crate) struct Vector {
    pub(crate) name: String,
    pub(crate) constants: Value,
    bytes: Vec<u8>,
}

impl Vector {
    pub(crate) fn has(&self, name: &str) -> bool {
        self.tensors().tensor(name).is_ok()
    }

    fn tensors(&self) -> SafeTensors<'_> {
        SafeTensors::deserialize(&self.bytes).unwrap()
    }

    pub(crate) fn floats(&self, name: &str) -> Vec<f32> {
        let tensors = self.tensors();
        let view = tensors.tensor(name).unwrap_or_else(|e| panic!("{}: {name}: {e}", self.name));
        view.data().chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
    }

    pub(crate) fn indices(&self, name: &str) -> (Vec<u32>, usize) {
        let tensors = self.tensors();
        let view = tensors.tensor(name).unwrap();
        let width = view.shape()[1];
        let size = view.data().len() / view.shape().iter().product::<usize>();
        let values = view.data().chunks_exact(size).map(|b| {
            let mut wide = [0; 8];
            wide[..size].copy_from_slice(b);
            u64::from_le_bytes(wide) as u32
        });
        (values.collect(), width)
    }

    pub(crate) fn points(&self, name: &str) -> Vec<[f32; 3]> {
        points(&self.floats(name))
    }

    pub(crate) fn number(&self, name: &str) -> f64 {
        self.constants[name].as_f64().unwrap_or_else(|| panic!("{}: {name}", self.name))
    }
}

/// All vectors of a kind: those in the crate and those in the folder that `LAGRANGEGS_VECTORS` names.
pub(crate) fn vectors(kind: &str) -> Vec<Vector> {
    let mut found = vectors_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vectors"), kind);
    assert!(!found.is_empty(), "no vector of kind {kind} in the crate");
    if let Some(folder) = std::env::var_os("LAGRANGEGS_VECTORS") {
        found.extend(vectors_in(&PathBuf::from(folder), kind));
    }
    found
}

fn vectors_in(folder: &Path, kind: &str) -> Vec<Vector> {
    let text = std::fs::read_to_string(folder.join("index.json"))
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let index: serde_json::Map<String, Value> = serde_json::from_str(&text).unwrap();
    let files = std::fs::read_dir(folder)
        .unwrap()
        .filter(|f| f.as_ref().unwrap().path().extension().is_some_and(|e| e == "safetensors"));
    assert!(files.count() > 0 && !index.is_empty(), "{} holds no vectors", folder.display());
    let own = index.into_iter().filter(|(_, entry)| entry["kind"] == kind);
    own.map(|(name, constants)| {
        let path = folder.join(&name);
        let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Vector { name, constants, bytes }
    })
    .collect()
}

pub(crate) fn points(values: &[f32]) -> Vec<[f32; 3]> {
    values.as_chunks::<3>().0.to_vec()
}

/// The system of a vector of kind `dynamics`.
pub(crate) fn system_of(vector: &Vector) -> System {
    let mut system = System::init(SystemConfig::paper(), 0);
    for entry in system.layout() {
        system.params[entry.range].copy_from_slice(&vector.floats(&entry.name));
    }
    system
}

/// A system whose every parameter matters: random, with weights large enough for curvature.
pub(crate) fn lively_system(potential: PotentialKind, force: ForceKind) -> System {
    let normalisation =
        Normalisation { center: [0.1, -0.2, 0.3], length: 1.3, speed: 0.8, acceleration: 1.7 };
    let config = SystemConfig { potential, force, hidden: 20, hidden_layers: 2, normalisation };
    let mut system = System::init(config, 3);
    let mut rng = lgs_core::stream(11, "lively", 0);
    for value in &mut system.params {
        *value = 1.6 * (rng.random::<f32>() - 0.5);
    }
    system
}

/// Points uniform in a cube of the given half side.
pub(crate) fn random_points(n: usize, half: f32, seed: u64) -> Vec<[f32; 3]> {
    let mut rng = lgs_core::stream(seed, "points", 0);
    (0..n).map(|_| std::array::from_fn(|_| half * (2.0 * rng.random::<f32>() - 1.0))).collect()
}

/// `Σ a b` in double precision.
pub(crate) fn inner(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum()
}
