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
//!
//! [synthetic]                            # the scenes are made by `synth`; or [folders], see there
//! size = 160
//!
//! [variant.mine]
//! title = "half the neighbours"
//! settings = ["motion.alignment_neighbors=9"]
//!
//! [[override]]                           # in order, after the variant's settings
//! scenes = ["fan"]                       # left out: all; likewise methods, variants
//! settings = ["partition.clusters=2"]
//! ```

use std::collections::BTreeMap;
use std::path::Path;

use lgs_data::synth::{SynthOptions, scenes as synthetic_scenes};
use lgs_train::Preset;
use serde::Deserialize;

use crate::bundled::bundled_suites;
use crate::error::{SuiteError, listed};
use crate::methods::{Method, method, methods};
use crate::published::Published;
use crate::variants::{FULL, Variant, VariantTable, known_variants};

/// A checked suite.
#[derive(Clone, Debug, PartialEq)]
pub struct Suite {
    /// Name of its folder.
    pub name: String,
    /// Title of its report.
    pub title: String,
    /// Scenes by name, in order.
    pub scenes: Vec<String>,
    /// Where the scenes come from.
    pub data: Scenes,
    /// Source models, in order.
    pub methods: Vec<Method>,
    /// `full`, then the others in order.
    pub variants: Vec<Variant>,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Defaults of every cell.
    pub preset: Preset,
    /// The paper's column that the tables stand beside, if this is its suite.
    pub published: Option<Published>,
    /// The file, for messages.
    pub origin: String,
    settings: Vec<String>,
    overrides: Vec<Override>,
}

/// Where a suite's scenes come from.
#[derive(Clone, Debug, PartialEq)]
pub enum Scenes {
    /// Made from the catalogue of synthetic scenes.
    Synthetic(SynthOptions),
    /// Datasets in the D-NeRF layout, one folder each.
    Folders(Folders),
}

/// Datasets on disk.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Folders {
    /// Folder that holds one folder per scene, if none is given at the command line; relative to where the program is called.
    pub path: String,
    /// What the folder should hold, for the message that it is absent.
    pub about: String,
}

/// Settings of some cells.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Override {
    scenes: Vec<String>,
    methods: Vec<String>,
    variants: Vec<String>,
    settings: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    title: String,
    scenes: Vec<String>,
    methods: Vec<String>,
    #[serde(default)]
    variants: Vec<String>,
    seeds: Vec<u64>,
    #[serde(default)]
    preset: Preset,
    #[serde(default)]
    settings: Vec<String>,
    synthetic: Option<Synthetic>,
    folders: Option<Folders>,
    published: Option<Published>,
    #[serde(default)]
    variant: BTreeMap<String, OwnVariant>,
    #[serde(default, rename = "override")]
    overrides: Vec<Override>,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Synthetic {
    size: u32,
    views: usize,
    seed: u64,
    train_fps: u32,
}

impl Default for Synthetic {
    fn default() -> Self {
        let SynthOptions { size, views, seed, train_fps } = SynthOptions::default();
        Self { size, views, seed, train_fps }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OwnVariant {
    title: String,
    #[serde(default)]
    table: VariantTable,
    settings: Vec<String>,
    #[serde(default)]
    remark: String,
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
        let text = read.map_err(|reason| SuiteError::Read { path: name_or_path.to_owned(), reason, known: known() })?;
        Self::parse(&text, &name_or_path.display().to_string())
    }

    /// Reads a suite; `origin` is what messages call it.
    ///
    /// # Errors
    /// If it is not TOML, a key or name is unknown (the error lists the known ones), a list is empty or repeats itself.
    pub fn parse(text: &str, origin: &str) -> Result<Self, SuiteError> {
        let file: File =
            toml::from_str(text).map_err(|e| SuiteError::Syntax { origin: origin.to_owned(), reason: e.message().to_owned() })?;
        let check = Check { origin };
        check.name(&file.name)?;
        check.list("scenes", &file.scenes)?;
        check.list("methods", &file.methods)?;
        check.list("variants", &file.variants)?;
        check.list("seeds", &file.seeds.iter().map(u64::to_string).collect::<Vec<_>>())?;
        for (key, empty) in [("scenes", file.scenes.is_empty()), ("methods", file.methods.is_empty()), ("seeds", file.seeds.is_empty())] {
            if empty {
                return Err(check.invalid(key, "the list is empty"));
            }
        }
        let data = match (file.synthetic, file.folders) {
            (Some(made), None) => {
                let known: Vec<&str> = synthetic_scenes().iter().map(|scene| scene.name).collect();
                check.all_known("scene", &file.scenes, &known)?;
                let Synthetic { size, views, seed, train_fps } = made;
                Scenes::Synthetic(SynthOptions { size, views, seed, train_fps })
            }
            (None, Some(folders)) => Scenes::Folders(folders),
            _ => return Err(check.invalid("scenes", "expected either a table [synthetic] or a table [folders]")),
        };
        let methods = check.methods(&file.methods)?;
        let variants = check.variants(&file.variants, file.variant)?;
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
            published: file.published,
            origin: origin.to_owned(),
            settings: file.settings,
            overrides: file.overrides,
        })
    }

    /// The settings of a cell beside its seed, later ones winning.
    pub(crate) fn settings_of(&self, scene: &str, method: &Method, variant: &Variant) -> Vec<String> {
        let mut settings: Vec<String> = method.settings.iter().map(|s| (*s).to_owned()).collect();
        settings.extend_from_slice(&self.settings);
        settings.extend_from_slice(&variant.settings);
        settings.extend(variant.of_method.iter().filter(|(name, _)| *name == method.name).map(|(_, setting)| (*setting).to_owned()));
        let concerns = |names: &[String], name: &str| names.is_empty() || names.iter().any(|n| n == name);
        let own = self
            .overrides
            .iter()
            .filter(|o| concerns(&o.scenes, scene) && concerns(&o.methods, method.name) && concerns(&o.variants, &variant.name));
        settings.extend(own.flat_map(|o| o.settings.iter().cloned()));
        settings
    }
}

