//! The parameter section of a C3D file: groups by number, parameters by the number of their group.

use std::collections::BTreeMap;

use super::super::error::TracksProblem;
use super::words::Words;

/// A parameter: its type's size (−1: letters), its extents, its bytes.
struct Parameter<'a> {
    kind: i8,
    extents: &'a [u8],
    bytes: &'a [u8],
}

/// All parameters of a file by the names of group and parameter, in capitals.
pub(super) struct Parameters<'a> {
    words: &'a Words<'a>,
    by_name: BTreeMap<(String, String), Parameter<'a>>,
}

impl<'a> Parameters<'a> {
    /// Reads the section that starts at a byte.
    pub(super) fn parse(words: &'a Words<'a>, start: usize) -> Result<Self, TracksProblem> {
        const PART: &str = "parameters";
        let (mut groups, mut listed) = (BTreeMap::new(), Vec::new());
        let mut at = start + 4;
        loop {
            // A negative length marks a name that is locked; none ends the section.
            let length = usize::from((words.byte(at, PART)? as i8).unsigned_abs());
            if length == 0 {
                break;
            }
            let group = words.byte(at + 1, PART)? as i8;
            let name = String::from_utf8_lossy(words.slice(at + 2, length, PART)?).to_ascii_uppercase();
            let place = at + 2 + length;
            if group < 0 {
                groups.insert(group.unsigned_abs(), name);
            } else {
                listed.push((group.unsigned_abs(), name, parameter(words, place + 2)?));
            }
            // The way to the next entry counts from its own first byte.
            match usize::from(words.integer(place, PART)?) {
                0 => break,
                step => at = place + step,
            }
        }
        let named = |(group, name, parameter)| Some(((groups.get(&group)?.clone(), name), parameter));
        Ok(Self { words, by_name: listed.into_iter().filter_map(named).collect() })
    }

    fn get(&self, group: &str, name: &str) -> Option<&Parameter<'a>> {
        self.by_name.get(&(group.to_owned(), name.to_owned()))
    }

    /// The first number of a parameter; integers are without sign, as counts are stored.
    pub(super) fn number(&self, group: &str, name: &str) -> Option<f64> {
        let parameter = self.get(group, name)?;
        match (parameter.kind, parameter.bytes) {
            (1, &[a, ..]) => Some(f64::from(a)),
            (2, &[a, b, ..]) => Some(f64::from(self.words.integer_of([a, b]))),
            (4, &[a, b, c, d, ..]) => Some(f64::from(self.words.float_of([a, b, c, d]))),
            _ => None,
        }
    }

    /// A number of the group `TRIAL` that is stored in two integers, the lower half first.
    pub(super) fn long(&self, name: &str) -> Option<u64> {
        let parameter = self.get("TRIAL", name).filter(|parameter| parameter.kind == 2)?;
        let &[a, b, c, d, ..] = parameter.bytes else { return None };
        let half = |bytes| u64::from(self.words.integer_of(bytes));
        Some(half([a, b]) + (half([c, d]) << 16))
    }

    /// The texts of a parameter, without the blanks that fill them; none if it is absent.
    pub(super) fn texts(&self, group: &str, name: &str) -> Vec<String> {
        let Some(parameter) = self.get(group, name).filter(|parameter| parameter.kind == -1) else {
            return Vec::new();
        };
        let length = usize::from(parameter.extents.first().copied().unwrap_or(1)).max(1);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
        parameter.bytes.chunks(length).map(text).collect()
    }
}

/// The parameter whose type stands at a byte.
fn parameter<'a>(words: &Words<'a>, at: usize) -> Result<Parameter<'a>, TracksProblem> {
    const PART: &str = "parameters";
    let kind = words.byte(at, PART)? as i8;
    let count = usize::from(words.byte(at + 1, PART)?);
    let extents = words.slice(at + 2, count, PART)?;
    let length = extents
        .iter()
        .fold(u64::from(kind.unsigned_abs()), |size, &extent| size.saturating_mul(extent.into()));
    let bytes = words.slice(at + 2 + count, usize::try_from(length).unwrap_or(usize::MAX), PART)?;
    Ok(Parameter { kind, extents, bytes })
}
