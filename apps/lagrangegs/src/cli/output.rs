//! Where results go: stdout, and files in a folder of the user's.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use lgs_core::Image;
use lgs_data::dataset::DatasetFormat;
use lgs_data::files::{FileError, write_atomically};
use lgs_data::{Kept, StagedFolder};
use serde_json::Value;

use super::failure::At;

/// Writes text to stdout as it is.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    Ok(stdout.flush()?)
}

/// Writes one JSON document to stdout.
pub(crate) fn print_json<T: serde::Serialize>(value: &T) -> Result<()> {
    print(&format!("{}\n", serde_json::to_string_pretty(value)?))
}

/// Whether an error is that nobody reads stdout any more.
pub(crate) fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == ErrorKind::BrokenPipe)
}

/// Makes sure that a folder exists and can be written, before any work is done.
pub(crate) fn prepare_folder(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| FileError::new("create folder", folder, e))?;
    let probe = folder.join(".lagrangegs-probe");
    let written = std::fs::write(&probe, b"").and_then(|()| std::fs::remove_file(&probe));
    Ok(written.map_err(|e| FileError::new("write into folder", folder, e))?)
}

/// Refuses an output inside a dataset: no command writes there.
pub(crate) fn refuse_inside_dataset(out: &Path) -> Result<()> {
    let resolved = resolved(out)?;
    for folder in resolved.ancestors().filter(|f| !f.as_os_str().is_empty()) {
        if DatasetFormat::detect(folder).is_some() {
            bail!("the output would be inside a dataset; choose another folder: {}", out.display());
        }
    }
    Ok(())
}

/// Refuses an output at or inside of what a command or a run reads.
pub(crate) fn refuse_inside_input(out: &Path, input: &Path) -> Result<()> {
    if resolved(out)?.starts_with(resolved(input)?) {
        bail!("the output would mix with the input; choose another folder: {}", out.display());
    }
    Ok(())
}

/// An absolute path without links, as far as it exists.
fn resolved(path: &Path) -> Result<PathBuf> {
    let absolute = std::path::absolute(path).at(path)?;
    let known = absolute.ancestors().find_map(|folder| Some((folder, folder.canonicalize().ok()?)));
    let Some((folder, known)) = known else { return Ok(absolute) };
    Ok(known.join(absolute.strip_prefix(folder).unwrap_or(Path::new(""))))
}

/// Says how many images were left out because they are absent.
pub(crate) fn warn_of_absent(count: usize, data: &Path) {
    if count > 0 {
        tracing::warn!("{count} images are listed and absent; they are left out: {}", data.display());
    }
}

/// Writes an 8-bit PNG, whole or not at all.
pub(crate) fn write_png(path: &Path, image: &Image) -> Result<()> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&image.to_rgb8(), image.width, image.height, ExtendedColorType::Rgb8)
        .at(path)?;
    write_atomically(path, |w| w.write_all(&bytes)).at(path)
}

/// Name of the list of files that a folder of frames holds.
const MANIFEST: &str = "frames.json";

/// What the frames of a folder are.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrameKind {
    /// PNG files.
    Images,
    /// Splat files.
    Splats,
}

/// Frames on their way into a folder. They arrive together, with the list of them, when the last is there;
/// then those go that the list of an earlier call names, so that old and new frames never mix.
pub(crate) struct FrameFolder {
    staged: StagedFolder,
    old: Vec<PathBuf>,
}

impl FrameFolder {
    /// Fills a folder that exists by `work`, which writes frames and returns the list of them with whatever
    /// it makes. After an error those that are there are kept, and the error says where.
    ///
    /// # Errors
    /// If the folder lists frames of another kind, `work` fails or the frames cannot be put there.
    pub(crate) fn fill<T>(
        folder: &Path,
        kind: FrameKind,
        work: impl FnOnce(&Self) -> Result<(T, Value)>,
    ) -> Result<T> {
        let mut frames = Self::begin(folder, kind)?;
        let done = work(&frames).and_then(|(made, list)| {
            frames.finish(&list)?;
            Ok(made)
        });
        done.map_err(|error| match frames.staged.keep() {
            Some(kept) => error.context(kept_text(&kept)),
            None => error,
        })
    }

    fn begin(folder: &Path, kind: FrameKind) -> Result<Self> {
        let old = names_in(&std::fs::read(folder.join(MANIFEST)).unwrap_or_default());
        let kind_of = |name: &PathBuf| match name.extension().is_some_and(|ending| ending == "png") {
            true => FrameKind::Images,
            false => FrameKind::Splats,
        };
        if let Some(other) = old.iter().find(|name| kind_of(name) != kind && folder.join(name).exists()) {
            let (other, folder) = (other.display(), folder.display());
            bail!(
                "the folder holds frames of another kind, such as {other}; choose another folder: {folder}"
            );
        }
        Ok(Self { staged: StagedFolder::begin(folder)?, old })
    }

