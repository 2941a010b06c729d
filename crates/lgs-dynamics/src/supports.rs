//! Supports of the local rigid alignment: for each particle itself and its nearest neighbours at the start (Eq. 6, reference G19).
//!
//! Particles may come in any order, but a support's members are read together. Kernels therefore work on slots: particles numbered by a
//! breadth-first walk over the supports, which puts members close to each other in memory whatever the number of particles. Arrays are
//! brought into that order before a kernel and back after it.

use crate::lanes::GROUP;
use rayon::prelude::*;
use std::ops::Range;

/// Particles per task of a reordering.
pub(crate) const CHUNK: usize = 1 << 10;

/// Why rows of indices are no supports.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SupportsError {
    /// The number of indices is no multiple of the row length.
    Length {
        /// Number of indices.
        found: usize,
        /// Row length.
        k: usize,
    },
    /// An index names no particle.
    Index {
        /// The row.
        row: usize,
        /// The index found.
        found: u32,
        /// Number of particles.
        particles: usize,
    },
}

impl std::fmt::Display for SupportsError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Length { found, k } => write!(f, "supports: {found} indices do not fill rows of {k}"),
            Self::Index { row, found, particles } => write!(f, "supports: row {row} names particle {found} of {particles}"),
        }
    }
}

impl std::error::Error for SupportsError {}

/// For every particle the members of its support.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Supports {
    indices: Vec<u32>,
    k: usize,
    /// The particle in every slot.
    particles: Vec<u32>,
    /// The slot of every particle.
    slots: Vec<u32>,
    /// Members of every slot's support, as slots.
    members: Vec<u32>,
    /// Slots whose supports a slot belongs to, ascending, slot by slot.
    owners: Vec<u32>,
    /// Where a slot's owners start; one more entry than slots.
    owners_start: Vec<u32>,
    /// By group of slots: one more than the highest slot that is a member in the groups before, and one more than the highest owner.
    members_front: Vec<u32>,
    owners_front: Vec<u32>,
}

impl Supports {
    /// Supports of `k` points, the point itself included (all of them where there are fewer).
    #[must_use]
    pub fn nearest(points: &[[f32; 3]], k: usize) -> Self {
        let (indices, k) = lgs_core::k_nearest(points, k.max(1) - 1);
        Self::with_slots(indices, k)
    }

    /// Supports from rows of `k` indices, one row per particle.
    ///
    /// # Errors
    /// If the rows are incomplete or an index names no particle.
    pub fn from_rows(indices: Vec<u32>, k: usize) -> Result<Self, SupportsError> {
        if !indices.len().is_multiple_of(k) {
            return Err(SupportsError::Length { found: indices.len(), k });
        }
        let particles = indices.len().checked_div(k).unwrap_or(0);
        if let Some(at) = indices.iter().position(|&i| i as usize >= particles) {
            return Err(SupportsError::Index { row: at / k, found: indices[at], particles });
        }
        Ok(Self::with_slots(indices, k))
    }

    fn with_slots(indices: Vec<u32>, k: usize) -> Self {
        let particles = breadth_first(&indices, k);
        let mut slots = vec![0; particles.len()];
        for (slot, &particle) in particles.iter().enumerate() {
            slots[particle as usize] = slot as u32;
        }
        let row = |&particle: &u32| &indices[particle as usize * k..][..k];
        let members: Vec<u32> = particles.iter().flat_map(row).map(|&member| slots[member as usize]).collect();
        let (owners, owners_start) = transpose(&members, k);
        let members_front = front(particles.len(), |slots| &members[slots.start * k..slots.end * k]);
        let owners_front = front(particles.len(), |slots| &owners[owners_start[slots.start] as usize..owners_start[slots.end] as usize]);
        Self { indices, k, particles, slots, members, owners, owners_start, members_front, owners_front }
    }

    /// All rows, `[particles, k]`.
    #[must_use]
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Members of a support.
    #[must_use]
    pub fn k(&self) -> usize {
        self.k
    }

    /// Number of particles.
    #[must_use]
    pub fn particles(&self) -> usize {
        self.particles.len()
    }

    /// The members of a particle's support.
    #[must_use]
    pub fn members(&self, particle: usize) -> &[u32] {
        &self.indices[particle * self.k..(particle + 1) * self.k]
    }

    /// The support that all particles share, where they are several and do.
    #[must_use]
    pub fn common(&self) -> Option<&[u32]> {
        let first = (self.particles() > 1).then(|| self.members(0))?;
        (1..self.particles()).all(|particle| self.members(particle) == first).then_some(first)
    }

    /// The slots of a slot's support.
    pub(crate) fn slot_members(&self, slot: usize) -> &[u32] {
        &self.members[slot * self.k..(slot + 1) * self.k]
    }

    /// The slots whose supports a slot belongs to, ascending.
    pub(crate) fn slot_owners(&self, slot: usize) -> &[u32] {
        &self.owners[self.owners_start[slot] as usize..self.owners_start[slot + 1] as usize]
    }

    /// Slots beyond all members of earlier groups of slots, up to the highest member in this group: a walk over the supports in the order of slots
    /// comes to them now.
    pub(crate) fn new_members(&self, group: usize) -> Range<usize> {
        step_of(&self.members_front, group)
    }

