//! Frames drawn, marked, labelled, and written into a folder or a video.

use std::path::Path;

use anyhow::Result;
use lgs_core::{Camera, GaussianCloud, Image};
use lgs_dynamics::{Edit, Reversal};
use lgs_eval::laws::Trust;
use lgs_model::{LagrangianScene, Motion};
use lgs_report::sheet::{Row, contact_sheet, evenly};
use serde_json::json;

use super::compare::{Beside, Other};
use super::frames::{file_name, sweep_in_order};
use super::output::{FrameFolder, FrameKind, prepare_folder, write_png};
use super::trust::{Mark, ModelName, listed};
use super::video::{Film, Target};

/// Columns of the contact sheet.
const SHEET_COLUMNS: usize = 8;

/// Frames to render: one camera per time, one motion.
pub(super) struct Job {
    pub(super) model: ModelName,
    pub(super) times: Vec<f32>,
    pub(super) cameras: Vec<Camera>,
    pub(super) edit: Edit,
    pub(super) reversal: Reversal,
    pub(super) trust: Trust,
    pub(super) mark: Mark,
    pub(super) label: Label,
}

/// What is written over a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Label {
    /// Names, where two frames stand side by side.
    #[default]
    Names,
    /// The time as well.
    Times,
}

/// What a frame shows.
struct Shot {
    cloud: GaussianCloud,
    beside: Option<Beside>,
}

/// A motion before its background, and what stands beside it.
pub(super) struct Subject<'a, 'b> {
    /// Gaussians at a time.
    pub(super) cloud_at: &'a mut (dyn FnMut(f32) -> GaussianCloud + 'a),
    pub(super) background: [f32; 3],
    pub(super) other: &'a mut Other<'b>,
}

impl Job {
    /// Renders all frames of a Lagrangian scene into a folder; returns the images. States are cached, so that
    /// the frames cost one rollout.
    pub(super) fn write(&self, scene: &LagrangianScene, out: &Path) -> Result<Vec<Image>> {
        let mut motion = Motion::new(scene, self.edit, self.reversal);
        let mut cloud_at = |time| scene.cloud_at(&motion.state_at(time), time);
        prepare_folder(out)?;
        let (background, mut other) = (scene.background, Other::Nothing);
        self.folder(Subject { cloud_at: &mut cloud_at, background, other: &mut other }, out)
    }

    /// Renders all frames of anything that has a cloud at every time; returns what was written, in words.
    pub(super) fn make(&self, subject: Subject<'_, '_>, target: &Target) -> Result<String> {
        Ok(match target {
            Target::Folder(out) => format!("{} images", self.folder(subject, out)?.len()),
            Target::Picture(path) => {
                self.drawn(subject, |_, image| write_png(path, image))?;
                "an image".to_owned()
            }
            Target::Film(film) => {
                let bytes = self.film(subject, film)?;
                format!("a video of {} frames, {:.0} kB", self.times.len(), bytes as f64 / 1e3)
            }
        })
    }

    /// Writes frames, the list of them and a contact sheet.
    fn folder(&self, subject: Subject<'_, '_>, out: &Path) -> Result<Vec<Image>> {
        FrameFolder::fill(out, FrameKind::Images, |frames| {
            let write = |index: usize, image: &Image| {
                write_png(&frames.path(&file_name(index, self.times[index], "png")), image)
            };
            let images = self.drawn(subject, write)?;
            write_png(&frames.path("sheet.png"), &self.sheet(&images))?;
            Ok((images, self.list()))
        })
    }

    /// Draws all frames, and hands each with its number on as soon as it is done.
    fn drawn(
        &self,
        subject: Subject<'_, '_>,
        write: impl Fn(usize, &Image) -> Result<()> + Sync,
    ) -> Result<Vec<Image>> {
        let mut images = Vec::with_capacity(self.times.len());
        let draw = self.drawer(subject.background, subject.other.name());
        let work = |index: usize, shot: &Shot| {
            let image = draw(index, shot);
            write(index, &image)?;
            Ok(image)
        };
        let take = |image| {
            images.push(image);
            Ok(())
        };
        sweep_in_order("rendering", self.times.len(), self.shots(subject), work, take)?;
        Ok(images)
    }

