//! Supports of the local rigid alignment: for each particle itself and its nearest neighbours at the start
//! (Eq. 6; method §4.6).
//!
//! A support's members are read together, from wherever in memory they lie. Particles in spatial order
//! ([`lgs_core::spatial_order`]) have most of them in a cache already; for the others, the arrivals, kernels
//! ask ahead. Any other order gives the same results but for rounding, more slowly where there are many
//! particles.

use crate::lanes::GROUP;
use std::ops::Range;

/// Groups of particles after which a member that none of them named counts as no longer in a cache.
const WINDOW: usize = 256;

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
            Self::Index { row, found, particles } => {
                write!(f, "supports: row {row} names particle {found} of {particles}")
            }
        }
    }
}

impl std::error::Error for SupportsError {}

/// The members of every particle's support.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Supports {
    indices: Vec<u32>,
    k: usize,
    /// Particles whose supports a particle belongs to, ascending, particle by particle.
    owners: Vec<u32>,
    /// The place at which a particle's owners start; one more entry than particles.
    owners_start: Vec<u32>,
    member_arrivals: Arrivals,
    owner_arrivals: Arrivals,
}

impl Supports {
    /// Supports of `k` points, the point itself included (all of them where there are fewer). Points in
    /// spatial order are aligned fastest.
    #[must_use]
    pub fn nearest(points: &[[f32; 3]], k: usize) -> Self {
        let (indices, k) = lgs_core::k_nearest(points, k.max(1) - 1);
        Self::with_owners(indices, k)
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
        Ok(Self::with_owners(indices, k))
    }

    /// The same support of `members` for all `particles`, which makes Eq. 6 a rigid motion of the whole
    /// object.
    ///
    /// # Panics
    /// If there is no member, or one is no particle (a bug).
    #[must_use]
    pub fn shared(members: &[u32], particles: usize) -> Self {
        let are_particles = members.iter().all(|&member| (member as usize) < particles);
        assert!(!members.is_empty() && are_particles, "a shared support of {particles}: {members:?}");
        Self::with_owners(members.repeat(particles), members.len())
    }

    fn with_owners(indices: Vec<u32>, k: usize) -> Self {
        let (owners, owners_start) = transpose(&indices, k);
        let particles = owners_start.len() - 1;
        let member_arrivals = Arrivals::new(particles, |group| &indices[group.start * k..group.end * k]);
        let owner_arrivals = Arrivals::new(particles, |group| {
            let [start, end] = [group.start, group.end].map(|particle| owners_start[particle] as usize);
            &owners[start..end]
        });
        Self { indices, k, owners, owners_start, member_arrivals, owner_arrivals }
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
        self.owners_start.len() - 1
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

    /// The particles whose supports a particle belongs to, ascending.
    pub(crate) fn owners(&self, particle: usize) -> &[u32] {
        &self.owners[self.owners_start[particle] as usize..self.owners_start[particle + 1] as usize]
    }

    /// The owners of all particles, one particle's after the other's.
    #[cfg(feature = "gpu")]
    pub(crate) fn all_owners(&self) -> &[u32] {
        &self.owners
    }

    /// The places at which each particle's owners start among all; one more than particles.
    #[cfg(feature = "gpu")]
    pub(crate) fn owners_start(&self) -> &[u32] {
        &self.owners_start
    }

    /// Members of a group of particles' supports that a walk over the groups has not met for a while.
    pub(crate) fn member_arrivals(&self, group: usize) -> &[u32] {
        self.member_arrivals.of_group(group)
    }

    /// As [`Supports::member_arrivals`], of owners.
    pub(crate) fn owner_arrivals(&self, group: usize) -> &[u32] {
        self.owner_arrivals.of_group(group)
    }
}

/// Particles that a group names and no group of the last [`WINDOW`] has named.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Arrivals {
    particles: Vec<u32>,
    /// The place at which a group's particles start; one more entry than groups.
    start: Vec<u32>,
}

impl Arrivals {
    /// Of `count` particles, given what the particles of a group name.
    fn new<'a>(count: usize, named: impl Fn(Range<usize>) -> &'a [u32]) -> Self {
        let mut last_named = vec![None; count];
        let (mut particles, mut start) = (Vec::new(), vec![0]);
        for (group, first) in (0..count).step_by(GROUP).enumerate() {
            for &particle in named(first..(first + GROUP).min(count)) {
                let last = last_named[particle as usize].replace(group);
                if last.is_none_or(|last| group - last > WINDOW) {
                    particles.push(particle);
                }
            }
            start.push(particles.len() as u32);
        }
        Self { particles, start }
    }

    /// Nothing behind the last group.
    fn of_group(&self, group: usize) -> &[u32] {
        self.start
            .get(group..group + 2)
            .map_or(&[], |ends| &self.particles[ends[0] as usize..ends[1] as usize])
    }
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
        assert_eq!(
            Supports::from_rows(vec![0, 3], 1),
            Err(SupportsError::Index { row: 1, found: 3, particles: 2 })
        );
        assert_eq!(Supports::from_rows(vec![], 0).unwrap().particles(), 0);
    }

    #[test]
    fn owners_are_the_transpose() {
        let supports = Supports::from_rows(vec![0, 3, 1, 4, 2, 2, 3, 1, 4, 0], 2).unwrap();
        assert_eq!(supports.members(1), [1, 4]);
        assert_eq!(supports.owners(0), [0, 4]);
        assert_eq!(supports.owners(2), [2, 2]);
    }

    #[test]
    fn particles_arrive_again_after_the_window() {
        // Everyone's support ends with particle 0 or, in the last group, with particle 1.
        let count = (GROUP * (WINDOW + 3)) as u32;
        let far = |i: u32| u32::from(i / GROUP as u32 == WINDOW as u32 + 2);
        let supports = Supports::from_rows((0..count).flat_map(|i| [i, far(i)]).collect(), 2).unwrap();
        let of_group = |group: usize| (GROUP * group) as u32..(GROUP * (group + 1)) as u32;
        assert!(supports.member_arrivals(0).iter().copied().eq(of_group(0)));
        assert!(supports.member_arrivals(9).iter().copied().eq(of_group(9)), "particle 0 was named before");
        let (own, again) = supports.member_arrivals(WINDOW + 2).split_at(1);
        assert_eq!((own[0], again[0], again.len()), (of_group(WINDOW + 2).start, 1, GROUP));
        assert!(supports.member_arrivals(WINDOW + 3).is_empty());
    }
}
