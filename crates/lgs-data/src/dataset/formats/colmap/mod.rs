//! COLMAP's sparse models: `cameras`, `images` and `points3D` as `.bin` or `.txt` in `sparse/0`, `sparse`,
//! `colmap/sparse/0` or the folder itself, and the images in `images/`.
//!
//! An image's time is its row in `times.csv` (image, time) where there is one; else it follows from the
//! number of its folder or in its name (`frame_0007/cam03.png`, `cam03/0007.png`). Without any number all
//! images are of one moment. The folder of an image's name is its camera's name, unless folders are times.
//! Every eighth camera is in the split `val` where cameras have names, else every eighth image.

mod binary;
mod model;
mod text;

use super::csv_times;
use super::hold_out;
use super::reader::{FormatReader, Label};
use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::{FrameSpec, SizeRule};
use crate::dataset::{poses, times};
use crate::files;
use crate::ply::Points;
use glam::{DMat3, DQuat, DVec3};
use model::{ColmapCamera, ColmapImage};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

pub(super) struct Colmap;

impl FormatReader for Colmap {
    fn label(&self) -> Label {
        Label { name: "colmap", marker: "`sparse/0/images.bin`" }
    }

    fn is_at(&self, root: &Path) -> bool {
        Sparse::at(root).is_some()
    }

    fn splits(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        Ok(hold_out::splits(&Sparse::of(root)?.frames(root)?))
    }

    fn split_file(&self, root: &Path, _: &str) -> PathBuf {
        Sparse::at(root).map_or_else(|| root.join("sparse/0/images.bin"), |sparse| sparse.file("images"))
    }

    fn sources(&self, root: &Path, _: &str) -> Vec<PathBuf> {
        let Some(sparse) = Sparse::at(root) else { return Vec::new() };
        let csv = Some(csv_times::file_of(root)).filter(|path| path.exists());
        [sparse.file("cameras"), sparse.file("images")].into_iter().chain(csv).collect()
    }

    fn frames(&self, root: &Path, split: &str) -> Result<Vec<FrameSpec>, DatasetError> {
        let sparse = Sparse::of(root)?;
        hold_out::of_split(sparse.frames(root)?, split, &sparse.file("images"))
    }

    fn points(&self, root: &Path) -> Result<Option<Points>, DatasetError> {
        let sparse = Sparse::of(root)?;
        if !sparse.file("points3D").exists() {
            return Ok(None);
        }
        let points = sparse.read("points3D", text::points, binary::points)?;
        Ok(Some(points).filter(|points| !points.positions.is_empty()))
    }

    fn remarks(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        let sparse = Sparse::of(root)?;
        let (cameras, images) = sparse.model()?;
        let used: BTreeSet<u32> = images.iter().map(|image| image.camera_id).collect();
        let unused = cameras.keys().filter(|id| !used.contains(id)).count();
        let known: BTreeSet<PathBuf> = images.iter().map(|i| image_folder(root).join(&i.name)).collect();
        let mut found = Vec::new();
        super::views::images_below(&image_folder(root), &mut found);
        let unposed = found.iter().filter(|path| !known.contains(*path)).count();
        let note = |count: usize, what: &str| (count > 0).then(|| format!("{count} {what}"));
        let notes =
            [note(unused, "cameras have no image"), note(unposed, "images in `images` have no camera")];
        Ok(notes.into_iter().flatten().collect())
    }
}

fn image_folder(root: &Path) -> PathBuf {
    ["images", "colmap/images"]
        .map(|name| root.join(name))
        .into_iter()
        .find(|path| path.is_dir())
        .unwrap_or_else(|| root.join("images"))
}

/// Where the files of a model are, and their extension.
struct Sparse {
    folder: PathBuf,
    extension: &'static str,
}

impl Sparse {
    fn at(root: &Path) -> Option<Self> {
        let folders = ["sparse/0", "sparse", "colmap/sparse/0", "colmap/sparse", ""];
        let all = folders.iter().flat_map(|folder| ["bin", "txt"].map(|e| (root.join(folder), e)));
        let mut all = all.map(|(folder, extension)| Self { folder, extension });
        all.find(|sparse| sparse.file("cameras").is_file() && sparse.file("images").is_file())
    }

    fn of(root: &Path) -> Result<Self, DatasetError> {
        let absent = || {
            let expected = "`cameras` and `images` as .bin or .txt in `sparse/0`".to_owned();
            DatasetError::new(root, Problem::NoFormat(expected))
        };
        Self::at(root).ok_or_else(absent)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.{}", self.extension))
    }

