//! Tests of proposals.

use super::*;
use crate::cameras::RefinedCamera;
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
    let (mut both, blue) = (ball([-0.6, 0.0, 0.2], [0.9, 0.1, 0.1]), ball([0.5, 0.3, -0.2], [0.1, 0.2, 0.9]));
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

const ROUND: ProposalRound<'_> =
    ProposalRound { iteration: 100, last_time: 0.2, count: 8, sh_degree: 1, cameras: None };

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
fn what_cameras_make_of_colors_is_no_lack_once_it_is_known() {
    let mut frames = frames();
    let model = Shifted(GaussianCloud::isotropic(vec![[0.0; 3]], 4.0, [0.85; 3], 0.99));
    let mut refined = RefinedCameras::default();
    for frame in &mut frames {
        let gain = 0.7 + 0.01 * frame.camera_id as f32;
        let exposure = Exposure { gain: [gain, gain, 0.7], offset: [0.0, 0.02, 0.0] };
        let drawn = rasterize(&Splats::from(&model.at(frame.time)), &frame.camera, [1.0; 3]);
        let mut image = drawn.to_image();
        exposure.expose(&mut image.pixels, &drawn.transmittance, [1.0; 3]);
        let bytes = |p: &[f32; 3]| [p[0], p[1], p[2], 1.0].map(|c| (255.0 * c.clamp(0.0, 1.0)) as u8);
        frame.pixels = image.pixels.iter().flat_map(bytes).collect::<Vec<u8>>().into();
        let given = frame.camera.camera_from_world;
        refined.cameras.push(RefinedCamera { given, motion: [0.0; 6], exposure, pixels: 0.0 });
    }
    let proposals = proposals(&frames);
    assert!(!proposals.find(ROUND, &model).is_empty(), "cameras as given show other colours");
    assert!(proposals.find(ProposalRound { cameras: Some(&refined), ..ROUND }, &model).is_empty());
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
