//! The cells of a suite: one run each, in a stable order, with configuration, folder and where its source
//! comes from.
//!
//! Cells that train a source come first, in the order variant, seed, scene, method; the others follow in the
//! same order. Two cells share a source if scene, seed and all settings of images and source are the same;
//! the first of them trains it. A scheduler runs the cells that train a source ([`Plan::leaders`]) in any
//! order, and after them the others in any order.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lgs_data::synth::SynthOptions;
use lgs_train::TrainConfig;
use lgs_train::config::DataConfig;
use lgs_train::source::SourceConfig;
use serde::Serialize;

use crate::error::SuiteError;
use crate::scenes::{Folders, Scenes};
use crate::suite::Suite;

/// One run of a suite.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Its number.
    pub index: usize,
    /// Scene.
    pub scene: String,
    /// Source model, by name.
    pub method: String,
    /// Variant, by name.
    pub variant: String,
    /// Seed of training.
    pub seed: u64,
    /// Everything that the run depends on beside the dataset.
    pub config: TrainConfig,
    /// The cell whose source it continues from; nothing if it trains its own.
    pub source_of: Option<usize>,
}

impl Cell {
    /// Scene, method, variant and seed as a relative path: the same in every version of the suite.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}/{}/{}/seed-{}", self.scene, self.method, self.variant, self.seed)
    }
}

/// The cells of a suite and where they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The suite.
    pub suite: Suite,
    /// Its cells by number.
    pub cells: Vec<Cell>,
    out: PathBuf,
    data: Option<PathBuf>,
}

/// All that a source depends on beside the scene.
#[derive(Serialize)]
struct SourceKey<'a> {
    seed: u64,
    data: &'a DataConfig,
    source: &'a SourceConfig,
}

impl Plan {
    /// The cells of a suite, with runs below the folder `out` and datasets below `data` (by default what the
    /// suite says).
    ///
    /// # Errors
    /// If the settings of a cell are no configuration; the error names cell and key.
    pub fn new(suite: Suite, out: &Path, data: Option<&Path>) -> Result<Self, SuiteError> {
        let mut cells = Vec::new();
        for variant in &suite.variants {
            for &seed in &suite.seeds {
                for scene in &suite.scenes {
                    for method in &suite.methods {
                        let mut settings = suite.settings_of(scene, method, variant);
                        settings.push(format!("seed={seed}"));
                        let at = |reason| SuiteError::Settings {
                            cell: format!("{scene}/{}/{}", method.name, variant.name),
                            reason,
                            origin: suite.origin.clone(),
                        };
                        let config = TrainConfig::resolve(suite.preset, None, &settings).map_err(at)?;
                        let (scene, method, variant) =
                            (scene.clone(), method.name.to_owned(), variant.name.clone());
                        cells.push(Cell { index: 0, scene, method, variant, seed, config, source_of: None });
                    }
                }
            }
        }
        Ok(Self { suite, cells: numbered(cells), out: out.to_owned(), data: data.map(Path::to_owned) })
    }

    /// Number of cells that train a source; they come first.
    #[must_use]
    pub fn leaders(&self) -> usize {
        self.cells.iter().filter(|cell| cell.source_of.is_none()).count()
    }

    /// A cell by number.
    ///
    /// # Errors
    /// If there is none.
    pub fn cell(&self, index: usize) -> Result<&Cell, SuiteError> {
        let last = self.cells.len().saturating_sub(1);
        self.cells.get(index).ok_or_else(|| SuiteError::NoCell {
            index,
            last,
            origin: self.suite.origin.clone(),
        })
    }

