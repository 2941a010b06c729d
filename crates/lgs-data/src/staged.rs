//! Several files for one folder: all of them arrive, or none.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::files::{FileError, temporary_builder};
use crate::unfinished::{Unfinished, writing};

/// Files on their way into a folder that may hold others: until all are there they lie in a hidden folder
/// inside of it, which goes if this is dropped or the program is interrupted.
#[derive(Debug)]
pub struct StagedFolder {
    out: PathBuf,
    temporary: TempDir,
    unfinished: Unfinished,
}

impl StagedFolder {
    /// Begins in a folder that exists.
    ///
    /// # Errors
    /// If nothing can be written there.
    pub fn begin(out: &Path) -> Result<Self, FileError> {
        let _writing = writing();
        let temporary = temporary_builder(0o777)
            .tempdir_in(out)
            .map_err(|reason| FileError::new("create folder in", out, reason))?;
        let unfinished = Unfinished::new(temporary.path());
        Ok(Self { out: out.to_owned(), temporary, unfinished })
    }

    /// The hidden folder, for files alone.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.temporary.path()
    }

    /// Moves the files into the folder, over those of the same names, the one called `last` after all others,
    /// and then removes the `obsolete` ones.
    ///
    /// # Errors
    /// If a file can't be moved or removed.
    pub fn finish(self, last: &str, obsolete: &[PathBuf]) -> Result<(), FileError> {
        let _writing = writing();
        let Self { out, temporary, unfinished } = self;
        let failed = |action, path: &Path, reason| FileError::new(action, path, reason);
        let entries = fs::read_dir(temporary.path()).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let entries = entries.map_err(|reason| failed("read folder", temporary.path(), reason))?;
        let mut names: Vec<_> = entries.into_iter().map(|entry| entry.file_name()).collect();
        names.sort_by_key(|name| (name == last, name.clone()));
        for name in names {
            let path = out.join(&name);
            let moved = fs::rename(temporary.path().join(&name), &path);
            moved.map_err(|reason| failed("write file", &path, reason))?;
        }
        for name in obsolete {
            let path = out.join(name);
            match fs::remove_file(&path) {
                Err(reason) if reason.kind() != io::ErrorKind::NotFound => {
                    return Err(failed("remove file", &path, reason));
                }
                _ => {}
            }
        }
        drop((temporary, unfinished));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn all_files_arrive_together_or_none() {
        let dir = tempfile::tempdir().expect("a folder");
        let out = dir.path();
        ["a", "b", "own"].iter().for_each(|name| fs::write(out.join(name), "old").expect("a file"));
        let staged = StagedFolder::begin(out).expect("begun");
        fs::write(staged.path().join("a"), "new").expect("a file");
        drop(staged);
        assert_eq!(
            (names(out), fs::read(out.join("a")).expect("a file")),
            (vec!["a".into(), "b".into(), "own".into()], b"old".to_vec())
        );
        let staged = StagedFolder::begin(out).expect("begun");
        ["a", "list"].iter().for_each(|name| fs::write(staged.path().join(name), "new").expect("a file"));
        staged.finish("list", &["b".into(), "gone".into()]).expect("finished");
        assert_eq!(
            (names(out), fs::read(out.join("a")).expect("a file")),
            (vec!["a".into(), "list".into(), "own".into()], b"new".to_vec())
        );
    }
}
