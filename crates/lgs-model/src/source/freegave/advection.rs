//! Advection from the time of FreeGave's deformation to that of an image, through which its velocity field is
//! trained (method §3.2).

use lgs_core::stream;
use rand::RngExt;

use super::input::{Advection, Learns};
use crate::source::config::{AdvectionConfig, VelocityConfig};
use crate::source::motion::Moment;

/// The advection of a training step (method §3.2): from a time before or after that of the frame, or from T*
/// where the frame lies beyond it.
pub(super) fn training_advection(
    velocity: &VelocityConfig,
    config: &AdvectionConfig,
    at: Moment,
    seed: u64,
) -> Advection {
    let longest_step = if config.longest_step > 0.0 { config.longest_step } else { f32::INFINITY };
    let advection =
        |from| Advection { from, to: at.time, longest_step, turns: config.turns, learns: Learns::All };
    if at.time > velocity.max_time {
        return advection(velocity.max_time);
    }
    let mut random = stream(seed, "advection", at.iteration as u64);
    let (back, made) = (random.random::<bool>(), random.random::<f32>() < config.share);
    if at.time < config.length || !made {
        return Advection::none(at.time);
    }
    let length = if back { -config.length } else { config.length };
    advection((at.time - length).clamp(0.0, velocity.max_time))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn advections(config: &AdvectionConfig, time: f32) -> Vec<Advection> {
        let velocity = VelocityConfig { max_time: 0.7, ..VelocityConfig::paper() };
        (0..50)
            .map(|iteration| {
                training_advection(&velocity, config, Moment { time, iteration, window_end: 0.75 }, 3)
            })
            .collect()
    }

    #[test]
    fn advections_go_both_ways_inside_the_deformations_time_and_one_way_beyond() {
        let paper = AdvectionConfig::paper();
        let h = paper.length;
        let near = |a: f32, b: f32| (a - b).abs() < 1e-6;
        let inside = advections(&paper, 0.3);
        assert!(
            inside.iter().all(|advection| near(advection.from, 0.3 - h) || near(advection.from, 0.3 + h))
        );
        assert!(
            inside.iter().any(|advection| advection.from < 0.3)
                && inside.iter().any(|advection| advection.from > 0.3)
        );
        assert!(
            advections(&paper, 0.7)
                .iter()
                .all(|advection| near(advection.from, 0.7) || near(advection.from, 0.7 - h)),
            "clipped at T*"
        );
        assert!(advections(&paper, 0.74).iter().all(|advection| advection.from == 0.7
            && advection.to == 0.74
            && advection.longest_step.is_infinite()));
        assert!(advections(&paper, 0.5 * h).iter().all(|advection| *advection == Advection::none(0.5 * h)));
        let some = AdvectionConfig { share: 0.5, ..paper };
        let still = advections(&some, 0.3).iter().filter(|advection| advection.from == advection.to).count();
        assert!((10..40).contains(&still), "{still}");
    }
}
