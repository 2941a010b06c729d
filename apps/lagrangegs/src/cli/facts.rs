//! Facts about splats, however they came, as `info` prints them.

use std::path::Path;

use anyhow::Result;
use lgs_core::GaussianCloud;
use lgs_data::cameras::read_cameras_json;
use lgs_data::frames::{FrameSequence, read_frames};
use lgs_data::splats::splatv::read_splat_video;
use lgs_model::source::{DefGs, read_official_defgs};
use serde_json::{Value, json};

use super::failure::At;

/// Facts in the order they are printed.
pub(super) type Facts = Vec<(&'static str, Value)>;

/// Gaussians of one moment; `kind` says of what.
pub(super) fn cloud(kind: &str, cloud: &GaussianCloud) -> Facts {
    let bounds = |pick: fn(f32, f32) -> f32, start: f32| {
        cloud.means.iter().fold([start; 3], |b, p| std::array::from_fn(|c| pick(b[c], p[c])))
    };
    let mean = |values: &mut dyn Iterator<Item = f32>| {
        values.map(f64::from).sum::<f64>() / cloud.len().max(1) as f64
    };
    let mut facts = vec![
        ("kind", json!(kind)),
        ("Gaussians", json!(cloud.len())),
        ("harmonics degree", json!(cloud.sh_degree)),
    ];
    if !cloud.is_empty() {
        let point = |p: [f32; 3]| format!("{:.3} {:.3} {:.3}", p[0], p[1], p[2]);
        let (low, high) = (bounds(f32::min, f32::INFINITY), bounds(f32::max, f32::NEG_INFINITY));
        let opacity = mean(&mut (0..cloud.len()).map(|i| cloud.opacity(i)));
        let scale = mean(&mut cloud.log_scales.as_flattened().iter().map(|s| s.exp() / 3.0));
        facts.push(("bounds", json!(format!("{} to {}", point(low), point(high)))));
        facts.push(("mean opacity", json!(format!("{opacity:.3}"))));
        facts.push(("mean scale", json!(format!("{scale:.4}"))));
    }
    facts
}

/// Frames of the same Gaussians.
pub(super) fn sequence(frames: &FrameSequence) -> Facts {
    let [first, last] = [frames.times.first(), frames.times.last()].map(|t| t.copied().unwrap_or_default());
    let mut facts = vec![
        ("kind", json!("frames")),
        ("times", json!(format!("{} from {first} to {last}", frames.times.len()))),
        ("rotations", json!(if frames.rotations.len() == 1 { "constant" } else { "changing" })),
    ];
    facts.extend_from_slice(&cloud("", &frames.gaussians)[1..]);
    facts
}

/// A `.splatv` file.
pub(super) fn moving_splats(path: &Path) -> Result<Facts> {
    let left_out = read_splat_video(path).at(path)?.left_out;
    let facts = sequence(&read_frames(path).at(path)?);
    let come_and_go = ("left out", json!(format!("{left_out} Gaussians that come and go")));
    Ok([&[("kind", json!("moving splats, splatv")), come_and_go], &facts[1..]].concat())
}

/// An output folder of the DefGS authors' program.
pub(super) fn official(path: &Path) -> Result<Facts> {
    let found = read_official_defgs(path).at(path)?;
    let DefGs { canonical, deformation } = &found.model;
    let config = &deformation.config;
    let inputs = format!("{} of the position, {} of the time", config.position_width(), config.time_width());
    let mut facts = vec![
        ("kind", json!("output of the DefGS program")),
        ("iteration", json!(found.iteration)),
        ("network", json!(format!("{} layers of {}", config.depth, config.width))),
        ("inputs", json!(inputs)),
    ];
    if let Some(settings) = &found.settings {
        let white = settings.white_background.unwrap_or_default();
        facts.push(("images", json!(settings.source_path)));
        facts.push(("background", json!(if white { "white" } else { "black" })));
    }
    let cameras = path.join("cameras.json");
    if cameras.exists() {
        facts.push(("cameras", json!(read_cameras_json(&cameras).at(&cameras)?.len())));
    }
    facts.extend_from_slice(&cloud("", canonical)[1..]);
    Ok(facts)
}
