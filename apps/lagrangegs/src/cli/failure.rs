//! Errors as one readable line that ends with the path they are about.
//!
//! Library errors name their file in one place or another; [`At::at`] moves the path to the end, or adds it,
//! where a command knows it.

use std::path::Path;

/// Says which file or folder an error is about.
pub(crate) trait At<T> {
    /// The error with the path at its end. If the message names something inside `path`, that stays the path.
    fn at(self, path: &Path) -> anyhow::Result<T>;
}

impl<T, E: Into<anyhow::Error>> At<T> for Result<T, E> {
    fn at(self, path: &Path) -> anyhow::Result<T> {
        self.map_err(|error| {
            let error = error.into();
            if super::output::is_closed_pipe(&error) {
                error
            } else {
                anyhow::anyhow!(ending_with_path(&chain(&error), path))
            }
        })
    }
}

/// An error and its causes, joined by colons; causes that the text before already quotes are left out.
pub(crate) fn chain(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text.replace('\n', " ")
}

/// Moves the first mention of `path`, or of something inside it, to the end; adds `path` if there is none.
fn ending_with_path(text: &str, path: &Path) -> String {
    let given = path.display().to_string();
    let found = text.find(&given).map_or(given.clone(), |start| {
        let rest = &text[start..];
        let end = rest[given.len()..]
            .find(|c: char| c.is_whitespace() || "`:,;)".contains(c))
            .map_or(rest.len(), |i| given.len() + i);
        rest[..end].to_owned()
    });
    if text.ends_with(&found) {
        return text.to_owned();
    }
    let without = match text.strip_prefix(&format!("{found}: ")) {
        Some(rest) => rest.to_owned(),
        None => match text.strip_prefix(&format!("{found} is ")) {
            Some(rest) => format!("the file is {rest}"),
            None => text.replacen(&format!(" {found}: "), ": ", 1),
        },
    };
    format!("{without}: {found}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(text: &str, path: &str) -> String {
        ending_with_path(text, Path::new(path))
    }

    #[test]
    fn the_path_comes_last_once() {
        assert_eq!(
            moved("cannot read a/b.ply: no such file", "a/b.ply"),
            "cannot read: no such file: a/b.ply"
        );
        assert_eq!(moved("a/b.ply: `means` is not finite", "a/b.ply"), "`means` is not finite: a/b.ply");
        assert_eq!(
            moved("a/b.ply is damaged: cut short", "a/b.ply"),
            "the file is damaged: cut short: a/b.ply"
        );
        assert_eq!(moved("bad header: a/b.ply", "a/b.ply"), "bad header: a/b.ply");
        assert_eq!(moved("bad header", "a/b.ply"), "bad header: a/b.ply");
    }

    #[test]
    fn a_file_inside_the_folder_stays_the_path() {
        assert_eq!(
            moved("run/checkpoints/1.safetensors is damaged: cut", "run"),
            "the file is damaged: cut: run/checkpoints/1.safetensors"
        );
        assert_eq!(
            moved("can't read file: denied: run/config.toml", "run"),
            "can't read file: denied: run/config.toml"
        );
    }

    #[test]
    fn a_cause_that_is_quoted_is_not_repeated() {
        let io = std::io::Error::other("disk on fire");
        let error = anyhow::Error::new(io).context("cannot write x: disk on fire");
        assert_eq!(chain(&error), "cannot write x: disk on fire");
    }
}
