//! A suite file: parsed, with every name in it checked.
//!
//! ```toml
//! name = "my-suite"                      # folder below `runs`, and first word of the tables
//! title = "Two objects"
//! scenes = ["fan", "spring"]
//! methods = ["defgs"]
//! variants = ["before-0.5", "mine"]      # beside `full`
//! seeds = [0, 1]
//! preset = "quick"
//! settings = ["source.sh_degree=2"]      # of every cell
//! half_resolution = false                # compare images at half their size
//!
//! [synthetic]                            # the scenes are made by `synth`; or [folders], see there
//! size = 160
//! laws_by_seed = false                   # whether a cell's seed is the scene's too, which draws its law
//!
//! [variant.mine]
//! title = "half the neighbours"
//! settings = ["motion.alignment_neighbors=9"]
//!
//! [[override]]                           # in order, before the variant's; after it if it names one
//! scenes = ["fan"]                       # left out: all; likewise methods, variants
//! settings = ["partition.clusters=2"]
//!
//! [field]                                # left out: no table beside other people's figures
//! protocol = "400², white, test"         # of ours
//! split = "test"
//! splits = { fan = "val" }               # of scenes that are measured on another one
//!
//! [[field.quoted]]
//! method = "NeRF"
//! protocol = "800², white, test"
//! psnr = { fan = 30.1 }
//! ```

use std::path::Path;

use lgs_data::synth::SynthOptions;
use lgs_train::Preset;

use crate::bundled::bundled_suites;
use crate::error::{SuiteError, listed};
use crate::field::Field;
use crate::methods::Method;
use crate::published::Published;
use crate::scenes::Scenes;
use crate::suite_check::Check;
use crate::suite_file::{File, Override};
use crate::variants::Variant;

/// A checked suite.
#[derive(Clone, Debug, PartialEq)]
pub struct Suite {
    /// Name of its folder.
    pub name: String,
    /// Title of its report.
    pub title: String,
    /// Scenes by name, in order.
    pub scenes: Vec<String>,
    /// The origin of the scenes.
    pub data: Scenes,
    /// Source models, in order.
    pub methods: Vec<Method>,
    /// `full`, then the others in order.
    pub variants: Vec<Variant>,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Defaults of every cell.
    pub preset: Preset,
    /// Whether images are compared at half their size, as the published figures of single objects.
    pub half_resolution: bool,
    /// The paper's column that the tables stand beside, if this is its suite.
    pub published: Option<Published>,
    /// Other people's figures, if tables stand beside these.
    pub field: Option<Field>,
    /// The file, for messages.
    pub origin: String,
    laws_by_seed: bool,
    settings: Vec<String>,
    overrides: Vec<Override>,
}

impl Suite {
    /// A bundled suite by name, or else a suite file.
    ///
    /// # Errors
    /// If there is neither, or as [`Self::parse`].
    pub fn open(name_or_path: &Path) -> Result<Self, SuiteError> {
        if let Some(bundled) = bundled_suites().iter().find(|suite| Path::new(suite.name) == name_or_path) {
            return Self::parse(bundled.text, &format!("bundled suite {}", bundled.name));
        }
        let known = || listed(bundled_suites().iter().map(|suite| suite.name));
        let read = std::fs::read_to_string(name_or_path);
        let text = read.map_err(|reason| SuiteError::Read {
            path: name_or_path.to_owned(),
            reason,
            known: known(),
        })?;
        Self::parse(&text, &name_or_path.display().to_string())
    }

    /// Reads a suite; `origin` is what messages call it.
    ///
    /// # Errors
    /// If it is not TOML, a key or name is unknown (the error lists the known ones), a list is empty or
    /// repeats itself.
    pub fn parse(text: &str, origin: &str) -> Result<Self, SuiteError> {
        let file: File = toml::from_str(text)
            .map_err(|e| SuiteError::Syntax { origin: origin.to_owned(), reason: e.message().to_owned() })?;
        let check = Check { origin };
        let laws_by_seed = file.synthetic.as_ref().is_some_and(|made| made.laws_by_seed);
        check.lists(&file)?;
        let data = check.data(file.synthetic, file.folders, &file.scenes)?;
        let methods = check.methods(&file.methods)?;
        let variants = check.variants(&file.variants, file.variant)?;
        let named = file.field.as_ref().map(Field::scenes).unwrap_or_default();
        check.all_known("scene", &named, &file.scenes.iter().map(String::as_str).collect::<Vec<_>>())?;
        check.overrides(&file.overrides, &file.scenes, &file.methods, &variants)?;
        Ok(Self {
            name: file.name,
            title: file.title,
            scenes: file.scenes,
            data,
            methods,
            variants,
            seeds: file.seeds,
            preset: file.preset,
            half_resolution: file.half_resolution,
            published: file.published,
            field: file.field,
            origin: origin.to_owned(),
            laws_by_seed,
            settings: file.settings,
            overrides: file.overrides,
        })
    }