    /// The suite's output folder.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.out
    }

    /// The run folder of a cell.
    #[must_use]
    pub fn run_folder(&self, cell: &Cell) -> PathBuf {
        self.out.join("cells").join(cell.name())
    }

    /// The folder of the tables.
    #[must_use]
    pub fn tables_folder(&self) -> PathBuf {
        self.out.join("tables")
    }

    /// The dataset of a cell. Synthetic ones carry their options in the name, so that other options are
    /// another dataset.
    #[must_use]
    pub fn dataset(&self, cell: &Cell) -> PathBuf {
        let scene = &cell.scene;
        match (&self.suite.data, self.suite.synthetic(cell.seed)) {
            (Scenes::Folders(folders), _) => self.folders_root(folders).join(scene),
            (_, made) => {
                let SynthOptions { size, views, seed, train_fps, .. } = made.unwrap_or_default();
                let folder = format!("{scene}_{size}px_{views}views_{train_fps}fps_seed{seed}");
                self.data.as_ref().map_or_else(|| self.out.join("data"), Clone::clone).join(folder)
            }
        }
    }

    /// A message that names the scenes' folders that the suite needs and that are absent; nothing if there
    /// are none. Synthetic scenes are never missing.
    #[must_use]
    pub fn missing_data(&self) -> Option<String> {
        let Scenes::Folders(folders) = &self.suite.data else { return None };
        let root = self.folders_root(folders);
        let absent: Vec<&str> =
            self.suite.scenes.iter().filter(|s| !root.join(s).is_dir()).map(String::as_str).collect();
        let wanted = || {
            let names = self.suite.scenes.join(", ");
            format!(
                "the suite `{}` needs {}: one folder per scene ({names}), each with transforms_train.json, \
                    transforms_val.json and \
                 transforms_test.json; absent: {}; name the folder that holds them with --data: {}",
                self.suite.name,
                folders.about,
                absent.join(", "),
                root.display()
            )
        };
        (!absent.is_empty()).then(wanted)
    }

    fn folders_root(&self, folders: &Folders) -> PathBuf {
        self.data.clone().unwrap_or_else(|| PathBuf::from(&folders.path))
    }
}

