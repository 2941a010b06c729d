//! Where results go: stdout, and files in a folder of the user's.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use lgs_core::Image;
use lgs_data::dataset::DatasetFormat;
use lgs_data::files::{FileError, write_atomically};

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
    let absolute = std::path::absolute(out).at(out)?;
    for folder in absolute.ancestors().filter(|f| !f.as_os_str().is_empty()) {
        if DatasetFormat::detect(folder).is_some() {
            bail!("the output would be inside a dataset; choose another folder: {}", out.display());
        }
    }
    Ok(())
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

/// Removes what an earlier call wrote into a folder of frames, so that old and new frames never mix. Other
/// files stay.
pub(crate) fn remove_listed(folder: &Path) -> Result<()> {
    let path = folder.join(MANIFEST);
    let Ok(text) = std::fs::read(&path) else { return Ok(()) };
    let list: serde_json::Value = serde_json::from_slice(&text).unwrap_or_default();
    let names = list["frames"].as_array().into_iter().flatten().filter_map(|frame| frame["file"].as_str());
    for name in names.map(PathBuf::from).filter(|name| name.components().count() == 1) {
        match std::fs::remove_file(folder.join(&name)) {
            Err(e) if e.kind() != ErrorKind::NotFound => {
                return Err(FileError::new("remove file", &folder.join(name), e).into());
            }
            _ => {}
        }
    }
    Ok(std::fs::remove_file(&path).map_err(|e| FileError::new("remove file", &path, e))?)
}

/// Writes the list of a folder's frames.
pub(crate) fn write_list(folder: &Path, list: &serde_json::Value) -> Result<()> {
    let path = folder.join(MANIFEST);
    write_atomically(&path, |w| writeln!(w, "{list:#}")).at(&path)
}