    fn read<T>(
        &self,
        name: &str,
        text: fn(&str) -> Result<T, Problem>,
        binary: fn(&[u8]) -> Result<T, Problem>,
    ) -> Result<T, DatasetError> {
        let path = self.file(name);
        let bytes = files::read_bytes(&path)?;
        let contents = if self.extension == "bin" {
            binary(&bytes)
        } else {
            let no_text = |_| Problem::Malformed("expected text in UTF-8".to_owned());
            std::str::from_utf8(&bytes).map_err(no_text).and_then(text)
        };
        contents.map_err(|problem| DatasetError::new(&path, problem))
    }

    fn model(&self) -> Result<(BTreeMap<u32, ColmapCamera>, Vec<ColmapImage>), DatasetError> {
        let cameras = self.read("cameras", text::cameras, binary::cameras)?;
        let mut images = self.read("images", text::images, binary::images)?;
        if images.is_empty() {
            return Err(DatasetError::new(&self.file("images"), Problem::Empty));
        }
        images.sort_by(|a, b| a.name.cmp(&b.name));
        Ok((cameras.into_iter().map(|camera| (camera.id, camera)).collect(), images))
    }

    /// All frames, by name.
    fn frames(&self, root: &Path) -> Result<Vec<FrameSpec>, DatasetError> {
        let (cameras, images) = self.model()?;
        let path = self.file("images");
        let times = times_of(root, &path, &images)?;
        let frame = |(index, (image, time)): (usize, (&ColmapImage, f64))| {
            let spec = spec(&cameras, image, root);
            let spec = spec.map_err(|problem| DatasetError::new(&path, problem))?;
            Ok(FrameSpec { index, time: time as f32, described_in: path.clone(), ..spec })
        };
        images.iter().zip(times).enumerate().map(frame).collect()
    }
}

fn times_of(root: &Path, path: &Path, images: &[ColmapImage]) -> Result<Vec<f64>, DatasetError> {
    let names: Vec<&str> = images.iter().map(|image| image.name.as_str()).collect();
    if csv_times::file_of(root).exists() {
        return csv_times::of_names(root, &names);
    }
    let numbers: Vec<Option<u64>> = names.iter().map(|name| times::frame_number(name)).collect();
    if numbers.iter().all(Option::is_none) {
        return Ok(vec![0.0; images.len()]);
    }
    let timeless = |name: &str| {
        let problem = Problem::Part {
            part: format!("image `{name}`"),
            field: "time",
            expected: "a number in its name, or a row in times.csv".to_owned(),
            found: "neither".to_owned(),
        };
        DatasetError::new(path, problem)
    };
    let times = times::of_numbers(&numbers);
    times.into_iter().zip(&names).map(|(time, name)| time.ok_or_else(|| timeless(name))).collect()
}

fn spec(
    cameras: &BTreeMap<u32, ColmapCamera>,
    image: &ColmapImage,
    root: &Path,
) -> Result<FrameSpec, Problem> {
    let part = |field, expected: &str, found: String| Problem::Part {
        part: format!("image `{}`", image.name),
        field,
        expected: expected.to_owned(),
        found,
    };
    let camera = cameras.get(&image.camera_id).ok_or_else(|| {
        part("camera id", "that of a camera in the file of cameras", image.camera_id.to_string())
    })?;
    let [w, x, y, z] = image.rotation;
    let quaternion = DQuat::from_xyzw(x, y, z, w);
    if !(quaternion.length() > 0.5 && quaternion.length() < 2.0) {
        return Err(part("rotation", "a unit quaternion", format!("{:?}", image.rotation)));
    }
    let pose = poses::rigid(DMat3::from_quat(quaternion.normalize()), DVec3::from(image.translation))
        .map_err(|(expected, found)| part("translation", expected, found))?;
    let in_folder = Path::new(&image.name).parent().and_then(Path::to_str).filter(|f| !f.is_empty());
    let by_name = times::frame_number(&image.name) == times::last_number(&image.name);
    Ok(FrameSpec {
        name: format!("images/{}", image.name),
        image_path: image_folder(root).join(&image.name),
        view: in_folder.filter(|_| by_name).map(str::to_owned),
        camera_from_world: pose.as_mat4(),
        own: camera.intrinsics,
        lens: camera.lens,
        size_rule: SizeRule::Exact,
        ..FrameSpec::default()
    })
}

#[cfg(test)]
mod tests;
