//! What a dataset holds, and what it lacks.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::Result;
use lgs_data::dataset::{CameraOrigin, Dataset, DatasetFormat, Frame, LoadOptions};
use lgs_data::files::write_atomically;
use lgs_data::synth::GroundTruth;
use lgs_report::rig_figure;
use serde_json::{Value, json};

use super::super::failure::{At, BadUsage};
use super::super::output::refuse_inside_dataset;
use super::super::run::{absent_images, load_dataset};
use super::{Args, Facts, distinct};

/// Absent images that are named; `absent images` counts all.
const NAMED: usize = 8;

pub(super) fn facts(args: &Args, path: &Path, format: DatasetFormat) -> Result<Facts> {
    let absent = absent_images(args.skip_missing);
    let is_svg = |path: &Path| path.extension().is_some_and(|ending| ending == "svg");
    if let Some(other) = args.rig.as_deref().filter(|path| !is_png(path) && !is_svg(path)) {
        let text = format!("expected a picture that ends with .svg or .png: {}", other.display());
        return Err(BadUsage(text).into());
    }
    let set = load_dataset(path, &LoadOptions { format: Some(format), absent, ..LoadOptions::default() })?;
    if let Some(picture) = &args.rig {
        draw_rig(&set, picture)?;
    }
    let frames = || set.splits.values().flatten();
    let sizes = distinct(frames().map(|f| format!("{}x{}", f.camera.width, f.camera.height)));
    let cameras = frames().map(|f| f.camera_id).max().map_or(0, |id| id + 1);
    let points = set.init_points.as_ref().map(|points| points.positions.len().to_string());
    let masked = frames().filter(|frame| frame.pixels.has_mask()).count();
    let mut facts = vec![
        ("kind", json!("dataset")),
        ("format", json!(format.name())),
        ("fingerprint", json!(set.fingerprint)),
        ("splits", splits(&set)),
        ("motion", json!(if set.is_still() { "none: a still scene" } else { "images of several times" })),
        ("image sizes", json!(sizes.join(", "))),
        ("cameras", json!(cameras)),
        ("poses", json!(origin(set.camera_origin))),
        ("transparency", json!(if frames().any(Frame::has_alpha) { "yes" } else { "no, images are opaque" })),
        ("masks", json!(if masked > 0 { format!("{masked} images") } else { "none".to_owned() })),
        ("initial points", json!(points.unwrap_or_else(|| "none".to_owned()))),
    ];
    if let Some(truth) = GroundTruth::load(path).at(path)? {
        let (points, times, objects) = (truth.object.len(), truth.times.len(), truth.objects().len());
        facts.push(("ground truth", json!(format!("{points} points at {times} times, {objects} objects"))));
    }
    facts.extend(lacks(&set));
    Ok(facts)
}

/// Where poses come from, in words.
fn origin(origin: CameraOrigin) -> &'static str {
    match origin {
        CameraOrigin::Exact => "exact, as of rendered images",
        CameraOrigin::Calibrated => "of a calibrated rig",
        CameraOrigin::Estimated => "found from the images",
    }
}

/// What is absent or strange; nothing where all is well.
fn lacks(set: &Dataset) -> Facts {
    let mut facts = Vec::new();
    if !set.absent.is_empty() {
        let relative =
            |path: &std::path::PathBuf| path.strip_prefix(&set.root).unwrap_or(path).display().to_string();
        let names: Vec<String> = set.absent.iter().take(NAMED).map(relative).collect();
        let more = if set.absent.len() > NAMED { ", …" } else { "" };
        let text = format!("{}: {}{more}", set.absent.len(), names.join(", "));
        facts.push(("absent images", json!(text)));
    }
    let remarks = [set.remarks.clone(), set.suspicious_poses()].concat();
    if !remarks.is_empty() {
        facts.push(("remarks", json!(remarks.join("; "))));
    }
    facts
}

/// Of every split: images, cameras, times, and the part of all pairs of a camera and a time that it shows.
fn splits(set: &Dataset) -> Value {
    let line = |(name, frames): (&String, &Vec<Frame>)| {
        let times: BTreeSet<u32> = frames.iter().map(|f| f.time.to_bits()).collect();
        let (low, high) = frames
            .iter()
            .map(|f| f.time)
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)));
        let (images, cameras) = (frames.len(), set.cameras(name).len());
        let part = 100.0 * images as f64 / (cameras * times.len()).max(1) as f64;
        let moments = times.len();
        format!(
            "{name}: {images} images, {cameras} cameras, {moments} times, t {low:.3} to {high:.3}, \
                {part:.0} % of cameras and times"
        )
    };
    json!(set.splits.iter().map(line).collect::<Vec<_>>().join("; "))
}

/// Draws the cameras as an SVG or a PNG.
fn draw_rig(set: &Dataset, path: &Path) -> Result<()> {
    refuse_inside_dataset(path)?;
    let figure = rig_figure(set).at(path)?;
    let bytes = if is_png(path) { figure.png } else { figure.svg.into_bytes() };
    write_atomically(path, |w| w.write_all(&bytes)).at(path)
}

fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "png")
}