    /// As [`Supports::new_members`], of owners.
    pub(crate) fn new_owners(&self, group: usize) -> Range<usize> {
        step_of(&self.owners_front, group)
    }

    /// The particle in every slot.
    pub(crate) fn particles_in_slots(&self) -> &[u32] {
        &self.particles
    }

    /// The slot of every particle.
    pub(crate) fn slots_of_particles(&self) -> &[u32] {
        &self.slots
    }

    /// Values of particles in the order of slots.
    pub(crate) fn to_slots<T: Copy + Send + Sync>(&self, of_particles: &[T], of_slots: &mut Vec<T>) {
        reorder(&self.particles, of_particles, of_slots);
    }

    /// Values of slots in the order of particles.
    pub(crate) fn to_particles<T: Copy + Send + Sync>(&self, of_slots: &[T], of_particles: &mut Vec<T>) {
        reorder(&self.slots, of_slots, of_particles);
    }
}

fn reorder<T: Copy + Send + Sync>(order: &[u32], values: &[T], reordered: &mut Vec<T>) {
    order.par_iter().with_min_len(CHUNK).map(|&at| values[at as usize]).collect_into_vec(reordered);
}

/// All particles by a breadth-first walk over rows of `k` members, from the first particle not yet met.
fn breadth_first(indices: &[u32], k: usize) -> Vec<u32> {
    let count = indices.len().checked_div(k).unwrap_or(0);
    let mut met = vec![false; count];
    let mut order = Vec::with_capacity(count);
    let mut next = 0;
    for first in 0..count as u32 {
        if !std::mem::replace(&mut met[first as usize], true) {
            order.push(first);
        }
        while next < order.len() {
            for &member in &indices[order[next] as usize * k..][..k] {
                if !std::mem::replace(&mut met[member as usize], true) {
                    order.push(member);
                }
            }
            next += 1;
        }
    }
    order
}

/// How far the slots named by groups of slots reach: a number more than groups, the first is zero.
fn front<'a>(slots: usize, named: impl Fn(Range<usize>) -> &'a [u32]) -> Vec<u32> {
    let mut reached = 0;
    let of_group = |start| {
        let furthest = named(start..(start + GROUP).min(slots)).iter().max();
        reached = furthest.map_or(reached, |&slot| reached.max(slot + 1));
        reached
    };
    std::iter::once(0).chain((0..slots).step_by(GROUP).map(of_group)).collect()
}

/// Nothing behind the last group.
fn step_of(front: &[u32], group: usize) -> Range<usize> {
    front.get(group..group + 2).map_or(0..0, |ends| ends[0] as usize..ends[1] as usize)
}

/// For every entry the rows of `k` entries that name it, and where each entry's rows start.
fn transpose(members: &[u32], k: usize) -> (Vec<u32>, Vec<u32>) {
    let count = members.len().checked_div(k).unwrap_or(0);
    let mut start = vec![0_u32; count + 1];
    for &member in members {
        start[member as usize + 1] += 1;
    }
    for i in 0..count {
        start[i + 1] += start[i];
    }
    let mut next = start.clone();
    let mut owners = vec![0; members.len()];
    for (at, &member) in members.iter().enumerate() {
        owners[next[member as usize] as usize] = (at / k) as u32;
        next[member as usize] += 1;
    }
    (owners, start)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_checked() {
        assert_eq!(Supports::from_rows(vec![0, 1, 1], 2), Err(SupportsError::Length { found: 3, k: 2 }));
        assert_eq!(Supports::from_rows(vec![0, 3], 1), Err(SupportsError::Index { row: 1, found: 3, particles: 2 }));
        assert_eq!(Supports::from_rows(vec![], 0).unwrap().particles(), 0);
    }

    #[test]
    fn fronts_go_on_from_group_to_group() {
        let ring = |i: u32| [i, (i + 1) % 40];
        let supports = Supports::from_rows((0..40).flat_map(ring).collect(), 2).unwrap();
        assert_eq!([0, 1, 2, 3].map(|group| supports.new_members(group)), [0..17, 17..33, 33..40, 0..0]);
        assert_eq!([0, 1, 2].map(|group| supports.new_owners(group)), [0..40, 40..40, 40..40], "the first is the last one's second member");
    }

    #[test]
    fn slots_follow_the_supports_and_name_every_particle_once() {
        let supports = Supports::from_rows(vec![0, 3, 1, 4, 2, 2, 3, 1, 4, 0], 2).unwrap();
        assert_eq!(supports.particles, [0, 3, 1, 4, 2]);
        assert_eq!(supports.members(1), [1, 4]);
        assert_eq!(supports.slot_members(2), [2, 3], "particle 1");
        assert_eq!(supports.slot_owners(0), [0, 3], "particle 0 is in its own support and in that of particle 4");
        assert_eq!(supports.slot_owners(4), [4, 4]);
        assert_eq!((supports.new_members(0), supports.new_owners(0), supports.new_members(1)), (0..5, 0..5, 0..0));
        let values = [10, 11, 12, 13, 14];
        let (mut of_slots, mut back) = (Vec::new(), Vec::new());
        supports.to_slots(&values, &mut of_slots);
        assert_eq!(of_slots, [10, 13, 11, 14, 12]);
        supports.to_particles(&of_slots, &mut back);
        assert_eq!(back, values);
    }
}
