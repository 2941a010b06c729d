//! Gaussians for what some image shows and the model lacks (method §3.4).
//!
//! A round looks at an image and at those nearest to it in time. Along the ray of a block that lacks
//! something it tries depths, and takes the one where most of the other images that see the place lack the
//! same colour there. What it proposes is faint: the images make it visible, or it dies.

use lgs_core::linear::{add, scale, sub};
use lgs_core::{GaussianCloud, stream};
use lgs_data::dataset::{Dataset, Frame, SceneBox};
use lgs_render::{Splats, rasterize};
use rand::RngExt;
use rand::seq::SliceRandom;

use super::initial::gaussians_at;
use super::lacking::Blocks;
use crate::cameras::RefinedCameras;
use crate::thresholds::{
    AGREEING_COLOR, AGREEING_IMAGES, COMPANIONS, DEPTHS, INVERSION_TURNS, LOOKS, MISPLACED, PROPOSED_SCALE,
};

/// Where proposals are looked for.
pub(super) struct Proposals<'a> {
    frames: &'a [Frame],
    background: [f32; 3],
    bounds: SceneBox,
    seed: u64,
}

/// A round of proposals: which frames may be seen, and how many Gaussians may be proposed.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProposalRound<'a> {
    /// Iteration, from 1.
    pub(super) iteration: usize,
    /// Last time whose frames are used by now.
    pub(super) last_time: f32,
    /// Most Gaussians.
    pub(super) count: usize,
    /// Degree of their colours.
    pub(super) sh_degree: usize,
    /// The training cameras as they are known by now; nothing where they are as the dataset gives them.
    pub(super) cameras: Option<&'a RefinedCameras>,
}

/// The model as it is now.
pub(super) trait Posed {
    /// Its Gaussians at a time.
    fn at(&self, time: f32) -> GaussianCloud;
    /// Where canonical positions are at a time.
    fn moved(&self, canonical: &GaussianCloud, time: f32) -> Vec<[f32; 3]>;
}

impl<'a> Proposals<'a> {
    /// Looks at the training images of a dataset.
    pub(super) fn new(dataset: &'a Dataset, seed: u64) -> Self {
        let (frames, bounds) = (dataset.split("train"), dataset.scene_box());
        Self { frames, background: dataset.background, bounds, seed }
    }

    /// Canonical Gaussians for what a round finds lacking.
    pub(super) fn find(&self, round: ProposalRound<'_>, model: &dyn Posed) -> GaussianCloud {
        let _span = tracing::trace_span!("proposals").entered();
        let open: Vec<usize> =
            (0..self.frames.len()).filter(|&i| self.frames[i].time <= round.last_time).collect();
        let mut random = stream(self.seed, "proposals", round.iteration as u64);
        let looks = (0..LOOKS).filter_map(|_| {
            let anchor = *open.get(random.random_range(0..open.len().max(1)))?;
            Some((anchor, self.blocks(anchor, round.cameras, model)))
        });
        // The first of those that lack most.
        let worst = looks.reduce(
            |best, look| {
                if look.1.lacking().len() > best.1.lacking().len() { look } else { best }
            },
        );
        let Some((anchor, blocks)) = worst else { return GaussianCloud::default() };
        let mut lacking = blocks.lacking();
        if lacking.is_empty() {
            return GaussianCloud::default();
        }
        lacking.shuffle(&mut random);
        let companions = self.companions(anchor, &open).into_iter();
        let others: Vec<Blocks> = companions.map(|i| self.blocks(i, round.cameras, model)).collect();
        let found: Vec<(usize, [f32; 3])> = lacking
            .into_iter()
            .filter_map(|block| Some((block, place(&blocks, block, &others, self.bounds)?)))
            .take(round.count)
            .collect();
        canonical(&blocks, &found, (round.sh_degree, self.frames[anchor].time), model)
    }

    /// A frame beside what its camera, as it is known, would show, both in the colours of the scene.
    fn blocks(&self, index: usize, cameras: Option<&RefinedCameras>, model: &dyn Posed) -> Blocks {
        let mut frame = self.frames[index].clone();
        if let Some(cameras) = cameras {
            cameras.correct(&mut frame);
        }
        let cloud = model.at(frame.time);
        let mut drawn = rasterize(&Splats::from(&cloud), &frame.camera, self.background);
        let mut truth = frame.composited(self.background);
        if let Some(inverse) = frame.exposure.inverse() {
            let through: Vec<f32> = frame.alpha().iter().map(|alpha| 1.0 - alpha).collect();
            inverse.expose(&mut truth.pixels, &through, self.background);
        }
        frame.leave_out(&mut truth.pixels, self.background);
        frame.leave_out(&mut drawn.image, self.background);
        Blocks::new(frame.camera, &truth, &drawn.image)
    }

