//! `lagrangegs info`: looks at what a path is, reads all of it, and reports what it holds. A defect is an
//! error like everywhere else.

mod dataset;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use lgs_core::GaussianCloud;
use lgs_data::dataset::DatasetFormat;
use lgs_data::ply::read_ply;
use lgs_data::synth::GroundTruth;
use lgs_eval::table::aligned;
use lgs_model::source::load_source;
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, ObjectModel, ParticleDynamics, load_scene};
use lgs_train::checkpoint::read_checkpoint;
use serde_json::{Map, Value, json};

use super::failure::At;
use super::output;
use super::run::{Run, dataset_format};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Dataset, run, checkpoint, model or splat file
    path: PathBuf,
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

/// Facts in the order they are printed.
type Facts = Vec<(&'static str, Value)>;

pub(super) fn run(args: &Args) -> Result<()> {
    let facts = describe(args)?;
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

fn describe(args: &Args) -> Result<Facts> {
    let path = args.path.as_path();
    if !path.exists() {
        bail!("there is no such file or folder: {}", path.display());
    }
    if path.is_dir() {
        let format = args.format.or_else(|| DatasetFormat::detect(path));
        return if let Some(format) = format {
            dataset::facts(args, format)
        } else if path.join("config.toml").exists() {
            run_folder(path)
        } else {
            bail!("the folder is neither a dataset nor a run (config.toml): {}", path.display())
        };
    }
    match path.extension().and_then(|e| e.to_str()).unwrap_or_default() {
        "ply" => Ok(cloud("splat file", &read_ply(path).at(path)?)),
        "safetensors" => tensors(path),
        _ => bail!("expected a .ply or .safetensors file, a dataset or a run: {}", path.display()),
    }
}

/// Every different text once, sorted.
fn distinct(texts: impl Iterator<Item = String>) -> Vec<String> {
    texts.collect::<std::collections::BTreeSet<_>>().into_iter().collect()
}

fn run_folder(path: &Path) -> Result<Facts> {
    let run = Run::open(path)?;
    let mut facts =
        vec![("kind", json!("run")), ("preset", json!(run.config.preset)), ("seed", json!(run.config.seed))];
    if let Ok(Some(dataset)) = run.dataset_path(None) {
        facts.push(("dataset", json!(dataset)));
    }
    if let Some(secs) = run.cost().train_secs {
        facts.push(("training", json!(format!("{secs:.0} s"))));
    }
    facts.push((
        "source model",
        json!(
            run.source()?
                .map_or_else(|| "none".to_owned(), |s| format!("{}, {} Gaussians", s.kind().name(), s.len()))
        ),
    ));
    facts.extend(scene(&run.scene));
    Ok(facts)
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
                format!(
                    ", contact with a plane (restitution {:.2}, friction {:.2}, {} impacts)",
                    contact.restitution,
                    contact.friction,
                    law.events.len()
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

fn cloud(kind: &str, cloud: &GaussianCloud) -> Facts {
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
