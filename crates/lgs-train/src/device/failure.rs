//! What is to be said of a device that failed.

/// Words before the number of bytes that a device was asked for and did not have.
const ASKED: [&str; 2] = ["allocate buffer of size: ", "out of device memory allocating "];
/// The tensor library's words for a device that is gone; the last are those for work that it was gone in the
/// middle of.
const LOST: [&str; 4] = ["poisoned", "device was lost", "could not be mapped", "was torn down before"];
/// Its words for what was too large for a buffer, without its size.
const TOO_LARGE: &str = "Memory location was never initialized";
/// The settings by which a training needs less memory.
const LOWER: &str = "lower data.resolution, source.densify.max_gaussians or source.initial_gaussians";

/// One line of the words with which the tensor library gave up on a device, whose largest buffer has so many
/// bytes where that is known.
#[must_use]
pub fn failure(words: &str, largest: Option<u64>) -> String {
    if let Some(bytes) = ASKED.iter().find_map(|before| number_after(words, before)) {
        return format!("out of memory: {} were asked for at once; {LOWER}", size(bytes));
    }
    if words.contains(TOO_LARGE) {
        let more = largest.map_or_else(String::new, |bytes| format!(" of more than {}", size(bytes)));
        return format!(
            "out of memory: a buffer{more} was asked for, which the device does not have; {LOWER}"
        );
    }
    if words.to_lowercase().replace(' ', "").contains("outofmemory") {
        return format!("out of memory; {LOWER}");
    }
    let cause = words.rsplit_once("Caused by:").and_then(|(_, cause)| lines(cause).next());
    if LOST.iter().any(|lost| words.contains(lost)) {
        return format!("the device was lost ({})", cause.unwrap_or("its driver gives no reason"));
    }
    if let Some(cause) = cause {
        return cause.to_owned();
    }
    let mut lines = lines(words);
    let first = lines.next().unwrap_or("no reason given");
    let is_place = first.contains("panicked at");
    lines.next().filter(|_| is_place).unwrap_or(first).to_owned()
}

fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(str::trim).filter(|line| !line.is_empty())
}

/// The number that follows some words.
fn number_after(text: &str, words: &str) -> Option<u64> {
    let (_, rest) = text.split_once(words)?;
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().ok()
}

fn size(bytes: u64) -> String {
    match bytes {
        0..1_000_000 => format!("{bytes} bytes"),
        1_000_000..1_000_000_000 => format!("{:.0} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_says_how_much_and_what_to_lower() {
        let said =
            failure("panicked at a.rs:1:2:\ncan't allocate buffer of size: 4398046511104\n   0: main", None);
        assert!(said.contains("4398.0 GB were asked for") && said.contains("data.resolution"), "{said}");
        let said = failure("out of device memory allocating 25000000 bytes", None);
        assert!(said.contains("25 MB were asked for") && !said.contains('\n'), "{said}");
        assert!(failure("wgpu error: Out of Memory\n\nCaused by:", None).starts_with("out of memory; lower"));
        let said = failure("x\nCaused by:\n  Memory location was never initialized", Some(134_217_728));
        assert!(said.starts_with("out of memory: a buffer of more than 134 MB was asked for"), "{said}");
    }

    #[test]
    fn what_is_lost_or_unknown_is_one_line() {
        let said = failure(
            "panicked at a.rs:1:2:\nThe device is poisoned\nCaused by:\n  Unknown: reset\n  0: x",
            None,
        );
        assert_eq!(said, "the device was lost (Unknown: reset)");
        let said = failure("panicked at a.rs:1:2:\nthe staging buffer could not be mapped: an error", None);
        assert_eq!(said, "the device was lost (its driver gives no reason)");
        let said = failure("The work writing this buffer was torn down before it could say what", None);
        assert_eq!(said, "the device was lost (its driver gives no reason)");
        assert_eq!(failure("panicked at a.rs:1:2:\nsome kernel\n0: x", None), "some kernel");
        assert_eq!(
            failure("panicked at a.rs:1:2:\nno data\nCaused by:\n  some kernel\n0: x", None),
            "some kernel"
        );
        assert_eq!(failure("some kernel", None), "some kernel");
        assert_eq!(failure("", None), "no reason given");
    }
}
