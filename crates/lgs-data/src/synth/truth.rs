//! The ground truth: points of the surfaces carried along by the motion, and the law with its constants.
//!
//! On disk: `ground_truth.safetensors` with `times` [T] f32, `points` [T, P, 3] f32 and `object` [P] i64 (−1
//! for what stands still), and `scene.json` with the law, without which the points alone are the truth. Other
//! programs' files may have doubles and other integers. Edited splits have files of their own,
//! `ground_truth_edit-….safetensors`, with the same points.

use super::body::{Part, Stage};
use super::error::SynthError;
use crate::files::{self, FileError};
use glam::DVec3;
use lgs_core::stream;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const LAW_FILE: &str = "scene.json";

/// Points carried along by a scene's motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroundTruth {
    /// Times, increasing `[T]`.
    pub times: Vec<f32>,
    /// Positions `[T][P]`, world units.
    pub points: Vec<Vec<[f32; 3]>>,
    /// The object of every point, −1 for what stands still `[P]`.
    pub object: Vec<i32>,
    /// The contents of `scene.json`: scene, seed, and for every object its law and constants; null where
    /// there is no such file.
    pub law: Value,
    /// The truth of every split that shows an edit, by the split's name; these have no edits of their own.
    pub edited: BTreeMap<String, GroundTruth>,
}

impl GroundTruth {
    /// Reads the ground truth of a dataset folder; nothing if it has none.
    ///
    /// # Errors
    /// If there is one and it can't be read.
    pub fn load(folder: &Path) -> Result<Option<Self>, SynthError> {
        let path = folder.join(file_name(None));
        if !path.exists() {
            return Ok(None);
        }
        let law = load_law(&folder.join(LAW_FILE))?;
        let read = |path: PathBuf| {
            let bytes = files::read_bytes(&path)?;
            parse(&bytes).map_err(|reason| SynthError::Truth { path, reason })
        };
        let mut edited = BTreeMap::new();
        for split in edited_splits(folder)? {
            let truth = Self { law: law.clone(), ..read(folder.join(file_name(Some(&split))))? };
            edited.insert(split, truth);
        }
        Ok(Some(Self { law, edited, ..read(path)? }))
    }

    /// Writes times, points and objects.
    pub(super) fn save_points(&self, path: &Path) -> Result<(), SynthError> {
        let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let flat: Vec<f32> = self.points.iter().flatten().flatten().copied().collect();
        let object: Vec<u8> = self.object.iter().flat_map(|&o| i64::from(o).to_le_bytes()).collect();
        let (times, points) = (bytes(&self.times), bytes(&flat));
        let wrong = |e: safetensors::SafeTensorError| SynthError::Truth {
            path: path.to_path_buf(),
            reason: e.to_string(),
        };
        let shape = vec![self.times.len(), self.object.len(), 3];
        let tensors = [
            ("times", TensorView::new(Dtype::F32, vec![self.times.len()], &times).map_err(wrong)?),
            ("points", TensorView::new(Dtype::F32, shape, &points).map_err(wrong)?),
            ("object", TensorView::new(Dtype::I64, vec![self.object.len()], &object).map_err(wrong)?),
        ];
        let file = safetensors::serialize(tensors, None).map_err(wrong)?;
        files::write_atomically(path, |w| w.write_all(&file))?;
        Ok(())
    }

    /// Numbers of the moving objects, each once, increasing.
    #[must_use]
    pub fn objects(&self) -> Vec<i32> {
        let mut objects: Vec<i32> = self.object.iter().copied().filter(|&o| o >= 0).collect();
        objects.sort_unstable();
        objects.dedup();
        objects
    }

    /// The trajectories of one object's points `[T][n]`.
    #[must_use]
    pub fn trajectories(&self, object: i32) -> Vec<Vec<[f32; 3]>> {
        let own = |row: &Vec<[f32; 3]>| {
            row.iter().zip(&self.object).filter(|&(_, &o)| o == object).map(|(&p, _)| p).collect()
        };
        self.points.iter().map(own).collect()
    }
}

/// The contents of `scene.json`; null where there is none: the points alone are a truth too.
fn load_law(path: &Path) -> Result<Value, SynthError> {
    if !path.exists() {
        return Ok(Value::Null);
    }
    serde_json::from_slice(&files::read_bytes(path)?)
        .map_err(|e| SynthError::Truth { path: path.to_path_buf(), reason: format!("malformed JSON: {e}") })
}

/// Name of the ground truth of a scene, or of one of its edited splits.
pub(super) fn file_name(split: Option<&str>) -> String {
    split.map_or_else(
        || "ground_truth.safetensors".to_owned(),
        |split| format!("ground_truth_{split}.safetensors"),
    )
}

/// Names of the edited splits that a folder has a ground truth of.
fn edited_splits(folder: &Path) -> Result<Vec<String>, SynthError> {
    let unreadable = |reason| FileError::new("list folder", folder, reason);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let name = entry.map_err(unreadable)?.file_name();
        let split = name.to_str().and_then(|n| n.strip_prefix("ground_truth_")?.strip_suffix(".safetensors"));
        names.extend(split.map(str::to_owned));
    }
    Ok(names)
}