/// Checks of a file.
struct Check<'a> {
    origin: &'a str,
}

impl Check<'_> {
    fn invalid(&self, key: &'static str, reason: impl Into<String>) -> SuiteError {
        SuiteError::Invalid { key, reason: reason.into(), origin: self.origin.to_owned() }
    }

    /// Names become folders.
    fn name(&self, name: &str) -> Result<(), SuiteError> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        let fine = name.chars().all(plain) && name.starts_with(|c: char| c.is_ascii_alphanumeric());
        if fine { Ok(()) } else { Err(self.invalid("name", format!("`{name}` should consist of letters, digits, `-`, `_` and `.`"))) }
    }

    fn list(&self, key: &'static str, names: &[String]) -> Result<(), SuiteError> {
        for (i, name) in names.iter().enumerate() {
            self.name(name)?;
            if names[..i].contains(name) {
                return Err(self.invalid(key, format!("`{name}` is there twice")));
            }
        }
        Ok(())
    }

    fn all_known(&self, what: &'static str, names: &[String], known: &[&str]) -> Result<(), SuiteError> {
        match names.iter().find(|name| !known.contains(&name.as_str())) {
            None => Ok(()),
            Some(name) => {
                let known = listed(known.iter().copied());
                Err(SuiteError::Unknown { what, name: name.clone(), known, origin: self.origin.to_owned() })
            }
        }
    }

    fn methods(&self, names: &[String]) -> Result<Vec<Method>, SuiteError> {
        self.all_known("method", names, &methods().iter().map(|method| method.name).collect::<Vec<_>>())?;
        Ok(names.iter().filter_map(|name| method(name)).collect())
    }

    /// `full` and the variants named, by the file's own definitions first.
    fn variants(&self, names: &[String], own: BTreeMap<String, OwnVariant>) -> Result<Vec<Variant>, SuiteError> {
        let mut known = known_variants();
        for (name, own) in own {
            self.name(&name)?;
            if name == FULL {
                return Err(self.invalid("variant", "`full` is the variant that changes nothing"));
            }
            known.retain(|variant| variant.name != name);
            let OwnVariant { title, table, settings, remark } = own;
            known.push(Variant { name, title, table, settings, of_method: Vec::new(), remark });
        }
        self.all_known("variant", names, &known.iter().map(|v| v.name.as_str()).collect::<Vec<_>>())?;
        let first = [FULL.to_owned()];
        let wanted = first.iter().chain(names.iter().filter(|name| *name != FULL));
        Ok(wanted.filter_map(|name| known.iter().find(|variant| variant.name == *name).cloned()).collect())
    }

    fn overrides(&self, overrides: &[Override], scenes: &[String], methods: &[String], variants: &[Variant]) -> Result<(), SuiteError> {
        fn strs(names: &[String]) -> Vec<&str> {
            names.iter().map(String::as_str).collect()
        }
        let variants: Vec<&str> = variants.iter().map(|v| v.name.as_str()).collect();
        for o in overrides {
            self.all_known("scene", &o.scenes, &strs(scenes))?;
            self.all_known("method", &o.methods, &strs(methods))?;
            self.all_known("variant", &o.variants, &variants)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "name = \"s\"\ntitle = \"S\"\nscenes = [\"fan\", \"spring\"]\nmethods = [\"defgs\"]\nvariants = [\"before-0.5\", \"mine\"]\n\
        seeds = [0, 1]\n[synthetic]\nsize = 40\n[variant.mine]\ntitle = \"mine\"\nsettings = [\"last_stage=1\"]\n[[override]]\n\
        scenes = [\"fan\"]\nsettings = [\"partition.clusters=2\"]\n";

    #[test]
    fn a_suite_has_full_first_and_overrides_only_where_they_say() {
        let suite = Suite::parse(GOOD, "s.toml").expect("suite");
        assert_eq!(suite.variants.iter().map(|v| v.name.as_str()).collect::<Vec<_>>(), ["full", "before-0.5", "mine"]);
        let of = |scene: &str| suite.settings_of(scene, &suite.methods[0], &suite.variants[2]);
        assert_eq!(of("fan"), ["last_stage=1", "partition.clusters=2"]);
        assert_eq!(of("spring"), ["last_stage=1"]);
        assert!(matches!(&suite.data, Scenes::Synthetic(options) if options.size == 40 && options.views == 12));
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
            assert!(words.iter().all(|word| error.contains(word)) && error.ends_with("s.toml"), "{to}: {error}");
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
