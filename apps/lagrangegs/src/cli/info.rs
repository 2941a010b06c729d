//! `lagrangegs info`: looks at what a path is, reads all of it, and reports what it holds. A defect is an
//! error like everywhere else.

mod dataset;
mod run;
mod terms;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use lgs_data::dataset::DatasetFormat;
use lgs_data::frames::{list_frames, read_frames};
use lgs_data::splats::{SplatFormat, read_splats};
use lgs_data::synth::GroundTruth;
use lgs_data::tracks::is_track_file;
use lgs_eval::table::aligned;
use lgs_model::source::{is_official_defgs, load_source};
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, ObjectModel, ParticleDynamics, load_scene};
use lgs_train::checkpoint::read_checkpoint;
use serde_json::{Map, Value, json};

use super::device;
use super::facts::{Facts, cloud, moving_splats, official, sequence};
use super::failure::At;
use super::output;
use super::run::dataset_format;
use super::tracks;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Dataset, run, checkpoint, model, splat file, folder of frames, trajectories or output of DefGS
    #[arg(required_unless_present_any = ["devices", "terms"])]
    path: Option<PathBuf>,
    /// List the devices that --device can name
    #[arg(long, conflicts_with_all = ["path", "format", "skip_missing", "rig"])]
    devices: bool,
    /// List the kinds of terms that laws are made of
    #[arg(long, conflicts_with_all = ["path", "devices", "format", "skip_missing", "rig"])]
    terms: bool,
    /// Format of the dataset [default: detected]
    #[arg(long, value_name = "NAME", value_parser = dataset_format)]
    format: Option<DatasetFormat>,
    /// Leave out images that a dataset lists and that are absent, and count them
    #[arg(long)]
    skip_missing: bool,
    /// Draw a dataset's cameras, from above and from the side
    #[arg(long, value_name = "FILE.svg|png")]
    rig: Option<PathBuf>,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<()> {
    if args.terms {
        return terms::list(args.json);
    }
    let Some(path) = &args.path else { return device::list(args.json) };
    let facts = describe(args, path)?;
    if args.json {
        let object: Map<String, Value> =
            facts.into_iter().map(|(name, value)| (name.replace(' ', "_"), value)).collect();
        return output::print_json(&object);
    }
    let plain = |value: Value| match value {
        Value::String(text) => text,
        other => other.to_string(),
    };
    let rows: Vec<Vec<String>> =
        facts.into_iter().map(|(name, value)| vec![name.to_owned(), plain(value)]).collect();
    output::print(&aligned(&rows, &[false, false]))
}

fn describe(args: &Args, path: &Path) -> Result<Facts> {
    if !path.exists() {
        bail!("there is no such file or folder: {}", path.display());
    }
    if path.is_dir() {
        return folder(args, path);
    }
    if is_track_file(path) {
        return tracks::facts(path);
    }
    if let Some(format) = SplatFormat::of_name(path) {
        let facts = cloud("splat file", &read_splats(path).at(path)?);
        let format = SplatFormat::of_file(path).unwrap_or(format);
        return Ok([&facts[..1], &[("format", json!(format.name()))], &facts[1..]].concat());
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("splatv")) {
        return moving_splats(path);
    }
    if path.extension().is_some_and(|e| e == "safetensors") {
        return tensors(path);
    }
    bail!(
        "expected a splat file (.ply, .splat, .spz, .splatv), point tracks (.c3d, .csv, .tsv), a \
         .safetensors file, a dataset or a run: {}",
        path.display()
    )
}

fn folder(args: &Args, path: &Path) -> Result<Facts> {
    if args.format.is_none() && is_official_defgs(path) {
        return official(path);
    }
    if let Some(format) = args.format.or_else(|| DatasetFormat::detect(path)) {
        return dataset::facts(args, path, format);
    }
    if path.join("config.toml").exists() {
        return run::facts(path);
    }
    let files = list_frames(path).at(path)?;
    let Some(first) = files.first() else {
        bail!(
            "the folder is neither a dataset nor a run (config.toml), and has no splat files: {}",
            path.display()
        )
    };
    let format = SplatFormat::of_file(&path.join(&first.name)).at(path)?;
    let facts = match &files[..] {
        [only] => {
            let file = path.join(&only.name);
            let facts = cloud("frames", &read_splats(&file).at(&file)?);
            let times = only.time.map_or_else(|| "1".to_owned(), |time| format!("1 at {time}"));
            [&facts[..1], &[("times", json!(times))], &facts[1..]].concat()
        }
        _ => sequence(&read_frames(path).at(path)?),
    };
    Ok([&facts[..1], &[("format", json!(format.name()))], &facts[1..]].concat())
}