    /// Where the file of a name is written for now.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.staged.path().join(name)
    }

    fn finish(&mut self, list: &Value) -> Result<()> {
        let path = self.path(MANIFEST);
        let text = format!("{list:#}\n");
        write_atomically(&path, |w| w.write_all(text.as_bytes())).at(&path)?;
        let new = names_in(text.as_bytes());
        let is_obsolete = |name: &&PathBuf| !new.contains(name);
        let obsolete: Vec<PathBuf> = self.old.iter().filter(is_obsolete).cloned().collect();
        Ok(self.staged.finish(MANIFEST, &obsolete)?)
    }
}

/// Where finished files of an unfinished set are, in words that end with the folder.
pub(crate) fn kept_text(kept: &Kept) -> String {
    let files = if kept.files == 1 {
        "1 finished file is".to_owned()
    } else {
        format!("{} finished files are", kept.files)
    };
    format!("{files} kept in {}", kept.folder.display())
}

/// The files of its own folder that a list names.
fn names_in(list: &[u8]) -> Vec<PathBuf> {
    let list: Value = serde_json::from_slice(list).unwrap_or_default();
    let names = list["frames"].as_array().into_iter().flatten().filter_map(|frame| frame["file"].as_str());
    names.map(PathBuf::from).filter(|name| name.components().count() == 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn list(names: &[&str]) -> Value {
        json!({ "frames": names.iter().map(|name| json!({ "file": name })).collect::<Vec<_>>() })
    }

    #[test]
    fn old_frames_go_once_new_ones_are_there_and_those_of_another_kind_stay() {
        let dir = tempfile::tempdir().expect("a folder");
        let folder = dir.path();
        let write = |name: &str| std::fs::write(folder.join(name), name).expect("a file");
        ["a.ply", "b.ply", "own.txt"].into_iter().for_each(write);
        let listed = |names: &[&str]| {
            FrameFolder::fill(folder, FrameKind::Splats, |_| Ok(((), list(names)))).expect("a list");
        };
        listed(&["a.ply", "b.ply", "../own.txt"]);
        let refused = FrameFolder::fill(folder, FrameKind::Images, |_| Ok(((), list(&[]))));
        let refused = refused.expect_err("refused").to_string();
        assert!(refused.contains("a.ply") && refused.ends_with(&folder.display().to_string()), "{refused}");
        let filled = FrameFolder::fill(folder, FrameKind::Splats, |new| {
            std::fs::write(new.path("b.ply"), "new").expect("a file");
            let old = std::fs::read_to_string(folder.join("b.ply")).expect("a file");
            assert!(folder.join("a.ply").exists() && old == "b.ply", "until the new ones are there");
            Ok(((), list(&["b.ply"])))
        });
        filled.expect("finished");
        let there = ["a.ply", "b.ply", "own.txt"].map(|name| folder.join(name).exists());
        assert_eq!(there, [false, true, true]);
    }

    #[test]
    fn frames_before_an_error_are_kept_and_it_says_where() {
        let dir = tempfile::tempdir().expect("a folder");
        let folder = dir.path();
        let image = |width| Image::filled(width, 1, [0.5; 3]);
        let filled: Result<()> = FrameFolder::fill(folder, FrameKind::Images, |new| {
            write_png(&new.path("a.png"), &image(1))?;
            write_png(&new.path("b.png"), &image(0))?;
            Ok(((), list(&[])))
        });
        let error = super::super::failure::chain(&filled.expect_err("an image without pixels"));
        let (kept, failed) = (folder.join("unfinished"), folder.join("b.png"));
        assert!(error.starts_with(&format!("1 finished file is kept in {}", kept.display())), "{error}");
        assert!(error.ends_with(&failed.display().to_string()), "{error}");
        assert!(kept.join("a.png").exists() && !folder.join("frames.json").exists());
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_to_no_input_and_into_no_dataset() {
        let dir = tempfile::tempdir().expect("a folder");
        let (input, link) = (dir.path().join("frames"), dir.path().join("link"));
        std::fs::create_dir_all(input.join("train")).expect("folders");
        std::os::unix::fs::symlink(&input, &link).expect("a link");
        assert!(refuse_inside_input(&link, &input).is_err());
        assert!(refuse_inside_input(&link.join("new/one.ply"), &input).is_err());
        assert!(refuse_inside_input(&dir.path().join("frames-2"), &input).is_ok());
        std::fs::write(input.join("transforms_train.json"), "{}").expect("a file");
        std::os::unix::fs::symlink(input.join("train"), dir.path().join("images")).expect("a link");
        assert!(refuse_inside_dataset(&dir.path().join("images/x.png")).is_err());
    }
}
