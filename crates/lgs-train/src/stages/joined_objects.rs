//! Objects that no image shows to move apart.
//!
//! Tracks of a source slip over plain surfaces: those of a rod turn about it while the bob at its end does
//! not, so the two look like bodies that hang on each other. An object that touches another one and could as
//! well be carried by the rigid motion of that one belongs to it (method §5.1).

use std::collections::BTreeSet;

use lgs_core::k_nearest;
use lgs_distill::Partition;
use lgs_model::source::SourceModel;

use super::rises::{Otherwise, RigidMotion, Witnesses};
use super::thresholds::{OBSERVED_FRACTION, TOUCHING_NEIGHBORS};

/// The partition in which objects belong to one that they touch, where its motion in place of their own would
/// raise the error of the witnesses by less than the fraction `tolerance`, and by far less than their rest
/// does (`rises`).
pub(super) fn joined(
    source: &dyn SourceModel,
    partition: Partition,
    (witnesses, rises): (&Witnesses<'_>, &[f64]),
    tolerance: f64,
) -> Partition {
    let pairs = touching(source, &partition);
    if pairs.is_empty() || tolerance <= 0.0 || witnesses.is_empty() {
        return partition;
    }
    let start = source.positions_at(0.0);
    let now: Vec<Vec<[f32; 3]>> = witnesses.times().map(|time| source.positions_at(time)).collect();
    let carried = |&(part, whole): &(usize, usize)| {
        let of_whole = partition.members(whole);
        let chosen = |places: &[[f32; 3]]| -> Vec<[f32; 3]> { of_whole.iter().map(|&i| places[i]).collect() };
        let from = chosen(&start);
        let motions = now.iter().map(|now| RigidMotion::between(&from, &chosen(now))).collect();
        Otherwise { members: partition.members(part), motions: Some(motions) }
    };
    let carried: Vec<Otherwise> = pairs.iter().map(carried).collect();
    let allowed = rises.iter().map(|rise| tolerance.min(OBSERVED_FRACTION * rise));
    let mut belongs: Vec<(usize, f64)> = allowed.enumerate().collect();
    for (&(part, whole), rise) in pairs.iter().zip(witnesses.rises(source, &carried)) {
        tracing::debug!(part, whole, rise, "error of the images if an object were carried by another one");
        if rise < belongs[part].1 {
            belongs[part] = (whole, rise);
        }
    }
    partition.joined(&belongs.into_iter().map(|(whole, _)| whole).collect::<Vec<usize>>())
}

/// Pairs of a smaller object and a larger one that touch at t = 0: one has a Gaussian among the nearest ones
/// of a Gaussian of the other.
fn touching(source: &dyn SourceModel, partition: &Partition) -> BTreeSet<(usize, usize)> {
    let start = source.positions_at(0.0);
    let moving: Vec<usize> = (0..start.len()).filter(|&i| partition.object[i] >= 0).collect();
    let (near, row) = k_nearest(&moving.iter().map(|&i| start[i]).collect::<Vec<_>>(), TOUCHING_NEIGHBORS);
    let object = |at: usize| partition.object[moving[at]] as usize;
    let pair = |(at, &other): (usize, &u32)| {
        let (a, b) = (object(at / row), object(other as usize));
        (a != b).then_some((a.max(b), a.min(b)))
    };
    near.iter().enumerate().filter_map(pair).collect()
}
