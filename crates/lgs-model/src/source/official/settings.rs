//! `cfg_args`: the settings of the DefGS program, as Python prints a namespace.

use std::path::Path;

use lgs_data::files::read_bytes;

use super::super::error::SourceError;

/// Name of the file.
pub(super) const FILE: &str = "cfg_args";

/// Settings of the authors' program that matter to whoever reads its models; those that the file lacks are
/// absent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OfficialSettings {
    /// The images that the model was trained on.
    pub source_path: Option<String>,
    /// Whether they were laid over white; else over black.
    pub white_background: Option<bool>,
    /// Whether the time goes through a network of its own first, as for synthetic scenes.
    pub is_blender: Option<bool>,
}

impl OfficialSettings {
    /// Reads the settings of an output folder; nothing if the file is absent.
    ///
    /// # Errors
    /// If the file can't be read or is no namespace.
    pub(super) fn read(folder: &Path) -> Result<Option<Self>, SourceError> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(None);
        }
        let bytes = read_bytes(&path)?;
        let text = String::from_utf8_lossy(&bytes);
        let found = || text.chars().take(40).collect();
        Self::parse(&text).map(Some).ok_or_else(|| SourceError::Settings { found: found(), path })
    }

    fn parse(text: &str) -> Option<Self> {
        let inner = text.trim().strip_prefix("Namespace(")?.strip_suffix(')')?;
        let pairs: Vec<(&str, &str)> = parts(inner).iter().filter_map(|part| part.split_once('=')).collect();
        let value =
            |name: &str| pairs.iter().find(|(key, _)| key.trim() == name).map(|(_, value)| value.trim());
        let switch = |name| match value(name) {
            Some("True") => Some(true),
            Some("False") => Some(false),
            _ => None,
        };
        Some(Self {
            source_path: value("source_path").map(|path| path.trim_matches(['\'', '"']).to_owned()),
            white_background: switch("white_background"),
            is_blender: switch("is_blender"),
        })
    }
}

/// Parts of a text between commas that stand in no quotes.
fn parts(text: &str) -> Vec<&str> {
    let mut quote = None;
    text.split(|letter| {
        match (quote, letter) {
            (None, '\'' | '"') => quote = Some(letter),
            (Some(open), _) if open == letter => quote = None,
            _ => {}
        }
        quote.is_none() && letter == ','
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_namespace_is_read_with_commas_in_its_texts() {
        let text = "Namespace(data_device='cuda', images='a, is_blender=False', is_blender=True, \
                    source_path='data/D-NeRF/hook', white_background=False, sh_degree=3)";
        let expected = OfficialSettings {
            source_path: Some("data/D-NeRF/hook".to_owned()),
            white_background: Some(false),
            is_blender: Some(true),
        };
        assert_eq!(OfficialSettings::parse(text), Some(expected));
        assert_eq!(OfficialSettings::parse("Namespace()"), Some(OfficialSettings::default()));
        assert_eq!(OfficialSettings::parse("{}"), None);
    }
}
