//! What a run holds; its files are read, those as well that no fact is from.

use std::path::Path;

use anyhow::Result;
use lgs_data::files::FileError;
use lgs_data::ply::read_ply;
use lgs_train::events::read_events;
use serde_json::json;

use super::super::failure::At;
use super::super::run::Run;
use super::{Facts, scene};

pub(super) fn facts(path: &Path) -> Result<Facts> {
    let run = Run::open(path)?;
    let mut facts =
        vec![("kind", json!("run")), ("preset", json!(run.config.preset)), ("seed", json!(run.config.seed))];
    if let Some(dataset) = run.dataset_path(None)? {
        facts.push(("dataset", json!(dataset)));
    }
    if let Some(secs) = run.cost()?.train_secs {
        facts.push(("training", json!(format!("{secs:.0} s"))));
    }
    if let Some(sizes) = run.camera_corrections()? {
        facts.push(("corrections of poses", json!(sizes.pose_text())));
        facts.push(("corrections of exposures", json!(sizes.exposure_text())));
    }
    let source = run.source()?;
    let source = source.map(|source| format!("{}, {} Gaussians", source.kind().name(), source.len()));
    facts.push(("source model", json!(source.unwrap_or_else(|| "none".to_owned()))));
    facts.push(("training cameras", json!(run.cameras()?.len())));
    facts.extend(scene(&run.scene));
    facts.push(("evaluated", json!(evaluated(&run)?)));
    check_others(&run)?;
    Ok(facts)
}

/// The splits whose scores the run has, in words.
fn evaluated(run: &Run) -> Result<String> {
    let Some(splits) = run.scored_splits()? else { return Ok("no".to_owned()) };
    Ok(if splits.is_empty() { "the motion alone".to_owned() } else { splits.join(", ") })
}

/// Reads the files that no fact is from.
fn check_others(run: &Run) -> Result<()> {
    run.distillation()?;
    let events = run.folder.events_path();
    read_events(&events).at(&events)?;
    let clouds = run.folder.root().join("source").join("point_cloud");
    if clouds.is_dir() {
        let failed = |e| FileError::new("read folder", &clouds, e);
        for entry in std::fs::read_dir(&clouds).map_err(failed)? {
            let file = entry.map_err(failed)?.path().join("point_cloud.ply");
            if file.exists() {
                read_ply(&file).at(&file)?;
            }
        }
    }
    Ok(())
}
