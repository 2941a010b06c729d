//! Writing files so that a crash, a full disk or an unwritable folder never leaves half of one.
//!
//! The contents go to a temporary file in the destination's own folder, are flushed to the disk and renamed
//! over the destination. A rename within one folder is atomic, so a reader sees the old file or the new one.
//! Errors say what failed and end with the path.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

pub use crate::unfinished::destination_of;
use crate::unfinished::{Fate, PREFIX, Unfinished, bare, writing};

/// A file operation that failed.
#[derive(Debug, thiserror::Error)]
#[error("can't {action}: {reason}: {}", path.display())]
pub struct FileError {
    /// The attempt, as in "can't …".
    pub action: &'static str,
    /// The file or folder.
    pub path: PathBuf,
    /// The operating system's reason.
    pub reason: io::Error,
}

impl FileError {
    /// The file or folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// An error of `action` on `path`; a file that is on its way has the path that it is to get.
    #[must_use]
    pub fn new(action: &'static str, path: &Path, reason: io::Error) -> Self {
        Self { action, path: destination_of(path), reason: bare(reason) }
    }
}

/// Writes a file through a temporary one beside it: either all of it arrives or the destination stays as it
/// was.
///
/// # Errors
/// If the folder can't be written, `fill` fails or the disk is full; the temporary file is removed.
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FileError> {
    write_and_rename(path, fill).map_err(|reason| FileError::new("write file", path, reason))
}

/// [`write_atomically`], creating the folders that lead to `path` first.
///
/// # Errors
/// If a folder can't be created or the file can't be written.
pub fn write_with_parents(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FileError> {
    let folder = folder_of(path);
    fs::create_dir_all(folder).map_err(|reason| FileError::new("create folder", folder, reason))?;
    write_atomically(path, fill)
}

/// Writes a folder through a temporary one beside it: either all of it arrives or nothing does. The folder
/// must be new or empty.
///
/// # Errors
/// If the folder holds something or can't be created, or `fill` fails; the temporary folder is removed.
pub fn write_folder<E: From<FileError>>(
    out: &Path,
    fill: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    let taken = || io::Error::new(io::ErrorKind::AlreadyExists, "it is not empty");
    if !is_free(out) {
        return Err(FileError::new("create folder", out, taken()).into());
    }
    let parent = folder_of(out);
    fs::create_dir_all(parent).map_err(|e| FileError::new("create folder", parent, e))?;
    let (folder, unfinished) = {
        let _writing = writing();
        let folder = temporary_builder(0o777).tempdir_in(parent);
        let folder = folder.map_err(|e| FileError::new("create folder in", parent, e))?;
        let unfinished = Unfinished::new(folder.path(), out, Fate::Removed);
        (folder, unfinished)
    };
    fill(folder.path())?;
    let _writing = writing();
    if out.exists() {
        fs::remove_dir(out).map_err(|e| FileError::new("replace folder", out, e))?;
    }
    fs::rename(folder.path(), out).map_err(|e| FileError::new("create folder", out, e))?;
    let _ = folder.keep(); // renamed: nothing is left to delete
    drop(unfinished);
    Ok(())
}

/// Writes a file into a folder that [`write_folder`] is making, without a flush to the disk: the folder only
/// gets its name when all of it is there.
pub(crate) fn write_into_new(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let _writing = writing();
    let parent = folder_of(path);
    fs::create_dir_all(parent).map_err(|reason| FileError::new("create folder", parent, reason))?;
    fs::write(path, bytes).map_err(|reason| FileError::new("write file", path, reason))
}

/// Whether a folder can be made at a path: there is nothing, or an empty folder.
#[must_use]
pub fn is_free(out: &Path) -> bool {
    match fs::read_dir(out) {
        Ok(mut entries) => entries.next().is_none(),
        Err(_) => !out.exists(), // what else is wrong with the path shows when the folder is created
    }
}

/// Reads a whole file.
///
/// # Errors
/// If it can't be read.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    fs::read(path).map_err(|reason| FileError::new("read file", path, reason))
}

/// A file that can be read while it grows: until it is finished it has the name `STEM.part.EXTENSION`, beside
/// the one that it gets in the end. Dropped unfinished it is removed; a killed process leaves it there.
#[derive(Debug)]
pub struct GrowingFile {
    path: PathBuf,
    part: PathBuf,
    file: File,
    _unfinished: Unfinished,
}