    /// The images nearest in time to one, of other cameras than its own, one of each camera.
    fn companions(&self, anchor: usize, open: &[usize]) -> Vec<usize> {
        let frame = &self.frames[anchor];
        let distance = |i: usize| (self.frames[i].time - frame.time).abs();
        let mut nearest = open.to_vec();
        nearest.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
        let mut seen = std::collections::BTreeSet::from([frame.camera_id]);
        nearest.retain(|&i| seen.insert(self.frames[i].camera_id));
        nearest.truncate(COMPANIONS);
        nearest
    }
}

/// The place on the ray of a block where most of the other images that see it lack the block's colour: the
/// middle of the stretch of such places; nothing if fewer agree than have to.
fn place(blocks: &Blocks, block: usize, others: &[Blocks], bounds: SceneBox) -> Option<[f32; 3]> {
    let (eye, direction) = blocks.ray(block);
    let color = blocks.color(block);
    let reach = 3.0_f32.sqrt() * bounds.half_side;
    let middle = lgs_core::linear::dot(sub(bounds.center, eye), direction);
    let at = |index: usize| {
        let part = 2.0 * (index as f32 + 0.5) / DEPTHS as f32 - 1.0;
        add(eye, scale(direction, middle + part * reach))
    };
    let votes: Vec<usize> = (0..DEPTHS).map(|index| agreeing(at(index), color, others, bounds)).collect();
    let most = votes.iter().copied().max().filter(|&most| most > 0)?;
    let first = votes.iter().position(|&v| v == most)?;
    let length = votes[first..].iter().take_while(|&&v| v == most).count();
    let point = at(first + length / 2);
    blocks.seen_in(point).map(|_| point)
}

/// How many images lack a colour at a point; 0 if these are too few, or too few of those that see it.
fn agreeing(point: [f32; 3], color: [f32; 3], others: &[Blocks], bounds: SceneBox) -> usize {
    if (0..3).any(|i| (point[i] - bounds.center[i]).abs() > bounds.half_side) {
        return 0;
    }
    let (mut seen, mut agree) = (0, 0);
    for other in others {
        let Some(block) = other.seen_in(point) else { continue };
        seen += 1;
        let apart = sub(other.color(block), color).into_iter().fold(0.0_f32, |most, d| most.max(d.abs()));
        agree += usize::from(other.is_lacking(block) && apart < AGREEING_COLOR);
    }
    if agree >= AGREEING_IMAGES.min(others.len()) && 3 * agree >= 2 * seen { agree } else { 0 }
}

/// Canonical Gaussians that are at the found places at a time, by fixed-point iteration of the motion; those
/// that it does not bring there are left out.
fn canonical(
    blocks: &Blocks,
    found: &[(usize, [f32; 3])],
    (sh_degree, time): (usize, f32),
    model: &dyn Posed,
) -> GaussianCloud {
    if found.is_empty() {
        return GaussianCloud::default();
    }
    let places: Vec<[f32; 3]> = found.iter().map(|&(_, place)| place).collect();
    let colors: Vec<[f32; 3]> = found.iter().map(|&(block, _)| blocks.color(block)).collect();
    let widths: Vec<f32> = places.iter().map(|&place| PROPOSED_SCALE * blocks.width_at(place)).collect();
    let log_scales: Vec<f32> = widths.iter().map(|width| width.ln()).collect();
    let mut cloud = gaussians_at(places.clone(), &colors, &log_scales, sh_degree);
    let mut misses = vec![0.0; places.len()];
    for _ in 0..INVERSION_TURNS {
        let moved = model.moved(&cloud, time);
        for (i, mean) in cloud.means.iter_mut().enumerate() {
            let miss = sub(places[i], moved[i]);
            misses[i] = lgs_core::linear::norm(miss) / widths[i];
            *mean = add(*mean, miss);
        }
    }
    let hits: Vec<usize> = (0..misses.len()).filter(|&i| misses[i] < MISPLACED).collect();
    cloud.select(&hits)
}

#[cfg(test)]
mod tests;