/// Every different text once, sorted.
fn distinct(texts: impl Iterator<Item = String>) -> Vec<String> {
    texts.collect::<std::collections::BTreeSet<_>>().into_iter().collect()
}

/// A tensor file of any of the project's formats.
fn tensors(path: &Path) -> Result<Facts> {
    let whole = match load_scene(path) {
        Ok(found) => return Ok([vec![("kind", json!("Lagrangian scene"))], scene(&found)].concat()),
        Err(error) => error,
    };
    if let Ok(checkpoint) = read_checkpoint(path) {
        return Ok(vec![
            ("kind", json!("checkpoint")),
            ("stage", json!(checkpoint.stage.name())),
            ("step", json!(checkpoint.step)),
            ("tensors", json!(checkpoint.file.names().count())),
        ]);
    }
    if let Ok(model) = load_source(path) {
        return Ok([
            vec![("kind", json!(format!("source model, {}", model.kind().name())))],
            cloud("at t = 0", &model.cloud_at(0.0))[1..].to_vec(),
        ]
        .concat());
    }
    if let Ok(frames) = read_frames(path) {
        return Ok(sequence(&frames));
    }
    match path.parent().map(GroundTruth::load) {
        Some(Ok(Some(truth))) if path.file_name().is_some_and(|n| n == "ground_truth.safetensors") => {
            Ok(vec![
                ("kind", json!("ground truth")),
                ("points", json!(truth.object.len())),
                ("objects", json!(truth.objects().len())),
                ("times", json!(truth.times.len())),
            ])
        }
        _ => Err(whole).at(path),
    }
}

fn scene(scene: &LagrangianScene) -> Facts {
    let (low, high) = scene.motion.time_range();
    let members: Vec<String> = scene.objects.iter().map(|o| o.members.len().to_string()).collect();
    let kinds = distinct(scene.objects.iter().map(dynamics));
    vec![
        ("static Gaussians", json!(scene.static_gaussians.len())),
        ("moving Gaussians", json!(scene.dynamic_gaussians.len())),
        (
            "objects",
            json!(if members.is_empty() {
                "none".to_owned()
            } else {
                format!("{} ({} Gaussians)", members.len(), members.join(", "))
            }),
        ),
        ("dynamics", json!(kinds.join(", "))),
        ("times", json!(format!("{low} to {high}, step {}", scene.motion.dt))),
        ("alignment", json!(distinct(scene.objects.iter().map(alignment)).join(", "))),
        ("harmonics degree", json!(scene.dynamic_gaussians.sh_degree.max(scene.static_gaussians.sh_degree))),
    ]
}

/// The coordinates and terms of an object's law, or the kinds of its potential and force.
fn dynamics(object: &ObjectModel) -> String {
    match &object.dynamics {
        Dynamics::Particles(ParticleDynamics { system, .. }) => {
            format!("particles with {:?}/{:?}", system.config.potential, system.config.force)
        }
        Dynamics::Generalised(GeneralisedDynamics { law, .. }) => {
            let terms: Vec<&str> = law.terms.iter().map(|term| term.kind.name()).collect();
            let contact = law.contact.as_ref().map_or_else(String::new, |contact| {
                let planes = match contact.planes().count() {
                    1 => "a plane".to_owned(),
                    count => format!("{count} planes"),
                };
                format!(
                    ", contact with {planes} (restitution {:.2}, friction {:.2}, {} impacts)",
                    contact.restitution,
                    contact.friction,
                    law.impacts.len()
                )
            });
            format!("{} with {}{contact}", law.coordinates.name(), terms.join(" + "))
        }
    }
}

/// Size of an object's supports and what becomes of its velocities.
fn alignment(object: &ObjectModel) -> String {
    let aligned = object.dynamics.particles().and_then(|p| Some((p.supports.as_ref()?, p.velocity_policy)));
    match aligned {
        Some((supports, policy)) => format!("supports of {}, velocities {policy:?}", supports.k()),
        None => "off".to_owned(),
    }
}
