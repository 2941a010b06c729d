//! Things in flight (method §3.7): where many cameras see every moment, the paths that carry Gaussians of
//! what goes far for its size, and first Gaussians for these.

use lgs_core::Image;
use lgs_core::linear::{add, dot, norm, scale, sub};
use lgs_data::dataset::{Dataset, Frame, Points};
use lgs_model::source::{CarriedMotion, CarryingPath, SourceMotion};

use super::config::SourceConfig;
use super::config_groups::GuideConfig;
use crate::data_summary::DataSummary;
use crate::thresholds::{FEWEST_OF_THING, GUIDED_RADII, SHARE_OF_PIXELS};
use crate::tracks::{Track, find_flights};

/// The paths of things in flight that were followed from the first moment on, if the set shows its moments in
/// enough images for them to be found. What comes later has no place among canonical Gaussians.
pub(super) fn things_in_flight(dataset: &Dataset, config: &GuideConfig) -> Vec<Track> {
    let Some(data) = DataSummary::of(dataset) else { return Vec::new() };
    let is_sparse = (data.images as f32) < config.below_images_per_time * data.times as f32;
    if !config.flights || is_sparse || data.has_jumping_camera() {
        return Vec::new();
    }
    let first = first_time(dataset);
    let mut found = tracing::info_span!("things in flight")
        .in_scope(|| find_flights(dataset.split("train"), dataset.background));
    found.retain(|track| track.span().0 <= first);
    found
}

fn first_time(dataset: &Dataset) -> f32 {
    dataset.split("train").iter().map(|frame| frame.time).fold(f32::INFINITY, f32::min)
}

/// A motion with the Gaussians of things in flight carried along their paths, and those of balls whose
/// texture tells that they turn round turned on these as well.
pub(super) fn carried(
    motion: Box<dyn SourceMotion>,
    (things, tracks): (&[Track], &[Track]),
) -> Box<dyn SourceMotion> {
    let flying = things.iter().map(|thing| CarryingPath {
        places: thing.places(),
        flights: thing.flights.iter().map(|flight| flight.times).collect(),
        reach: GUIDED_RADII * thing.radius,
        spin: [0.0; 3],
    });
    let turning = tracks.iter().filter(|track| track.turns_round()).filter_map(|track| {
        let (places, reach) = (track.places(), GUIDED_RADII * track.radius);
        Some(CarryingPath { places, flights: Vec::new(), reach, spin: track.spin? })
    });
    let paths: Vec<CarryingPath> = flying.chain(turning).collect();
    if paths.is_empty() { motion } else { Box::new(CarriedMotion::new(motion, paths)) }
}

/// Points on the surfaces of things at the first moment, with the colours that the cameras see there: as many
/// for every pixel as the budget has Gaussians for those of an image.
pub(super) fn points_of(dataset: &Dataset, config: &SourceConfig, things: &[Track]) -> Points {
    let first = first_time(dataset);
    let frames: Vec<&Frame> = dataset.split("train").iter().filter(|frame| frame.time <= first).collect();
    let mut points = Points::default();
    if things.is_empty() {
        return points;
    }
    let images: Vec<Image> = frames.iter().map(|frame| frame.composited(dataset.background)).collect();
    for thing in things {
        let center = thing.position(first);
        let views = frames.iter().map(|frame| discs_of(frame, center, thing.radius));
        let pixels = views.clone().sum::<f32>() / views.len().max(1) as f32;
        let count = (per_pixel(dataset, config) * pixels) as usize;
        for normal in directions(count.max(FEWEST_OF_THING)) {
            let position = add(center, scale(normal, thing.radius));
            points.colors.push(color_at((&frames, &images), (position, normal)));
            points.positions.push(position);
        }
    }
    points
}

/// Gaussians for every pixel of an image.
fn per_pixel(dataset: &Dataset, config: &SourceConfig) -> f32 {
    let pixels = DataSummary::of(dataset).map_or(1.0, |data| data.pixels());
    match config.densify.max_gaussians {
        0 => SHARE_OF_PIXELS,
        budget => budget as f32 / pixels as f32,
    }
}

/// Pixels of the four discs that make up the surface of a ball, as a camera sees it.
fn discs_of(frame: &Frame, center: [f32; 3], radius: f32) -> f32 {
    let camera = &frame.camera;
    let depth = camera.pixel_from_world(center).1;
    if depth <= radius {
        return 0.0;
    }
    4.0 * std::f32::consts::PI * camera.fx * camera.fy * (radius / depth).powi(2)
}

/// Unit vectors spread evenly (a spiral by the golden angle).
fn directions(count: usize) -> impl Iterator<Item = [f32; 3]> {
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f32 / count as f32;
        let (across, angle) = ((1.0 - z * z).sqrt(), golden * i as f32);
        [across * angle.cos(), across * angle.sin(), z]
    })
}