impl GrowingFile {
    /// Begins the file; folders that lead to it are created.
    ///
    /// # Errors
    /// If the path is that of something other than a file, or nothing can be written there.
    pub fn begin(path: &Path) -> Result<Self, FileError> {
        let folder = folder_of(path);
        fs::create_dir_all(folder).map_err(|reason| FileError::new("create folder", folder, reason))?;
        let is_other = |path: &Path| path.exists() && !path.is_file();
        let part = part_of(path);
        if let Some(taken) = [path, &part].into_iter().find(|path| is_other(path)) {
            let reason = io::Error::new(io::ErrorKind::AlreadyExists, "what is there is no file");
            return Err(FileError::new("write file", taken, reason));
        }
        let _writing = writing();
        let file = File::create(&part).map_err(|reason| FileError::new("write file", path, reason))?;
        let _unfinished = Unfinished::new(&part, path, Fate::Removed);
        Ok(Self { path: path.to_owned(), part, file, _unfinished })
    }

    /// The name that the file gets in the end.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// If the disk is full or the file can't be renamed.
    pub fn finish(self) -> Result<(), FileError> {
        let failed = |reason| FileError::new("write file", &self.path, reason);
        self.file.sync_all().map_err(failed)?;
        let _writing = writing();
        fs::rename(&self.part, &self.path).map_err(failed)?;
        sync_folder(folder_of(&self.path));
        Ok(())
    }
}

impl Write for GrowingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for GrowingFile {
    fn drop(&mut self) {
        // After it was renamed there is nothing to remove.
        let _ = fs::remove_file(&self.part);
    }
}

/// The name of a file that grows.
fn part_of(path: &Path) -> PathBuf {
    let ending = path.extension().map_or_else(String::new, |ending| format!(".{}", ending.display()));
    path.with_extension(format!("part{ending}"))
}

/// The folder a path lies in; `.` for a bare name.
#[must_use]
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn write_and_rename(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    if path.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "there is a folder of that name"));
    }
    let folder = folder_of(path);
    let _writing = writing();
    let temporary = temporary_builder(0o666).tempfile_in(folder)?;
    let mut writer = BufWriter::with_capacity(1 << 16, temporary);
    fill(&mut writer)?;
    let temporary = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
    temporary.as_file().sync_all()?;
    temporary.persist(path).map_err(|e| e.error)?;
    sync_folder(folder);
    Ok(())
}

/// Names of temporary files and folders; `mode` is narrowed by the user's umask, so that results are as
/// readable as any other file.
pub(crate) fn temporary_builder(mode: u32) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

/// Makes a rename durable. Not every file system can; the rename itself has happened, so a refusal is no
/// error.
fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_litter() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        write_atomically(&path, |w| w.write_all(b"old")).unwrap();
        let error = write_atomically(&path, |w| {
            w.write_all(b"new")?;
            Err(io::Error::new(io::ErrorKind::StorageFull, "no space left on device"))
        })
        .unwrap_err();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
        let message = error.to_string();
        assert!(message.contains("no space") && message.ends_with("a.bin"), "{message}");
    }

    #[test]
    fn a_missing_folder_is_an_error_unless_parents_are_asked_for() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("x/y/a.bin");
        assert!(write_atomically(&path, |w| w.write_all(b"1")).unwrap_err().to_string().ends_with("a.bin"));
        write_with_parents(&path, |w| w.write_all(b"1")).unwrap();
        assert_eq!(read_bytes(&path).unwrap(), b"1");
        assert!(read_bytes(&dir.path().join("none")).unwrap_err().to_string().ends_with("none"));
    }

    #[test]
    fn a_growing_file_can_be_read_and_takes_its_name_in_the_end() {
        let dir = tempfile::tempdir().unwrap();
        let (path, part) = (dir.path().join("new/a.rrd"), dir.path().join("new/a.part.rrd"));
        let mut file = GrowingFile::begin(&path).unwrap();
        file.write_all(b"half").unwrap();
        assert_eq!(fs::read(&part).unwrap(), b"half");
        assert!(!path.exists());
        file.finish().unwrap();
        assert_eq!((fs::read(&path).unwrap().as_slice(), part.exists()), (&b"half"[..], false));
        drop(GrowingFile::begin(&path).unwrap());
        assert_eq!((fs::read(&path).unwrap().as_slice(), part.exists()), (&b"half"[..], false));
        let error = GrowingFile::begin(dir.path()).unwrap_err().to_string();
        assert!(error.contains("no file") && error.ends_with(&dir.path().display().to_string()), "{error}");
        assert!(GrowingFile::begin(&path.join("b.rrd")).is_err());
    }

    #[test]
    fn a_file_where_a_folder_should_be_and_the_reverse_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        write_atomically(&path, |w| w.write_all(b"1")).unwrap();
        assert!(write_with_parents(&path.join("b"), |w| w.write_all(b"1")).is_err());
        assert!(write_atomically(dir.path(), |w| w.write_all(b"1")).is_err());
    }
}