/// Writes `scene.json`.
pub(super) fn save_law(folder: &Path, law: &Value) -> Result<(), SynthError> {
    let text = format!("{law:#}\n");
    files::write_atomically(&folder.join(LAW_FILE), |w| w.write_all(text.as_bytes()))?;
    Ok(())
}

/// Follows `count` surface points of every moving body, and of all fixed parts together, through the given
/// times.
pub(super) fn follow(stage: &Stage, times: &[f64], count: usize, seed: u64, law: Value) -> GroundTruth {
    let mut object = Vec::new();
    let mut points = vec![Vec::new(); times.len()];
    for (number, body) in stage.bodies.iter().enumerate() {
        let on_body = surface_points(&body.parts, count, seed, number as u64);
        object.extend(vec![number as i32; on_body.len()]);
        for (row, &t) in points.iter_mut().zip(times) {
            let pose = body.motion.pose(t);
            row.extend(on_body.iter().map(|&p| (pose.linear * p + pose.position).as_vec3().to_array()));
        }
    }
    if !stage.fixed.is_empty() {
        let still = surface_points(&stage.fixed, count, seed, stage.bodies.len() as u64);
        object.extend(vec![-1; still.len()]);
        points.iter_mut().for_each(|row| row.extend(still.iter().map(|p| p.as_vec3().to_array())));
    }
    GroundTruth {
        times: times.iter().map(|&t| t as f32).collect(),
        points,
        object,
        law,
        edited: BTreeMap::new(),
    }
}

/// Points of the surface of a union of parts, uniform by area, in body axes.
fn surface_points(parts: &[Part], count: usize, seed: u64, body: u64) -> Vec<DVec3> {
    use rand::RngExt;
    let mut rng = stream(seed, "ground truth points", body);
    let total: f64 = parts.iter().map(|part| part.shape.area()).sum();
    let mut points = Vec::with_capacity(count);
    while points.len() < count {
        let mut pick: f64 = rng.random_range(0.0..total);
        let mut number = 0;
        while number + 1 < parts.len() && pick >= parts[number].shape.area() {
            pick -= parts[number].shape.area();
            number += 1;
        }
        let part = &parts[number];
        let p = part.rotation * part.shape.surface_point(&mut rng) + part.center;
        if !parts.iter().any(|other| other.contains(p)) {
            points.push(p);
        }
    }
    points
}

fn parse(bytes: &[u8]) -> Result<GroundTruth, String> {
    let file = SafeTensors::deserialize(bytes).map_err(|e| e.to_string())?;
    let tensor = |name: &str| file.tensor(name).map_err(|e| format!("tensor `{name}`: {e}"));
    let (times, object) = (floats("times", &tensor("times")?)?, labels("object", &tensor("object")?)?);
    let (points, [steps, count]) = (tensor("points")?, [times.len(), object.len()]);
    if points.shape() != [steps, count, 3] {
        return Err(format!(
            "tensor `points`: expected shape [{steps}, {count}, 3], found {:?}",
            points.shape()
        ));
    }
    if let Some(at) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
        let found = &times[at..at + 2];
        return Err(format!("tensor `times`: expected increasing times, found {found:?} at {at}"));
    }
    let positions: Vec<[f32; 3]> = floats("points", &points)?.as_chunks().0.to_vec();
    Ok(GroundTruth {
        times,
        points: if count == 0 {
            vec![Vec::new(); steps]
        } else {
            positions.chunks_exact(count).map(<[_]>::to_vec).collect()
        },
        object,
        ..GroundTruth::default()
    })
}

/// Finite numbers in single or double precision.
fn floats(name: &str, tensor: &TensorView<'_>) -> Result<Vec<f32>, String> {
    let data = tensor.data();
    let values: Vec<f32> = match tensor.dtype() {
        Dtype::F32 => data.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect(),
        Dtype::F64 => data.as_chunks().0.iter().map(|&b| f64::from_le_bytes(b) as f32).collect(),
        other => return Err(format!("tensor `{name}`: expected F32 or F64, found {other:?}")),
    };
    match values.iter().position(|v| !v.is_finite()) {
        Some(at) => Err(format!("tensor `{name}`: value {at} is not finite")),
        None => Ok(values),
    }
}

/// Numbers of objects, in any of the usual types of integers.
fn labels(name: &str, tensor: &TensorView<'_>) -> Result<Vec<i32>, String> {
    let data = tensor.data();
    match tensor.dtype() {
        Dtype::I64 => Ok(data.as_chunks().0.iter().map(|&b| i64::from_le_bytes(b) as i32).collect()),
        Dtype::I32 => Ok(data.as_chunks().0.iter().map(|&b| i32::from_le_bytes(b)).collect()),
        Dtype::I16 => Ok(data.as_chunks().0.iter().map(|&b| i16::from_le_bytes(b).into()).collect()),
        Dtype::U8 => Ok(data.iter().map(|&b| b.into()).collect()),
        other => Err(format!("tensor `{name}`: expected I64, I32, I16 or U8, found {other:?}")),
    }
}
