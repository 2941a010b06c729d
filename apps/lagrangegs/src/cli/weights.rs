//! `lagrangegs weights`: the networks of LPIPS, which users import once.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Subcommand;
use lgs_eval::lpips::Perceptual;
use lgs_eval::lpips::store::{Origin, WeightKind, WeightStore};
use lgs_eval::table::aligned;
use lgs_train::device::Device;
use serde_json::json;

use super::failure::At;
use super::{output, progress};

/// Environment variable that names the folder of weights.
const FOLDER_VARIABLE: &str = "LAGRANGEGS_WEIGHTS";

/// Digits of a hash that a table shows.
const SHOWN_DIGITS: usize = 16;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Import PyTorch checkpoints: torchvision's VGG-16 or AlexNet, LPIPS 0.1 linear weights (vgg.pth,
    /// alex.pth)
    Import {
        /// The files, in any order
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Say what has been imported
    List {
        /// Print one JSON document instead of a table
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn run(args: &Args) -> Result<()> {
    let store =
        store().context("there is no home folder; name a folder for weights in LAGRANGEGS_WEIGHTS")?;
    match &args.action {
        Action::Import { files } => {
            let import = |path: &PathBuf| store.import(path).at(path);
            let origins = files.iter().map(import).collect::<Result<Vec<_>>>()?;
            for origin in origins.iter().filter(|origin| origin.published.is_none()) {
                progress::say(&format!(
                    "note: {} is no published file: its figures compare only with figures of the same hash",
                    origin.file
                ));
            }
            output::print(&aligned(
                &origins.iter().map(|origin| row(origin.kind, Some(origin))).collect::<Vec<_>>(),
                &[false; 4],
            ))
        }
        Action::List { json: true } => list_as_json(&store),
        Action::List { json: false } => list(&store),
    }
}

/// The weights of every kind that have been imported.
fn stored(store: &WeightStore) -> Result<Vec<(WeightKind, Option<Origin>)>> {
    let load =
        |kind: WeightKind| Ok((kind, store.load(kind).at(store.folder())?.map(|weights| weights.origin)));
    WeightKind::ALL.into_iter().map(load).collect()
}

fn list_as_json(store: &WeightStore) -> Result<()> {
    let stored = stored(store)?;
    let files: serde_json::Map<_, _> =
        stored.iter().map(|(kind, origin)| (kind.name().to_owned(), json!(origin))).collect();
    output::print_json(&json!({ "folder": store.folder(), "files": files }))
}

fn list(store: &WeightStore) -> Result<()> {
    let stored = stored(store)?;
    let rows: Vec<Vec<String>> = stored.iter().map(|(kind, origin)| row(*kind, origin.as_ref())).collect();
    output::print(&format!("{}\n{}", store.folder().display(), aligned(&rows, &[false; 4])))
}

fn row(kind: WeightKind, origin: Option<&Origin>) -> Vec<String> {
    let Some(origin) = origin else {
        let wanted: Vec<&str> = kind.published().iter().map(|(_, name)| *name).collect();
        return vec![
            kind.name().to_owned(),
            "missing".to_owned(),
            format!("wanted: {}", wanted.join(" or ")),
        ];
    };
    vec![
        kind.name().to_owned(),
        format!("sha256 {}", &origin.sha256[..SHOWN_DIGITS.min(origin.sha256.len())]),
        origin.published.clone().unwrap_or_else(|| "unknown contents".to_owned()),
        origin.file.clone(),
    ]
}

/// The networks that have been imported, on a device; nothing without weights.
pub(super) fn perceptual(device: &Device) -> Result<Option<Perceptual>> {
    let Some(store) = store() else { return Ok(None) };
    let perceptual = Perceptual::load(&store, device).at(store.folder())?;
    Ok((!perceptual.is_empty()).then_some(perceptual))
}

/// The folder that the environment names, or one in the user's data folder.
fn store() -> Option<WeightStore> {
    let named = std::env::var_os(FOLDER_VARIABLE).filter(|name| !name.is_empty()).map(PathBuf::from);
    named.or_else(|| Some(dirs::data_dir()?.join("lagrangegs").join("weights"))).map(WeightStore::new)
}
