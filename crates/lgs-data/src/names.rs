//! Numbers in the names of files.

use std::path::Path;

/// Text and numbers of a name in turn, so that `frame2` comes before `frame10`.
pub(crate) fn natural_key(name: &str) -> Vec<(String, u64)> {
    let mut key = vec![(String::new(), 0_u64)];
    let mut in_number = false;
    for letter in name.chars() {
        let digit = letter.to_digit(10);
        if in_number && digit.is_none() {
            key.push((String::new(), 0));
        }
        in_number = digit.is_some();
        if let Some((text, number)) = key.last_mut() {
            match digit {
                Some(digit) => *number = number.saturating_mul(10).saturating_add(u64::from(digit)),
                None => text.push(letter),
            }
        }
    }
    key
}

/// The last run of digits in a file's name, folders and extension left out, with the text on both sides.
pub(crate) fn last_number(path: &str) -> Option<(&str, u64, &str)> {
    let stem = Path::new(path).file_stem()?.to_str()?;
    let end = stem.trim_end_matches(|c: char| !c.is_ascii_digit()).len();
    let start = stem[..end].trim_end_matches(|c: char| c.is_ascii_digit()).len();
    Some((&stem[..start], stem[start..end].parse().ok()?, &stem[end..]))
}

/// The time of a frame by its number, in a recording that spans [0, 1) with frames `first` to `last`.
pub(crate) fn time_of_number(number: u64, first: u64, last: u64) -> f64 {
    (number - first) as f64 / ((last - first) as f64 + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = vec!["f10.ply", "f9.ply", "f2b.ply", "f2a.ply", "e100.ply"];
        names.sort_by_cached_key(|name| natural_key(name));
        assert_eq!(names, ["e100.ply", "f2a.ply", "f2b.ply", "f9.ply", "f10.ply"]);
    }

    #[test]
    fn the_last_number_is_that_of_the_name() {
        assert_eq!(last_number("cam2/frame_007b.png"), Some(("frame_", 7, "b")));
        assert_eq!(last_number("0012.ply"), Some(("", 12, "")));
        assert_eq!(last_number("cam2/still.png"), None);
        assert_eq!(last_number("99999999999999999999.png"), None);
    }
}