/// The colour of a point of a surface in the view that faces it most.
fn color_at((frames, images): (&[&Frame], &[Image]), (point, normal): ([f32; 3], [f32; 3])) -> [f32; 3] {
    let seen = |(index, frame): (usize, &&Frame)| {
        let camera = &frame.camera;
        let to_eye = sub(camera.center_in_world(), point);
        let facing = dot(to_eye, normal) / norm(to_eye).max(f32::MIN_POSITIVE);
        let ([x, y], depth) = camera.pixel_from_world(point);
        let is_inside =
            depth > 0.0 && x >= 0.0 && y >= 0.0 && x < camera.width as f32 && y < camera.height as f32;
        is_inside.then(|| (facing, index, y as usize * camera.width as usize + x as usize))
    };
    let best = frames.iter().enumerate().filter_map(seen).max_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or([0.5; 3], |(_, index, pixel)| images[index].pixels[pixel])
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::GaussianCloud;
    use lgs_model::source::{Captured, InputFrame, Learned, SourceKind};

    use crate::device::DeviceName;
    use crate::driver::Trainer;
    use crate::source::SourceTrainer;
    use crate::tracks::testing::{MOMENTS, RADIUS, seen, thrown};

    fn dataset() -> Dataset {
        let splits = [("train".to_owned(), seen(thrown(0.25)))].into();
        Dataset { splits, ..Dataset::none([1.0; 3]) }
    }

    #[test]
    fn a_thrown_thing_is_carried_from_the_start_of_training() {
        let (dataset, spheres) = (dataset(), thrown(0.25));
        let trainer = SourceTrainer::new(&dataset, &SourceConfig::quick(), 1, &DeviceName::Cpu.device())
            .expect("a trainer");
        let model = trainer.model();
        let members: Vec<usize> = (0..model.len()).filter(|&i| model.carried()[i] == 1).collect();
        assert!(members.len() >= FEWEST_OF_THING && members.len() < trainer.status().gaussians / 2);
        for moment in [0, 8, 12, MOMENTS - 1] {
            let positions = model.positions_at(moment as f32 / 30.0);
            let center = members.iter().fold([0.0; 3], |sum, &i| add(sum, positions[i]));
            let off = norm(sub(scale(center, 1.0 / members.len() as f32), spheres(moment)[0].center));
            assert!(off < RADIUS, "moment {moment}: {off}");
        }
    }

    /// Where a Gaussian beside the middle of a ball that turns about z at a rate comes to in half of the
    /// window, by a motion that has learned nothing.
    fn turned(rate: f32) -> [f32; 3] {
        let times: Vec<f32> = (0..=20).map(|i| 0.05 * i as f32).collect();
        let mut ball = Track::through(&times, &[[1.0, 0.0, 0.0]; 21], 0.5).expect("a path");
        ball.spin = Some([0.0, 0.0, rate]);
        let config = SourceConfig { kind: SourceKind::Linear, ..SourceConfig::quick() };
        let captured = Captured { frame: InputFrame::IDENTITY, time_window: 1.0, seed: 1 };
        let moved = config.kind.motion(&config.motion(), captured).expect("a kind that is trained");
        let motion = carried(moved, (&[], &[ball]));
        let cloud = GaussianCloud::isotropic(vec![[1.2, 0.0, 0.0]], 0.1, [0.5; 3], 0.9);
        let parameters = vec![0.0; motion.parameters()];
        motion.model(Learned { cloud, features: Vec::new(), parameters }).positions_at(0.5)[0]
    }

    #[test]
    fn a_ball_that_turns_round_in_the_window_is_turned_and_one_that_does_not_is_left_to_the_network() {
        let near = |a: [f32; 3], b: [f32; 3]| norm(sub(a, b)) < 1e-3;
        let round = turned(3.0 * std::f32::consts::PI);
        assert!(near(round, [1.0, -0.2, 0.0]), "{round:?}");
        assert!(near(turned(3.0), [1.2, 0.0, 0.0]));
    }

    #[test]
    fn points_of_a_thing_lie_on_its_surface_and_have_its_colour() {
        let (dataset, config) = (dataset(), SourceConfig::quick());
        let things = things_in_flight(&dataset, &config.guide);
        let points = points_of(&dataset, &config, &things);
        assert!(points.positions.len() >= FEWEST_OF_THING, "{}", points.positions.len());
        let center = thrown(0.25)(0)[0].center;
        for position in &points.positions {
            let off = norm(sub(*position, center));
            assert!((0.5 * RADIUS..1.5 * RADIUS).contains(&off), "{off}");
        }
        // Half of it is hidden by what holds it.
        let red = points.colors.iter().filter(|c| c[0] > 0.6 && c[1] < 0.4).count();
        assert!(3 * red > points.colors.len(), "{red} of {}", points.colors.len());
        let off = GuideConfig { flights: false, ..config.guide };
        assert_eq!(things_in_flight(&dataset, &off), []);
    }
}
