//! Subsets of an object's particles that move as the object does.

use lgs_core::Stream;
use lgs_dynamics::Supports;
use rand::seq::index::sample;

/// Particles of a subset of at most `subset` (0: all), ascending; those that hold the object together are
/// always among them.
pub(super) fn choose(particles: usize, common: Option<&[u32]>, subset: usize, rng: &mut Stream) -> Vec<u32> {
    if subset == 0 || subset >= particles {
        return (0..particles as u32).collect();
    }
    let mut chosen: Vec<u32> = sample(rng, particles, subset).into_iter().map(|i| i as u32).collect();
    chosen.extend(common.into_iter().flatten());
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

/// Supports within a subset at positions `q`: the common one, else as many nearest neighbours as the whole
/// object's supports have.
pub(super) fn supports_of(chosen: &[u32], supports: &Supports, q: &[[f32; 3]]) -> Supports {
    let place = |member: &u32| chosen.binary_search(member).ok().map(|at| at as u32);
    match supports.common() {
        Some(common) => Supports::shared(&common.iter().filter_map(place).collect::<Vec<_>>(), chosen.len()),
        None => Supports::nearest(q, supports.k()),
    }
}
