//! Several files for one folder, which arrive together; those that were finished are kept if the rest fails.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::files::{FileError, temporary_builder};
use crate::unfinished::{Fate, Kept, Unfinished, keep, writing};

/// Files on their way into a folder that may hold others: until all are there they lie in a hidden folder
/// inside of it. If this ends without them, or the program is interrupted, that folder becomes `unfinished`
/// (`unfinished-2` and so on, where there is one), so that neither work is lost nor old and new files mix.
#[derive(Debug)]
pub struct StagedFolder {
    out: PathBuf,
    /// The hidden folder, until it is finished or kept.
    temporary: Option<(TempDir, Unfinished)>,
    path: PathBuf,
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
        let unfinished = Unfinished::new(temporary.path(), out, Fate::Kept);
        let path = temporary.path().to_owned();
        Ok(Self { out: out.to_owned(), temporary: Some((temporary, unfinished)), path })
    }

    /// The hidden folder, for files alone.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Moves the files into the folder, over those of the same names, the one called `list` after all others,
    /// and then removes the `obsolete` ones. An old list goes before the first file comes.
    ///
    /// # Errors
    /// If there is a folder of a file's name, and nothing is moved; or a file can't be moved or removed.
    pub fn finish(&mut self, list: &str, obsolete: &[PathBuf]) -> Result<(), FileError> {
        let _writing = writing();
        let entries = fs::read_dir(&self.path).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let entries = entries.map_err(|reason| FileError::new("read folder", &self.path, reason))?;
        let mut names: Vec<_> = entries.into_iter().map(|entry| entry.file_name()).collect();
        names.sort_by_key(|name| (name == list, name.clone()));
        if let Some(taken) = names.iter().map(|name| self.out.join(name)).find(|path| path.is_dir()) {
            let reason = io::Error::new(io::ErrorKind::IsADirectory, "there is a folder of that name");
            return Err(FileError::new("write file", &taken, reason));
        }
        remove(&self.out.join(list))?;
        for name in names {
            let path = self.out.join(&name);
            let moved = fs::rename(self.path.join(&name), &path);
            moved.map_err(|reason| FileError::new("write file", &path, reason))?;
        }
        obsolete.iter().try_for_each(|name| remove(&self.out.join(name)))?;
        self.temporary = None;
        Ok(())
    }

    /// Ends without the rest of the files, and says where those are that were finished; nothing where there
    /// are none.
    pub fn keep(&mut self) -> Option<Kept> {
        let (temporary, unfinished) = self.temporary.take()?;
        let _writing = writing();
        let kept = keep(temporary.path(), &self.out);
        if !matches!(kept, Ok(None)) {
            let _ = temporary.keep(); // renamed, or all that there is
        }
        drop(unfinished);
        kept.ok().flatten()
    }
}

impl Drop for StagedFolder {
    fn drop(&mut self) {
        self.keep();
    }
}

fn remove(path: &Path) -> Result<(), FileError> {
    match fs::remove_file(path) {
        Err(reason) if reason.kind() != io::ErrorKind::NotFound => {
            Err(FileError::new("remove file", path, reason))
        }
        _ => Ok(()),
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

    fn text(path: &Path) -> String {
        fs::read_to_string(path).expect("a file")
    }

    #[test]
    fn files_arrive_together_and_those_that_are_finished_are_kept() {
        let dir = tempfile::tempdir().expect("a folder");
        let out = dir.path();
        ["a", "b", "own"].iter().for_each(|name| fs::write(out.join(name), "old").expect("a file"));
        drop(StagedFolder::begin(out).expect("begun"));
        assert_eq!(names(out), ["a", "b", "own"], "nothing was finished");
        let staged = StagedFolder::begin(out).expect("begun");
        fs::write(staged.path().join("a"), "kept").expect("a file");
        drop(staged);
        assert_eq!(names(out), ["a", "b", "own", "unfinished"]);
        assert_eq!((text(&out.join("a")), text(&out.join("unfinished/a"))), ("old".into(), "kept".into()));
        let mut staged = StagedFolder::begin(out).expect("begun");
        ["a", "list"].iter().for_each(|name| fs::write(staged.path().join(name), "new").expect("a file"));
        staged.finish("list", &["b".into(), "gone".into()]).expect("finished");
        assert_eq!(staged.keep(), None);
        assert_eq!(names(out), ["a", "list", "own", "unfinished"]);
        assert_eq!(text(&out.join("a")), "new");
    }

    #[test]
    fn a_folder_in_the_way_is_seen_before_anything_is_moved() {
        let dir = tempfile::tempdir().expect("a folder");
        let out = dir.path();
        fs::create_dir(out.join("b")).expect("a folder");
        ["a", "list"].iter().for_each(|name| fs::write(out.join(name), "old").expect("a file"));
        let mut staged = StagedFolder::begin(out).expect("begun");
        ["a", "b", "list"]
            .iter()
            .for_each(|name| fs::write(staged.path().join(name), "new").expect("a file"));
        let error = staged.finish("list", &[]).expect_err("in the way").to_string();
        assert!(error.ends_with(&out.join("b").display().to_string()), "{error}");
        let kept = Kept { folder: out.join("unfinished"), files: 3 };
        assert_eq!(staged.keep(), Some(kept));
        assert_eq!((text(&out.join("a")), text(&out.join("list"))), ("old".into(), "old".into()));
    }

    #[test]
    fn errors_name_the_destination() {
        let dir = tempfile::tempdir().expect("a folder");
        let staged = StagedFolder::begin(dir.path()).expect("begun");
        let error = crate::files::write_atomically(&staged.path().join("none/a"), |_| Ok(()));
        let error = error.expect_err("no folder").to_string();
        assert!(error.ends_with(&dir.path().join("none/a").display().to_string()), "{error}");
        assert!(!error.contains(".partial-"), "{error}");
    }
}
