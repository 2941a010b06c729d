//! Checks of a suite file: every name in it must exist, and be fit for a folder.

use std::collections::BTreeMap;

use lgs_data::synth;

use crate::error::{SuiteError, listed};
use crate::methods::{Method, method, methods};
use crate::scenes::{Folders, Scenes};
use crate::suite_file::{File, Override, OwnVariant, Synthetic};
use crate::variants::{FULL, Variant, known_variants};

/// Checks of a file.
pub(crate) struct Check<'a> {
    /// Name of the file in messages.
    pub(crate) origin: &'a str,
}

impl Check<'_> {
    pub(crate) fn invalid(&self, key: &'static str, reason: impl Into<String>) -> SuiteError {
        SuiteError::Invalid { key, reason: reason.into(), origin: self.origin.to_owned() }
    }

    /// Names become folders.
    pub(crate) fn name(&self, name: &str) -> Result<(), SuiteError> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        let fine = name.chars().all(plain) && name.starts_with(|c: char| c.is_ascii_alphanumeric());
        if fine {
            Ok(())
        } else {
            Err(self.invalid("name", format!("`{name}` should consist of letters, digits, `-`, `_` and `.`")))
        }
    }

    /// The lists of a file repeat nothing, and those that a suite needs are not empty.
    pub(crate) fn lists(&self, file: &File) -> Result<(), SuiteError> {
        self.name(&file.name)?;
        self.list("scenes", &file.scenes)?;
        self.list("methods", &file.methods)?;
        self.list("variants", &file.variants)?;
        self.list("seeds", &file.seeds.iter().map(u64::to_string).collect::<Vec<_>>())?;
        let needed = [
            ("scenes", file.scenes.is_empty()),
            ("methods", file.methods.is_empty()),
            ("seeds", file.seeds.is_empty()),
        ];
        match needed.into_iter().find(|&(_, empty)| empty) {
            Some((key, _)) => Err(self.invalid(key, "the list is empty")),
            None => Ok(()),
        }
    }

    /// Where the scenes come from: exactly one of the two tables must be there.
    pub(crate) fn data(
        &self,
        made: Option<Synthetic>,
        folders: Option<Folders>,
        scenes: &[String],
    ) -> Result<Scenes, SuiteError> {
        match (made, folders) {
            (Some(made), None) => {
                let known: Vec<&str> = synth::scenes().iter().map(|scene| scene.name).collect();
                self.all_known("scene", scenes, &known)?;
                Ok(Scenes::Synthetic(made.into()))
            }
            (None, Some(folders)) => Ok(Scenes::Folders(folders)),
            _ => Err(self.invalid("scenes", "expected either a table [synthetic] or a table [folders]")),
        }
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

    pub(crate) fn all_known(
        &self,
        what: &'static str,
        names: &[String],
        known: &[&str],
    ) -> Result<(), SuiteError> {
        match names.iter().find(|name| !known.contains(&name.as_str())) {
            None => Ok(()),
            Some(name) => {
                let known = listed(known.iter().copied());
                Err(SuiteError::Unknown { what, name: name.clone(), known, origin: self.origin.to_owned() })
            }
        }
    }

    pub(crate) fn methods(&self, names: &[String]) -> Result<Vec<Method>, SuiteError> {
        self.all_known("method", names, &methods().iter().map(|method| method.name).collect::<Vec<_>>())?;
        Ok(names.iter().filter_map(|name| method(name)).collect())
    }

    /// `full` and the variants named, by the file's own definitions first.
    pub(crate) fn variants(
        &self,
        names: &[String],
        own: BTreeMap<String, OwnVariant>,
    ) -> Result<Vec<Variant>, SuiteError> {
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

    pub(crate) fn overrides(
        &self,
        overrides: &[Override],
        scenes: &[String],
        methods: &[String],
        variants: &[Variant],
    ) -> Result<(), SuiteError> {
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
