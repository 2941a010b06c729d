//! Point tracks of motion capture: what a file holds, and what of it is used.

use std::path::Path;

use anyhow::Result;
use lgs_data::frames::read_frames;
use lgs_data::tracks::{LengthUnit, PointTracks, WholeTracks, is_track_file, read_tracks};
use serde_json::json;

use super::facts::Facts;
use super::failure::At;
use super::progress::say;

/// Names of points that a line lists at most.
const LISTED: usize = 8;

/// A file's facts, in the order they are printed.
pub(super) fn facts(path: &Path) -> Result<Facts> {
    let tracks = read_tracks(path).at(path)?;
    // What only the use as frames asks for.
    read_frames(path).at(path)?;
    let whole = tracks.whole().at(path)?;
    let samples = tracks.points.iter().flatten();
    let missing = samples.clone().filter(|sample| sample.is_none()).count();
    let seen = 1.0 - missing as f64 / samples.count().max(1) as f64;
    let last = tracks.times.last().copied().unwrap_or(0.0);
    Ok(vec![
        ("kind", json!("point tracks")),
        ("points", json!(tracks.labels.len())),
        ("times", json!(format!("{} from 0 to {last:.3}", tracks.times.len()))),
        ("unit", json!(unit(&tracks.unit))),
        ("seen", json!(format!("{:.1} % of the samples", 100.0 * seen))),
        ("used", json!(used(&tracks, &whole))),
    ])
}

/// Says what of a file of point tracks is used, before it is.
pub(super) fn announce(path: &Path) -> Result<()> {
    if is_track_file(path) {
        let tracks = read_tracks(path).at(path)?;
        let whole = tracks.whole().at(path)?;
        say(&format!("point tracks: {}; {}", used(&tracks, &whole), unit(&tracks.unit)));
    }
    Ok(())
}

fn used(tracks: &PointTracks, whole: &WholeTracks) -> String {
    let mut text = format!("{} of {} points", whole.labels.len(), tracks.labels.len());
    if whole.filled > 0 {
        text += &format!(", {} samples filled", whole.filled);
    }
    if let Some(names) = whole.left_out.get(..whole.left_out.len().min(LISTED)).filter(|n| !n.is_empty()) {
        let more = if whole.left_out.len() > LISTED { ", …" } else { "" };
        text += &format!(", {} with long gaps left out ({}{more})", whole.left_out.len(), names.join(", "));
    }
    text
}

fn unit(unit: &LengthUnit) -> String {
    match (unit.name.as_str(), unit.metres) {
        ("", _) => "lengths without a unit are kept".to_owned(),
        (name, Some(_)) => format!("lengths in {name} become metres"),
        (name, None) => format!("lengths in {name} are kept"),
    }
}
