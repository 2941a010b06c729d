//! Times of images from the numbers in their names, or from a file of times.
//!
//! The captured sequence spans [0, 1): with frame numbers from `a` to `b`, number `n` has the time
//! (n − a) / (b − a + 1). Times in any unit become (t − a) / (b − a) · (n − 1) / n with `n` different times,
//! which is the same for times at even steps.

use crate::names::{self, time_of_number};
use std::path::Path;

/// The last number in a file's name, its folders and extension left out.
pub(super) fn last_number(file_path: &str) -> Option<u64> {
    names::last_number(file_path).map(|(_, number, _)| number)
}

/// The frame number of an image: of its folder where folders are times (`frame_0007/cam03.png`,
/// `0007/cam03.png`), else the last number in its name.
pub(super) fn frame_number(file_path: &str) -> Option<u64> {
    let starts = |text: &str, words: &[&str]| {
        let lower = text.to_ascii_lowercase();
        words.iter().any(|word| {
            lower.strip_prefix(word).is_some_and(|rest| {
                rest.trim_start_matches(['_', '-', ' ']).starts_with(|c: char| c.is_ascii_digit())
            })
        })
    };
    let path = Path::new(file_path);
    let name = path.file_stem()?.to_str()?;
    let folder = path.parent().and_then(|p| p.file_name()).and_then(|p| p.to_str()).unwrap_or_default();
    let of_camera = starts(name, &["cam", "camera", "view"]);
    let of_time = starts(folder, &["frame", "time", "t"])
        || (of_camera && !folder.is_empty() && folder.bytes().all(|b| b.is_ascii_digit()));
    if of_time && of_camera { last_number(folder) } else { last_number(file_path) }
}

/// Times of frame numbers; images without a number have none.
pub(super) fn of_numbers(numbers: &[Option<u64>]) -> Vec<Option<f64>> {
    let (first, last) = numbers.iter().flatten().fold((u64::MAX, 0), |(a, b), &n| (a.min(n), b.max(n)));
    numbers.iter().map(|number| number.map(|n| time_of_number(n, first, last))).collect()
}

/// Finite times in any unit as times of a sequence that spans [0, 1).
pub(super) fn spanning(times: &[f64]) -> Vec<f64> {
    let mut different = times.to_vec();
    different.sort_by(f64::total_cmp);
    different.dedup();
    let (Some(first), Some(last)) = (different.first(), different.last()) else { return Vec::new() };
    let count = different.len() as f64;
    let length = if last > first { (last - first) * count / (count - 1.0) } else { 1.0 };
    times.iter().map(|t| (t - first) / length).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_in_names_and_in_folders_of_times() {
        assert_eq!(frame_number("cam01/frame_0012.png"), Some(12));
        assert_eq!(frame_number("images/0012.png"), Some(12));
        assert_eq!(frame_number("frame_0012/cam03.png"), Some(12));
        assert_eq!(frame_number("0012/cam_03.png"), Some(12));
        assert_eq!(frame_number("0012/0003.png"), Some(3));
        assert_eq!(frame_number("still.png"), None);
    }

    #[test]
    fn even_steps_and_numbers_agree() {
        let numbers: Vec<Option<f64>> = of_numbers(&[Some(3), Some(4), None, Some(5), Some(6)]);
        assert_eq!(numbers, [Some(0.0), Some(0.25), None, Some(0.5), Some(0.75)]);
        assert_eq!(spanning(&[2.0, 2.5, 3.0, 3.5, 2.0]), [0.0, 0.25, 0.5, 0.75, 0.0]);
        assert_eq!(spanning(&[7.0, 7.0]), [0.0, 0.0]);
    }
}
