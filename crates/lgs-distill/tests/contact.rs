//! Bodies that fall on points at rest: what stage 1 makes of their tracks, in every unit of length.
#![allow(clippy::unwrap_used, reason = "tests")]

use lgs_distill::{DistillConfig, Distilled, DistilledLaw, Partition, Trajectories, distill_objects};
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::contact::Origin;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

/// Points of a sphere of radius 0.3 and of the floor at its lowest height, and tracks of both while the
/// sphere falls from a height: one flight after the other, without friction.
struct Falling {
    size: f32,
    samples: usize,
    noise: f32,
    /// Where a wall across the x axis stands, if there is one.
    wall: Option<f32>,
    /// Where the floor ends along the x axis.
    edge: f32,
}

const GRAVITY: f32 = 3.0;
const RESTITUTION: f32 = 0.7;
const HEIGHT: f32 = 0.35;

impl Falling {
    /// Height of the ball over the floor.
    fn height(time: f32) -> f32 {
        let impact = (2.0 * HEIGHT / GRAVITY).sqrt();
        if time < impact {
            return HEIGHT - 0.5 * GRAVITY * time * time;
        }
        let since = time - impact;
        RESTITUTION * GRAVITY * impact * since - 0.5 * GRAVITY * since * since
    }

    fn trajectories(&self) -> (Trajectories, Partition) {
        let mut draws = lgs_core::stream(7, "points", 0);
        let mut normal = |_: i32| -> f32 { StandardNormal.sample(&mut draws) };
        let ball: Vec<[f32; 3]> = (0..200)
            .map(|_| {
                let p = [0, 1, 2].map(&mut normal);
                let length = p.iter().map(|c| c * c).sum::<f32>().sqrt();
                p.map(|c| 0.3 * c / length)
            })
            .collect();
        let mut draws = lgs_core::stream(8, "floor", 0);
        let mut across = || draws.random_range(-1.5..1.5);
        let mut still: Vec<[f32; 3]> = (0..400).map(|_| [across(), across(), -0.3]).collect();
        still.retain(|p| p[0] < self.edge);
        still.extend(self.wall.into_iter().flat_map(|x| [x; 400]).map(|x| [x, across(), across()]));
        let times: Vec<f32> = (0..self.samples).map(|k| 0.0125 * k as f32).collect();
        let mut draws = lgs_core::stream(9, "noise", 0);
        let mut noise = || -> f32 { StandardNormal.sample(&mut draws) };
        let mut row = |&time: &f32| -> Vec<[f32; 3]> {
            let shift = [0.3 * time, 0.1 * time, Self::height(time)];
            let moved = ball.iter().map(|p| [0, 1, 2].map(|i| p[i] + shift[i]));
            let all: Vec<[f32; 3]> = moved.chain(still.iter().copied()).collect();
            all.into_iter().map(|p| p.map(|c| self.size * (c + self.noise * noise()))).collect()
        };
        let positions = times.iter().map(&mut row).collect();
        let object = (0..200 + still.len()).map(|i| if i < 200 { 0 } else { -1 }).collect();
        (Trajectories::unweighted(times, positions), Partition { object, objects: 1 })
    }

    fn law(&self) -> DistilledLaw {
        let (seen, partition) = self.trajectories();
        let found = distill_objects(&seen, partition, &DistillConfig::default(), 1, &mut ()).unwrap();
        let Distilled::Generalised(law) = &found.objects[0].1 else { panic!("a law") };
        (**law).clone()
    }
}

#[test]
fn a_ball_bounces_on_the_points_at_rest_in_every_unit() {
    for size in [0.01, 100.0] {
        let found = Falling { size, samples: 61, noise: 0.002, wall: None, edge: 1.5 }.law();
        let contact = found.law.contact.as_ref().expect("a contact");
        let told = format!("{size}: {contact:?}, {:?}", found.known.verdict);
        assert_eq!(contact.origin, Origin::Observed, "{told}");
        assert!((contact.restitution / f64::from(RESTITUTION) - 1.0).abs() < 0.05, "{told}");
        let impact = f64::from((2.0 * HEIGHT / GRAVITY).sqrt());
        assert_eq!(found.law.impacts.len(), 1, "{told}");
        assert!((found.law.impacts[0].time - impact).abs() < 0.0125, "{told}: {:?}", found.law.impacts);
        assert_ne!(found.known.verdict, Verdict::Outside, "{told}");
    }
}

#[test]
fn a_ball_that_has_met_nothing_yet_does_not_fall_through_the_floor() {
    let found = Falling { size: 1.0, samples: 31, noise: 0.002, wall: None, edge: 1.5 }.law();
    let contact = found.law.contact.as_ref().expect("a contact");
    assert!(found.law.impacts.is_empty() && contact.deviations[0] > 0.1, "{contact:?}");
    let last = Distilled::Generalised(Box::new(found.clone())).rolled(0.01, 2000).pop().unwrap();
    let lowest = last.iter().map(|p| p[2]).fold(f32::INFINITY, f32::min);
    assert!((lowest + 0.3).abs() < 0.02, "{lowest}");
    let band = &found.known.band;
    let radius = |time: f64| band.radius[band.times.partition_point(|t| *t < time)].unwrap_or(f64::INFINITY);
    assert!(radius(1.0) > 5.0 * radius(0.3), "{band:?}");
}

#[test]
fn a_ball_stays_within_a_wall_and_a_floor_that_it_has_not_met_yet() {
    let found = Falling { size: 1.0, samples: 31, noise: 0.002, wall: Some(0.44), edge: 1.5 }.law();
    let contact = found.law.contact.as_ref().expect("a contact");
    assert!(found.law.impacts.is_empty(), "{:?}", found.law.impacts);
    let normals: Vec<[f64; 3]> = contact.planes().map(|plane| plane.normal).collect();
    assert!(normals.len() == 2 && normals[0][0] < -0.999 && normals[1][2] > 0.999, "{contact:?}");
    let paths = Distilled::Generalised(Box::new(found)).rolled(0.01, 300);
    let over =
        |plane: &dyn Fn(&[f32; 3]) -> f32| paths.iter().flatten().map(plane).fold(f32::INFINITY, f32::min);
    let [wall, floor] = [over(&|p| 0.44 - p[0]), over(&|p| p[2] + 0.3)];
    assert!(wall.abs() < 0.02 && floor.abs() < 0.02, "{wall} {floor}");
}

#[test]
fn a_ball_falls_past_the_edge_of_a_floor() {
    let lands_at = 0.3 * (2.0 * HEIGHT / GRAVITY).sqrt();
    let contact = |edge: f32| {
        let falling = Falling { size: 1.0, samples: 31, noise: 0.002, wall: None, edge };
        falling.law().law.contact.is_some()
    };
    assert!(contact(lands_at + 0.2) && !contact(lands_at - 0.2));
}
