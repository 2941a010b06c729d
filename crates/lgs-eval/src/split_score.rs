//! Both models against the images of a split.
//!
//! Frames are grouped by time, so that a cloud is computed once per time, and a few frames are rendered
//! together to keep all processors busy while memory stays bounded. LPIPS then takes one frame after another,
//! each on all processors, as its layers need much memory. Every frame's score is computed by itself and sums
//! run in frame order: the number of threads changes nothing.

use lgs_core::{GaussianCloud, Image, psnr_of_mse};
use lgs_data::dataset::{Dataset, Frame};
use lgs_model::source::SourceModel;
use lgs_model::{LagrangianScene, Motion};
use rayon::prelude::*;

use crate::finite::finite;
use crate::image_score::{ForegroundRule, ImageScore, Picture, Scoring, score};
use crate::lpips::PerceptualScore;
use crate::metrics::SplitScore;
use crate::render::render;
use crate::thresholds::{FRAMES_AT_ONCE, TIMES_AT_ONCE};

/// Scores of one frame.
#[derive(Clone, Debug)]
pub struct FrameRow {
    /// Place of the frame in its split.
    pub index: usize,
    /// Score of the source model, if there is one.
    pub source: Option<ImageScore>,
    /// Score of the Lagrangian scene.
    pub lagrangian: ImageScore,
}

/// The rule that fits a dataset: by opacity if any image has a transparent pixel.
#[must_use]
pub fn foreground_rule(dataset: &Dataset) -> ForegroundRule {
    let alpha = dataset.splits.values().flatten().any(Frame::has_alpha);
    if alpha { ForegroundRule::Opacity } else { ForegroundRule::Colour }
}