/// Cells that train a source first, every cell with its number and its source's.
fn numbered(cells: Vec<Cell>) -> Vec<Cell> {
    let key = |cell: &Cell| {
        let TrainConfig { seed, data, source, .. } = &cell.config;
        // A configuration always has a TOML form (tested where it is defined); without one, cells would share
        // nothing.
        let text = toml::to_string(&SourceKey { seed: *seed, data, source }).unwrap_or_else(|_| cell.name());
        (cell.scene.clone(), text)
    };
    let mut first: BTreeMap<(String, String), usize> = BTreeMap::new();
    let (mut leaders, mut followers) = (Vec::new(), Vec::new());
    for cell in cells {
        match first.get(&key(&cell)) {
            Some(&leader) => followers.push(Cell { source_of: Some(leader), ..cell }),
            None => {
                first.insert(key(&cell), leaders.len());
                leaders.push(cell);
            }
        }
    }
    let ordered = leaders.into_iter().chain(followers);
    ordered.enumerate().map(|(index, cell)| Cell { index, ..cell }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled::bundled_suites;

    const SUITE: &str = "name = \"s\"\ntitle = \"S\"\nscenes = [\"fan\", \"spring\"]\nmethods = [\"defgs\"]\n\
        variants = [\"without-stage-3\", \"before-0.5\", \"without-force\"]\nseeds = [0, 7]\n[synthetic]\n";

    fn plan(text: &str) -> Result<Plan, SuiteError> {
        Plan::new(Suite::parse(text, "s.toml").expect("suite"), Path::new("out"), None)
    }

    #[test]
    fn cells_that_train_a_source_come_first_and_lend_it() {
        let plan = plan(SUITE).expect("plan");
        let names: Vec<String> = plan.cells.iter().map(Cell::name).collect();
        assert_eq!((names.len(), plan.leaders()), (16, 8));
        assert_eq!(names[0], "fan/defgs/full/seed-0");
        assert_eq!(names[1], "spring/defgs/full/seed-0");
        assert_eq!(names[2], "fan/defgs/full/seed-7");
        assert_eq!(names[4], "fan/defgs/before-0.5/seed-0");
        assert_eq!(names[8], "fan/defgs/without-stage-3/seed-0");
        for (index, cell) in plan.cells.iter().enumerate() {
            assert_eq!((cell.index, cell.config.seed), (index, cell.seed));
            let Some(leader) = cell.source_of.map(|leader| &plan.cells[leader]) else { continue };
            assert_eq!((&leader.scene, leader.seed, leader.source_of), (&cell.scene, cell.seed, None));
            assert_eq!(
                (&leader.config.source, &leader.config.data),
                (&cell.config.source, &cell.config.data)
            );
        }
        assert_eq!(plan.run_folder(&plan.cells[0]), Path::new("out/cells/fan/defgs/full/seed-0"));
        assert!(plan.cell(16).expect_err("none").to_string().contains("0 to 15"));
    }

    #[test]
    fn published_suites_train_freegave_as_its_published_settings_say() {
        for name in ["nvfi-objects", "nvfi-indoor"] {
            let plan =
                Plan::new(Suite::open(Path::new(name)).expect(name), Path::new("out"), None).expect(name);
            for cell in plan.cells.iter().filter(|cell| cell.method == "freegave" && cell.seed == 0) {
                let file = Path::new(env!("CARGO_MANIFEST_DIR"))
                    .join(format!("../../configs/freegave/{}.toml", cell.scene));
                let mut source =
                    TrainConfig::resolve(plan.suite.preset, Some(&file), &[]).expect("settings").source;
                // A truncated window ends the deformation 0.05 before its end, as FreeGave trains it.
                let until = cell.config.data.train_before;
                if let Some(velocity) = source.velocity.as_mut().filter(|_| until > 0.0) {
                    velocity.max_time = ((until - 0.05) * 100.0).round() / 100.0;
                }
                assert_eq!(cell.config.source, source, "{}", cell.name());
            }
        }
    }

    #[test]
    fn the_manifest_for_kubernetes_counts_the_cells_of_its_suite() {
        let manifest = include_str!("../../../contrib/kubernetes/bench.yaml");
        let suite = Suite::open(Path::new("synthetic-objects")).expect("bundled");
        let plan = Plan::new(suite, Path::new("out"), None).expect("plan");
        let (sources, rest) = (plan.leaders(), plan.cells.len() - plan.leaders());
        for line in [
            format!("completions: {sources} "),
            format!("completions: {rest} "),
            format!("name: FIRST, value: \"{sources}\""),
        ] {
            assert_eq!(manifest.matches(&line).count(), 1, "{line}");
        }
    }

    #[test]
    fn a_setting_that_does_not_exist_names_the_cell_and_the_known_keys() {
        let text = SUITE.replace("seeds =", "settings = [\"source.iteration=3\"]\nseeds =");
        let error = plan(&text).expect_err("unknown").to_string();
        assert!(
            error.contains("fan/defgs/full")
                && error.contains("`source.iteration`")
                && error.contains("iterations"),
            "{error}"
        );
    }

    #[test]
    fn bundled_suites_are_whole_and_published_ones_say_what_they_want() {
        for bundled in bundled_suites() {
            let suite = Suite::open(Path::new(bundled.name)).expect(bundled.name);
            let published = suite.published.is_some() || suite.field.is_some();
            let varied = suite.variants.len() > 1;
            let plan = Plan::new(suite, Path::new("out"), Some(Path::new("nowhere"))).expect(bundled.name);
            assert_eq!(plan.leaders() < plan.cells.len(), varied, "ablations share sources");
            let missing = plan.missing_data();
            assert_eq!(missing.is_some(), published, "{}", bundled.name);
            assert!(
                missing.is_none_or(|text| text.contains("transforms_test.json") && text.ends_with("nowhere"))
            );
        }
    }
}
