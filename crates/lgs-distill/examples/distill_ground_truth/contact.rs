//! Impacts of bodies that collide with a plane beside those of the truth, and how deep their points go.

use super::measure::{DT, STEPS, at};
use glam::DVec3;
use lgs_core::geometry::wide;
use lgs_data::synth::GroundTruth;
use lgs_distill::{Distilled, SceneDistillation};
use lgs_mechanics::Edit;
use std::fmt;

use super::thresholds::{NOT_DEEP, POTENTIALS};

/// How the impacts of a body compare with the truth.
pub(super) struct Impacts {
    /// Steps by which each impact of the truth is missed; `None` where there is no other one.
    off: Vec<Option<usize>>,
    /// Depth of the lowest point below the plane, the largest over the edits of the potential, world units.
    depth: f64,
}

impl Impacts {
    /// Whether all impacts are found to within one step and nothing goes below the plane.
    pub(super) fn are_right(&self) -> bool {
        self.off.iter().all(|off| off.is_some_and(|off| off <= 1)) && self.depth <= NOT_DEEP
    }
}

impl fmt::Display for Impacts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let off = |off: &Option<usize>| off.map_or("missed".to_owned(), |off| off.to_string());
        let all: Vec<String> = self.off.iter().map(off).collect();
        write!(f, "impacts off by {} frames, lowest point {:.4} below", all.join(", "), self.depth)
    }
}

/// The impacts of the first object that collides with a plane.
pub(super) fn impacts(found: &SceneDistillation, truth: &GroundTruth) -> Option<Impacts> {
    let mut colliding = found.objects.iter().filter_map(|(members, object)| match object {
        Distilled::Generalised(law) if law.law.contact.is_some() => Some((members, object, law)),
        _ => None,
    });
    let (members, object, law) = colliding.next()?;
    let plane = law.law.contact.as_ref()?.plane;
    let normal = DVec3::from_array(plane.normal);
    let mean =
        |points: &[[f32; 3]]| points.iter().map(|p| wide(*p).dot(normal)).sum::<f64>() / points.len() as f64;
    let expected: Vec<f64> = (0..=STEPS).map(|step| mean(&at(truth, members, step))).collect();
    let own: Vec<f64> = object.rolled(DT as f32, STEPS).iter().map(|points| mean(points)).collect();
    let (expected, own) = (turns(&expected), turns(&own));
    let off = |step: &usize| own.iter().map(|other| other.abs_diff(*step)).min();
    let times: Vec<f64> = (0..=STEPS).map(|step| DT * step as f64).collect();
    let depth = |potential: f64| {
        let moved = law.edited(Edit { potential, ..Edit::NONE }, &times);
        let heights = moved.iter().flatten().map(|p| wide(*p).dot(normal) - plane.offset);
        -heights.fold(f64::INFINITY, f64::min)
    };
    let depth = POTENTIALS.into_iter().map(depth).fold(f64::NEG_INFINITY, f64::max);
    Some(Impacts { off: expected.iter().map(off).collect(), depth })
}

/// Steps at which a height has a minimum that is none of a smooth motion: its slope jumps from down to up.
fn turns(heights: &[f64]) -> Vec<usize> {
    let slope = |step: usize| heights[step + 1] - heights[step];
    let is_turn = |step: &usize| slope(step - 1) < 0.0 && slope(*step) >= 0.0;
    (1..heights.len().saturating_sub(1)).filter(is_turn).collect()
}
