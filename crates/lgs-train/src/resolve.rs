//! Resolution of a configuration: a preset, then a TOML file, then `key=value` overrides, merged as data and
//! checked key by key.
//!
//! The merge starts from the preset written out in full, so a key that is not there is a mistake, and so is a
//! value of another type; both errors name the dotted key. The resolved configuration is what `config.toml`
//! of a run holds.

use std::fmt::Display;
use std::path::Path;

use lgs_model::source::SourceKind;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::config::{ConfigError, LastStage, Preset, TrainConfig};
use crate::layers::{first_difference, merge, parse, set};

/// A setting of two values, as TOML.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The dotted key.
    pub key: String,
    /// The value in the one configuration.
    pub own: String,
    /// The value in the other.
    pub other: String,
}

impl TrainConfig {
    /// Merges a preset, an optional file and overrides such as `source.iterations=500`, and checks the
    /// result.
    ///
    /// # Errors
    /// If the file cannot be read or parsed, or a key or value is wrong; the error names the key.
    pub fn resolve(preset: Preset, file: Option<&Path>, overrides: &[String]) -> Result<Self, ConfigError> {
        Self::from_table(preset, given(file, overrides)?)
    }

    /// The first setting that results depend on and that a file or an override would change.
    ///
    /// # Errors
    /// If the file cannot be read or parsed, or there is no such key or type.
    pub fn changed_by(
        &self,
        file: Option<&Path>,
        overrides: &[String],
    ) -> Result<Option<Difference>, ConfigError> {
        let mut given = given(file, overrides)?;
        name_last_stage(&mut given)?;
        let own = self.table()?;
        let mut changed = own.clone();
        merge(&mut changed, &given, "")?;
        Ok(difference(own, changed))
    }

    /// The first setting that results depend on and that another configuration has another value of.
    ///
    /// # Errors
    /// Never in practice: every field has a TOML form (tested).
    pub fn first_difference(&self, other: &Self) -> Result<Option<Difference>, ConfigError> {
        Ok(difference(self.table()?, other.table()?))
    }

    fn table(&self) -> Result<Table, ConfigError> {
        Table::try_from(self).map_err(|e| invalid("configuration", &e))
    }

    /// Lays settings over the preset and the kinds of source and dynamics that they name, `preset` and its
    /// own kinds if they name none.
    pub(crate) fn from_table(preset: Preset, mut given: Table) -> Result<Self, ConfigError> {
        let whole = |e: &dyn Display| invalid("configuration", e);
        let preset =
            choice(given.get("preset"), "preset", "`quick`, `standard` or `paper`")?.unwrap_or(preset);
        let kind = given.get("source").and_then(|source| source.get("kind"));
        let kind = choice(kind, "source.kind", &known_kinds())?.unwrap_or_else(|| preset.source());
        let dynamics = given.get("distill").and_then(|distill| distill.get("dynamics"));
        let dynamics = choice(dynamics, "distill.dynamics", "`terms` or `networks`")?;
        let dynamics = dynamics.unwrap_or_else(|| preset.dynamics());
        name_last_stage(&mut given)?;
        let mut merged = Table::try_from(Self::of(preset, kind, dynamics)).map_err(|e| whole(&e))?;
        merge(&mut merged, &given, "")?;
        let config: Self =
            Value::Table(merged).try_into().map_err(|e: toml::de::Error| whole(&e.message()))?;
        config.validate()?;
        Ok(config)
    }

    fn validate(&self) -> Result<(), ConfigError> {
        below("source", self.source.validate())?;
        self.distill.validate().map_err(|e| invalid("distill", &e))?;
        below("partition", self.partition.validate())?;
        below("motion", self.motion.validate())?;
        below("refine_gaussians", self.refine_gaussians.validate())?;
        below("tune_dynamics", self.tune_dynamics.validate())?;
        below("tune_gaussians", self.tune_gaussians.validate())?;
        let train_before = self.data.train_before;
        if !(train_before >= 0.0 && train_before.is_finite()) {
            return Err(invalid("data.train_before", &format!("{train_before} is negative or not finite")));
        }
        let budget = self.time_budget_secs;
        if !(budget >= 0.0 && budget.is_finite()) {
            return Err(invalid("time_budget_secs", &format!("{budget} is negative or not finite")));
        }
        if self.checkpoint_secs == 0 {
            return Err(invalid("checkpoint_secs", &"0 is not an interval"));
        }
        Ok(())
    }
}

/// The settings of a file with overrides laid over them, unchecked.
fn given(file: Option<&Path>, overrides: &[String]) -> Result<Table, ConfigError> {
    let mut given = Table::new();
    if let Some(path) = file {
        let text = std::fs::read_to_string(path)
            .map_err(|reason| ConfigError::Read { path: path.to_owned(), reason })?;
        given = parse(&text, path)?;
    }
    overrides.iter().try_for_each(|text| set(&mut given, text))?;
    Ok(given)
}

/// Gives the last stage, which may be a number, its name.
fn name_last_stage(given: &mut Table) -> Result<(), ConfigError> {
    if let Some(stage) = given.get_mut("last_stage") {
        let text = stage.as_str().map_or_else(|| stage.to_string(), str::to_owned);
        let named = text.parse::<LastStage>().map_err(|reason| invalid("last_stage", &reason))?;
        *stage = Value::String(named.name().to_owned());
    }
    Ok(())
}

/// The first difference between two configurations, but for the interval of checkpoints.
fn difference(mut own: Table, mut other: Table) -> Option<Difference> {
    [&mut own, &mut other].into_iter().for_each(|table| drop(table.remove("checkpoint_secs")));
    let (key, own, other) = first_difference(&own, &other, "")?;
    Some(Difference { key, own, other })
}

fn invalid(key: &str, reason: &dyn Display) -> ConfigError {
    ConfigError::Invalid { key: key.to_owned(), reason: reason.to_string() }
}

/// The outcome of checking a table, whose keys get its name.
fn below<K: Display, R: Display>(table: &str, checked: Result<(), (K, R)>) -> Result<(), ConfigError> {
    checked.map_err(|(key, reason)| invalid(&format!("{table}.{key}"), &reason))
}

/// A value that has to be one of some names.
fn choice<T: DeserializeOwned>(
    value: Option<&Value>,
    key: &str,
    known: &str,
) -> Result<Option<T>, ConfigError> {
    let read = |value: &Value| {
        value.clone().try_into().map_err(|_| invalid(key, &format!("{value} is not {known}")))
    };
    value.map(read).transpose()
}

/// Names of all kinds of source models.
fn known_kinds() -> String {
    SourceKind::ALL.map(|kind| format!("`{}`", kind.name())).join(" or ")
}