    /// Encodes each frame as it is done; returns the size of the file, bytes.
    fn film(&self, subject: Subject<'_, '_>, film: &Film) -> Result<usize> {
        let mut video = film.begin(self.size(subject.other.name()))?;
        let draw = self.drawer(subject.background, subject.other.name());
        let work = |index: usize, shot: &Shot| Ok(draw(index, shot));
        let take = |image: Image| film.push(&mut *video, &image);
        sweep_in_order("rendering", self.times.len(), self.shots(subject), work, take)?;
        film.finish(video)
    }

    fn shots(&self, Subject { cloud_at, other, .. }: Subject<'_, '_>) -> impl FnMut(usize) -> Result<Shot> {
        move |index| {
            let time = self.times[index];
            Ok(Shot { cloud: cloud_at(time), beside: other.at(time) })
        }
    }

    /// Draws one frame with all that stands beside and over it.
    fn drawer(
        &self,
        background: [f32; 3],
        other: Option<&'static str>,
    ) -> impl Fn(usize, &Shot) -> Image + Sync {
        move |index, shot| {
            let (camera, time) = (&self.cameras[index], self.times[index]);
            let render = |cloud: &GaussianCloud| lgs_eval::render(cloud, camera, background).image;
            let mut image = render(&shot.cloud);
            self.mark.apply(&self.trust, time, &mut image);
            let beside = shot.beside.as_ref().map(|beside| match beside {
                Beside::Cloud(cloud) => (render(cloud), time),
                Beside::Image(image, own) => (image.resampled(camera.width, camera.height), *own),
            });
            self.composed((image, time), beside.zip(other))
        }
    }

    /// A frame, what stands beside it, and their labels as one image.
    fn composed(&self, (image, time): (Image, f32), beside: Option<((Image, f32), &str)>) -> Image {
        let own = beside.as_ref().map(|_| self.model.label(self.edit));
        let label = |name: Option<&str>, time: f32| {
            let time = (self.label == Label::Times).then(|| time_label(time));
            name.map(str::to_owned).into_iter().chain(time).collect::<Vec<_>>().join(", ")
        };
        if beside.is_none() && self.label == Label::Names {
            return image;
        }
        let (mut labels, mut frames) = (vec![label(own, time)], vec![image]);
        if let Some(((image, time), name)) = beside {
            labels.push(label(Some(name), time));
            frames.push(image);
        }
        contact_sheet(&labels, &[Row { title: String::new(), frames }])
    }

    /// Width and height of a frame with all that stands beside and over it.
    fn size(&self, other: Option<&str>) -> [u32; 2] {
        let Some(camera) = self.cameras.first() else { return [0; 2] };
        let blank = Image::filled(camera.width, camera.height, [0.0; 3]);
        let beside = other.map(|name| ((blank.clone(), 0.0), name));
        let frame = self.composed((blank, 0.0), beside);
        [frame.width, frame.height]
    }

    fn list(&self) -> serde_json::Value {
        let frame = |(index, &time): (usize, &f32)| listed(&file_name(index, time, "png"), time, &self.trust);
        json!({
            "velocity_scale": self.edit.velocity_scale,
            "potential_scale": self.edit.potential_scale,
            "force_scale": self.edit.force_scale,
            "reversal": self.reversal,
            "frames": self.times.iter().enumerate().map(frame).collect::<Vec<_>>(),
        })
    }

    fn sheet(&self, images: &[Image]) -> Image {
        let chosen = evenly(images.len(), SHEET_COLUMNS);
        let labels: Vec<String> = chosen.iter().map(|&i| time_label(self.times[i])).collect();
        contact_sheet(
            &labels,
            &[Row { title: String::new(), frames: chosen.iter().map(|&i| images[i].clone()).collect() }],
        )
    }
}

/// A time over a column of a contact sheet.
pub(super) fn time_label(time: f32) -> String {
    format!("t = {time:.2}")
}