/// Scores all frames of a split, in their order; `done` is called once per frame.
#[must_use]
pub fn score_frames(
    source: Option<&dyn SourceModel>,
    (scene, motion): (&LagrangianScene, &mut Motion<'_>),
    frames: &[Frame],
    scoring: &Scoring<'_>,
    done: &(dyn Fn() + Sync),
) -> Vec<FrameRow> {
    let groups = frames_by_time(frames);
    let mut rows = Vec::with_capacity(frames.len());
    for chunk in groups.chunks(TIMES_AT_ONCE) {
        let mut jobs = Vec::new();
        for (time, members) in chunk {
            let lagrangian = scene.cloud_at(&motion.state_at(*time), *time);
            // Times that a source does not cover are not scored.
            jobs.push((lagrangian, source.filter(|s| s.covers(*time)).map(|s| s.cloud_at(*time)), members));
        }
        let views: Vec<View<'_>> = jobs
            .iter()
            .flat_map(|(l, s, members)| members.iter().map(move |&i| (l, s.as_ref(), i)))
            .collect();
        views.chunks(FRAMES_AT_ONCE).for_each(|views| rows.extend(score_views(views, frames, scoring, done)));
    }
    rows.sort_by_key(|row| row.index);
    rows
}

/// The clouds of both models at a frame's time, and the frame's index.
type View<'a> = (&'a GaussianCloud, Option<&'a GaussianCloud>, usize);

/// Scores views: drawn in parallel, then LPIPS one after another.
fn score_views(
    views: &[View<'_>],
    frames: &[Frame],
    scoring: &Scoring<'_>,
    done: &(dyn Fn() + Sync),
) -> Vec<FrameRow> {
    let drawn = |&(lagrangian, source, index): &View<'_>| {
        let pictures = Pictures::new(&frames[index], lagrangian, source, scoring);
        let row = pictures.row(index, scoring.rule);
        if scoring.perceptual.is_some() {
            return (row, Some(pictures));
        }
        done();
        (row, None)
    };
    let scored: Vec<(FrameRow, Option<Pictures>)> = views.par_iter().map(drawn).collect();
    let complete = |(mut row, pictures): (FrameRow, Option<Pictures>)| {
        if let (Some(pictures), Some(perceptual)) = (pictures, scoring.perceptual) {
            row.set_perceptual(&perceptual.score(&pictures.predictions(), &pictures.truth.image));
            done();
        }
        row
    };
    scored.into_iter().map(complete).collect()
}

impl FrameRow {
    /// Fills in LPIPS, in the order of [`Pictures::predictions`].
    fn set_perceptual(&mut self, scores: &[PerceptualScore]) {
        let models = std::iter::once(&mut self.lagrangian).chain(self.source.as_mut());
        models.zip(scores).for_each(|(model, score)| model.perceptual = *score);
    }
}

/// One frame: the truth and what both models draw.
struct Pictures {
    truth: Picture,
    lagrangian: Picture,
    source: Option<Picture>,
}

impl Pictures {
    fn new(
        frame: &Frame,
        lagrangian: &GaussianCloud,
        source: Option<&GaussianCloud>,
        scoring: &Scoring<'_>,
    ) -> Self {
        let background = scoring.background;
        let weights = frame.weights();
        let picture = |mut image: Image, opacity: &mut dyn Iterator<Item = f32>| {
            frame.leave_out(&mut image.pixels, background);
            let weight = |i: usize| weights.as_ref().map_or(1.0, |weights| weights[i]);
            Picture::new(&image, opacity.enumerate().map(|(i, o)| o * weight(i)), scoring)
        };
        let drawn = |cloud: &GaussianCloud| {
            let rendered = render(cloud, &frame.camera, background);
            let mut image = rendered.image.clone();
            frame.exposure.expose(&mut image.pixels, &rendered.transmittance, background);
            picture(image, &mut rendered.opacity())
        };
        let size = [frame.camera.width, frame.camera.height].map(|side| side as usize);
        let truth = picture(frame.composited(background), &mut frame.alpha().into_iter());
        let truth = truth.counting(weights.clone(), scoring, size);
        Self { truth, lagrangian: drawn(lagrangian), source: source.map(drawn) }
    }

    fn row(&self, index: usize, rule: ForegroundRule) -> FrameRow {
        let of = |picture: &Picture| score(picture, &self.truth, rule);
        FrameRow { index, source: self.source.as_ref().map(of), lagrangian: of(&self.lagrangian) }
    }

    fn predictions(&self) -> Vec<&Image> {
        std::iter::once(&self.lagrangian).chain(&self.source).map(|picture| &picture.image).collect()
    }
}

/// Indices of frames by time, times ascending.
fn frames_by_time(frames: &[Frame]) -> Vec<(f32, Vec<usize>)> {
    let mut order: Vec<usize> = (0..frames.len()).collect();
    order.sort_by(|&a, &b| frames[a].time.total_cmp(&frames[b].time).then(a.cmp(&b)));
    let mut groups: Vec<(f32, Vec<usize>)> = Vec::new();
    for index in order {
        let time = frames[index].time;
        match groups.last_mut() {
            Some((last, members)) if last.to_bits() == time.to_bits() => members.push(index),
            _ => groups.push((time, vec![index])),
        }
    }
    groups
}

/// Means over the frames of a split; nothing for no frames.
#[must_use]
pub fn aggregate(scores: &[ImageScore]) -> Option<SplitScore> {
    let mean = |values: Vec<f64>| finite(values.iter().sum::<f64>() / values.len() as f64);
    let mse = mean(scores.iter().map(|s| s.mse).collect())?;
    let perceptual = |pick: fn(&PerceptualScore) -> Option<f64>| {
        mean(scores.iter().filter_map(|s| pick(&s.perceptual)).collect())
    };
    Some(SplitScore {
        psnr: mean(scores.iter().map(|s| s.psnr).collect()),
        psnr_of_mean_mse: Some(psnr_of_mse(mse)),
        psnr_foreground: mean(scores.iter().filter_map(|s| s.psnr_foreground).collect()),
        psnr_content: mean(scores.iter().filter_map(|s| s.psnr_content).collect()),
        psnr_silhouette: mean(scores.iter().filter_map(|s| s.psnr_silhouette).collect()),
        psnr_fitted: mean(scores.iter().map(|s| s.psnr_fitted).collect()),
        ssim: mean(scores.iter().map(|s| s.ssim).collect()),
        lpips_vgg: perceptual(|p| p.vgg),
        lpips_vgg_unnormalised: perceptual(|p| p.vgg_unnormalised),
        lpips_alex: perceptual(|p| p.alex),
        frames: scores.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_mse(mse: f64, foreground: Option<f64>) -> ImageScore {
        let psnr = psnr_of_mse(mse);
        ImageScore {
            mse,
            psnr,
            psnr_foreground: foreground,
            psnr_content: None,
            psnr_silhouette: None,
            psnr_fitted: psnr,
            ssim: 0.5,
            perceptual: PerceptualScore { alex: foreground, ..PerceptualScore::default() },
            predicted_pixels: 0,
            true_pixels: 0,
        }
    }

    #[test]
    fn the_mean_of_psnr_and_the_psnr_of_the_mean_differ() {
        let split = aggregate(&[with_mse(1e-2, Some(10.0)), with_mse(1e-4, None)]).expect("split");
        assert!((split.psnr.expect("psnr") - 30.0).abs() < 1e-9);
        assert!((split.psnr_of_mean_mse.expect("psnr") - -10.0 * (0.00505_f64).log10()).abs() < 1e-9);
        assert_eq!(split.psnr_foreground, Some(10.0), "frames without foreground do not count");
        assert_eq!((split.frames, split.lpips_alex, split.lpips_vgg), (2, Some(10.0), None));
    }

    #[test]
    fn no_frames_have_no_score() {
        assert_eq!(aggregate(&[]), None);
    }
}