    /// How the scenes of a seed are made; nothing where they come from folders.
    #[must_use]
    pub fn synthetic(&self, seed: u64) -> Option<SynthOptions> {
        match &self.data {
            Scenes::Synthetic(options) if self.laws_by_seed => Some(SynthOptions { seed, ..options.clone() }),
            Scenes::Synthetic(options) => Some(options.clone()),
            Scenes::Folders(_) => None,
        }
    }

    /// The settings of a cell beside its seed, later ones winning.
    pub(crate) fn settings_of(&self, scene: &str, method: &Method, variant: &Variant) -> Vec<String> {
        let mut settings: Vec<String> = method.settings.iter().map(|s| (*s).to_owned()).collect();
        settings.extend_from_slice(&self.settings);
        let concerns = |names: &[String], name: &str| names.is_empty() || names.iter().any(|n| n == name);
        let here = |o: &&Override| {
            concerns(&o.scenes, scene)
                && concerns(&o.methods, method.name)
                && concerns(&o.variants, &variant.name)
        };
        let (of_variants, general): (Vec<&Override>, Vec<&Override>) =
            self.overrides.iter().filter(here).partition(|o| !o.variants.is_empty());
        settings.extend(general.iter().flat_map(|o| o.settings.iter().cloned()));
        settings.extend_from_slice(&variant.settings);
        settings.extend(
            variant
                .of_method
                .iter()
                .filter(|(name, _)| *name == method.name)
                .map(|(_, setting)| (*setting).to_owned()),
        );
        settings.extend(of_variants.iter().flat_map(|o| o.settings.iter().cloned()));
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "name = \"s\"\ntitle = \"S\"\nscenes = [\"fan\", \"spring\"]\nmethods = \
        [\"defgs\"]\nvariants = [\"before-0.5\", \"mine\"]\n\
        seeds = [0, 1]\n[synthetic]\nsize = 40\n[variant.mine]\ntitle = \"mine\"\nsettings = \
        [\"last_stage=1\"]\n[[override]]\n\
        scenes = [\"fan\"]\nsettings = [\"partition.clusters=2\"]\n";

    #[test]
    fn a_suite_has_full_first_and_overrides_only_where_they_say() {
        let suite = Suite::parse(GOOD, "s.toml").expect("suite");
        assert_eq!(
            suite.variants.iter().map(|v| v.name.as_str()).collect::<Vec<_>>(),
            ["full", "before-0.5", "mine"]
        );
        let of = |scene: &str| suite.settings_of(scene, &suite.methods[0], &suite.variants[2]);
        assert_eq!(of("fan"), ["source.kind=defgs", "partition.clusters=2", "last_stage=1"]);
        assert_eq!(of("spring"), ["source.kind=defgs", "last_stage=1"]);
        assert!(
            matches!(&suite.data, Scenes::Synthetic(options) if options.size == 40 && options.views == 12)
        );
    }

    #[test]
    fn every_mistake_is_named_with_what_is_known() {
        for (from, to, words) in [
            ("[\"fan\", \"spring\"]", "[\"fan\", \"sprung\"]", ["unknown scene `sprung`", "`spring`"]),
            ("[\"defgs\"]", "[\"degfs\"]", ["unknown method `degfs`", "`defgs`"]),
            ("\"before-0.5\"", "\"before-0.7\"", ["unknown variant `before-0.7`", "`before-0.3`"]),
            ("seeds", "seed", ["unknown field `seed`", "`seeds`"]),
            ("size = 40", "sizes = 40", ["unknown field `sizes`", "`size`"]),
            ("seeds = [0, 1]", "seeds = []", ["`seeds`", "empty"]),
            ("seeds = [0, 1]", "seeds = [0, 0]", ["`seeds`", "twice"]),
            ("seeds = [0, 1]", "seeds = 1", ["sequence", "s.toml"]),
            ("name = \"s\"", "name = \"../s\"", ["`name`", "../s"]),
            ("scenes = [\"fan\"]\n", "scenes = [\"bat\"]\n", ["unknown scene `bat`", "`fan`"]),
            ("[synthetic]\nsize = 40", "", ["[synthetic]", "[folders]"]),
            ("title = \"S\"", "title = ", ["s.toml", ""]),
        ] {
            let text = GOOD.replace(from, to);
            assert_ne!(text, GOOD, "{from}");
            let error = Suite::parse(&text, "s.toml").expect_err(to).to_string();
            assert!(
                words.iter().all(|word| error.contains(word)) && error.ends_with("s.toml"),
                "{to}: {error}"
            );
        }
    }

    #[test]
    fn bundled_suites_open_by_name_and_others_are_named() {
        for bundled in bundled_suites() {
            let suite = Suite::open(Path::new(bundled.name)).expect(bundled.name);
            assert_eq!(suite.name, bundled.name);
        }
        let error = Suite::open(Path::new("nothing")).expect_err("absent").to_string();
        assert!(error.contains("`nvfi-objects`") && error.ends_with("nothing"), "{error}");
    }
}
