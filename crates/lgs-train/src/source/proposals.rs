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
pub(super) struct ProposalRound {
    /// Iteration, from 1.
    pub(super) iteration: usize,
    /// Last time whose frames are used by now.
    pub(super) last_time: f32,
    /// Most Gaussians.
    pub(super) count: usize,
    /// Degree of their colours.
    pub(super) sh_degree: usize,
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
    pub(super) fn find(&self, round: ProposalRound, model: &dyn Posed) -> GaussianCloud {
        let _span = tracing::trace_span!("proposals").entered();
        let open: Vec<usize> =
            (0..self.frames.len()).filter(|&i| self.frames[i].time <= round.last_time).collect();
        let mut random = stream(self.seed, "proposals", round.iteration as u64);
        let looks = (0..LOOKS).filter_map(|_| {
            let anchor = *open.get(random.random_range(0..open.len().max(1)))?;
            Some((anchor, self.blocks(anchor, model)))
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
        let others: Vec<Blocks> =
            self.companions(anchor, &open).into_iter().map(|i| self.blocks(i, model)).collect();
        let found: Vec<(usize, [f32; 3])> = lacking
            .into_iter()
            .filter_map(|block| Some((block, place(&blocks, block, &others, self.bounds)?)))
            .take(round.count)
            .collect();
        canonical(&blocks, &found, (round.sh_degree, self.frames[anchor].time), model)
    }

    fn blocks(&self, index: usize, model: &dyn Posed) -> Blocks {
        let frame = &self.frames[index];
        let cloud = model.at(frame.time);
        let mut drawn = rasterize(&Splats::from(&cloud), &frame.camera, self.background);
        let mut truth = frame.composited(self.background);
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
mod tests {
    use super::*;
    use lgs_core::{Camera, Exposure};

    /// A model of two Gaussians of which one is missing, moved by a shift that grows with time.
    struct Shifted(GaussianCloud);

    fn shift(time: f32) -> [f32; 3] {
        [0.4 * time, 0.0, 0.2 * time]
    }

    impl Posed for Shifted {
        fn at(&self, time: f32) -> GaussianCloud {
            let means = self.moved(&self.0, time);
            GaussianCloud { means, ..self.0.clone() }
        }

        fn moved(&self, canonical: &GaussianCloud, time: f32) -> Vec<[f32; 3]> {
            // Not a mere shift, so that its inverse takes some turns.
            let stretched = |p: &[f32; 3]| add(add(*p, shift(time)), scale(*p, 0.3 * time));
            canonical.means.iter().map(stretched).collect()
        }
    }

    fn ball(center: [f32; 3], color: [f32; 3]) -> GaussianCloud {
        GaussianCloud::isotropic(vec![center], 0.15, color, 0.99)
    }

    /// Frames of one image per time, by turns of six cameras, that show two balls.
    fn frames() -> Vec<Frame> {
        let (mut both, blue) =
            (ball([-0.6, 0.0, 0.2], [0.9, 0.1, 0.1]), ball([0.5, 0.3, -0.2], [0.1, 0.2, 0.9]));
        both.means.extend(blue.means);
        both.rotations.extend(blue.rotations);
        both.log_scales.extend(blue.log_scales);
        both.raw_opacities.extend(blue.raw_opacities);
        both.sh.extend(blue.sh);
        let truth = Shifted(both);
        let frame = |i: usize| {
            let (angle, time) = (i as f32 * 2.4, i as f32 * 0.01);
            let eye = [3.5 * angle.cos(), 3.5 * angle.sin(), 1.2];
            let camera = Camera::look_at(eye, [0.0; 3], 0.7, 120, 120);
            let drawn = rasterize(&Splats::from(&truth.at(time)), &camera, [1.0; 3]);
            let byte = |c: f32| (255.0 * c.clamp(0.0, 1.0)) as u8;
            let rgba: Vec<u8> =
                drawn.image.iter().flat_map(|p| [byte(p[0]), byte(p[1]), byte(p[2]), 255]).collect();
            let (name, exposure) = (i.to_string(), Exposure::IDENTITY);
            Frame { name, camera_id: i % 6, camera, time, exposure, pixels: rgba.into() }
        };
        (0..30).map(frame).collect()
    }

    fn proposals(frames: &[Frame]) -> Proposals<'_> {
        let bounds = SceneBox { center: [0.0; 3], half_side: 1.3 };
        Proposals { frames, background: [1.0; 3], bounds, seed: 1 }
    }

    const ROUND: ProposalRound = ProposalRound { iteration: 100, last_time: 0.2, count: 8, sh_degree: 1 };

    #[test]
    fn a_ball_that_the_model_lacks_is_proposed_where_it_is_at_the_start() {
        let frames = frames();
        let model = Shifted(ball([-0.6, 0.0, 0.2], [0.9, 0.1, 0.1]));
        let found = proposals(&frames).find(ROUND, &model);
        assert_eq!((found.validate(), found.sh_degree), (Ok(()), 1));
        assert!(found.len() >= 4, "{}", found.len());
        for (mean, sh) in found.means.iter().zip(found.sh.chunks_exact(12)) {
            let miss = lgs_core::linear::norm(sub(*mean, [0.5, 0.3, -0.2]));
            assert!(miss < 0.4, "{mean:?} is {miss} away");
            assert!(sh[2] > sh[0], "blue");
        }
        assert_eq!(found, proposals(&frames).find(ROUND, &model), "the same draws");
    }

    #[test]
    fn nothing_is_proposed_where_nothing_is_missing() {
        let frames = frames();
        let mut both = ball([-0.6, 0.0, 0.2], [0.9, 0.1, 0.1]);
        let blue = ball([0.5, 0.3, -0.2], [0.1, 0.2, 0.9]);
        both.means.extend(blue.means);
        both.rotations.extend(blue.rotations);
        both.log_scales.extend(blue.log_scales);
        both.raw_opacities.extend(blue.raw_opacities);
        both.sh.extend(blue.sh);
        assert!(proposals(&frames).find(ROUND, &Shifted(both)).is_empty());
    }
}
