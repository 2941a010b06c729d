//! Settings as data: text to tables, tables laid over each other key by key, and what can be wrong with them.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

/// A configuration that was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration: {reason}: {path}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        reason: std::io::Error,
    },
    /// The file is not TOML.
    #[error("not valid TOML: {reason}: {path}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// The parser's message.
        reason: String,
    },
    /// An override has no `=`.
    #[error("`{0}` is not of the form key=value")]
    Override(String),
    /// A key does not exist.
    #[error("unknown key `{key}`; known here: {known}")]
    Unknown {
        /// The dotted key.
        key: String,
        /// All keys of the same table.
        known: String,
    },
    /// A file that should have all keys lacks one.
    #[error("`{key}` is missing")]
    Absent {
        /// The dotted key.
        key: String,
    },
    /// A value has another type than the default.
    #[error("`{key}`: expected {expected}, found {found}")]
    Type {
        /// The dotted key.
        key: String,
        /// Type of the default.
        expected: String,
        /// Type and value given.
        found: String,
    },
    /// A value is out of range or not among the choices.
    #[error("`{key}`: {reason}")]
    Invalid {
        /// The dotted key, or `configuration` for all of it.
        key: String,
        /// Why the value cannot be.
        reason: String,
    },
}

impl ConfigError {
    /// The file that the error is about, where it is one that cannot be read or parsed.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Read { path, .. } | Self::Syntax { path, .. } => Some(path),
            Self::Override(_)
            | Self::Unknown { .. }
            | Self::Absent { .. }
            | Self::Type { .. }
            | Self::Invalid { .. } => None,
        }
    }
}

/// The table in a file's text.
pub(crate) fn parse(text: &str, path: &Path) -> Result<Table, ConfigError> {
    text.parse::<Table>()
        .map_err(|e| ConfigError::Syntax { path: path.to_owned(), reason: e.message().to_owned() })
}

/// Puts `a.b=value` into a table; a value that is not TOML by itself is taken as a string.
pub(crate) fn set(table: &mut Table, text: &str) -> Result<(), ConfigError> {
    let (key, value) = text.split_once('=').ok_or_else(|| ConfigError::Override(text.to_owned()))?;
    let (key, value) = (key.trim(), value.trim());
    let value = format!("v = {value}")
        .parse::<Table>()
        .ok()
        .and_then(|mut t| t.remove("v"))
        .unwrap_or_else(|| Value::String(value.to_owned()));
    let mut place = table;
    let mut parts: Vec<&str> = key.split('.').collect();
    let last = parts.pop().unwrap_or_default();
    for part in parts {
        let entry = place.entry(part).or_insert_with(|| Value::Table(Table::new()));
        place = entry.as_table_mut().ok_or_else(|| ConfigError::Unknown {
            key: key.to_owned(),
            known: format!("`{part}` has no keys"),
        })?;
    }
    place.insert(last.to_owned(), value);
    Ok(())
}

/// The first key, in the order of `a`, whose values differ in two tables, with both values.
pub(crate) fn first_difference(a: &Table, b: &Table, prefix: &str) -> Option<(String, String, String)> {
    let names = a.keys().chain(b.keys().filter(|name| !a.contains_key(*name)));
    names.into_iter().find_map(|name| {
        let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
        let text = |value: Option<&Value>| value.map_or_else(|| "nothing".to_owned(), Value::to_string);
        match (a.get(name), b.get(name)) {
            (Some(Value::Table(a)), Some(Value::Table(b))) => first_difference(a, b, &key),
            // Settings have single precision, which a number as it is typed has not.
            (Some(Value::Float(a)), Some(Value::Float(b))) if *a as f32 == *b as f32 => None,
            (a, b) => (a != b).then(|| (key, text(a), text(b))),
        }
    })
}

/// Lays `given` over `base`; every key must exist there with a value of the same type.
pub(crate) fn merge(base: &mut Table, given: &Table, prefix: &str) -> Result<(), ConfigError> {
    for (name, value) in given {
        let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
        let known = base.keys().cloned().collect::<Vec<_>>().join(", ");
        let Some(slot) = base.get_mut(name) else { return Err(ConfigError::Unknown { key, known }) };
        match (slot, value) {
            (Value::Table(slot), Value::Table(value)) => merge(slot, value, &key)?,
            (slot @ Value::Float(_), Value::Integer(value)) => *slot = Value::Float(*value as f64),
            (Value::Integer(_), Value::Integer(value)) if *value < 0 => {
                return Err(ConfigError::Invalid { key, reason: format!("{value} is negative") });
            }
            (slot, value) if slot.same_type(value) => *slot = value.clone(),
            (slot, value) => {
                return Err(ConfigError::Type {
                    key,
                    expected: slot.type_str().to_owned(),
                    found: format!("{} ({value})", value.type_str()),
                });
            }
        }
    }
    Ok(())
}
