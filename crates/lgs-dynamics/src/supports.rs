//! Supports of the local rigid alignment: for each particle itself and its nearest neighbours at the start (Eq. 6, reference G19).

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

/// For every particle the members of its support, and for every particle the supports that it is a member of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Supports {
    indices: Vec<u32>,
    k: usize,
    /// Supports (by owner, ascending) that a particle belongs to, particle by particle.
    owners: Vec<u32>,
    /// Where a particle's owners start; one more entry than particles.
    owners_start: Vec<u32>,
}

impl Supports {
    /// Supports of `k` points, the point itself included (all of them where there are fewer).
    #[must_use]
    pub fn nearest(points: &[[f32; 3]], k: usize) -> Self {
        let (indices, k) = lgs_core::k_nearest(points, k.max(1) - 1);
        Self::with_transpose(indices, k)
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
        Ok(Self::with_transpose(indices, k))
    }

    fn with_transpose(indices: Vec<u32>, k: usize) -> Self {
        let particles = indices.len().checked_div(k).unwrap_or(0);
        let mut owners_start = vec![0_u32; particles + 1];
        for &member in &indices {
            owners_start[member as usize + 1] += 1;
        }
        for i in 0..particles {
            owners_start[i + 1] += owners_start[i];
        }
        let mut next = owners_start.clone();
        let mut owners = vec![0; indices.len()];
        for (at, &member) in indices.iter().enumerate() {
            owners[next[member as usize] as usize] = (at / k) as u32;
            next[member as usize] += 1;
        }
        Self { indices, k, owners, owners_start }
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

    /// The particles whose supports a particle belongs to, ascending.
    #[must_use]
    pub fn owners(&self, particle: usize) -> &[u32] {
        &self.owners[self.owners_start[particle] as usize..self.owners_start[particle + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_checked_and_transposed() {
        let supports = Supports::from_rows(vec![0, 1, 1, 2, 2, 1], 2).unwrap();
        assert_eq!(supports.members(1), [1, 2]);
        assert_eq!(supports.owners(1), [0, 1, 2]);
        assert_eq!(supports.owners(0), [0]);
        assert_eq!(Supports::from_rows(vec![0, 1, 1], 2), Err(SupportsError::Length { found: 3, k: 2 }));
        assert_eq!(Supports::from_rows(vec![0, 3], 1), Err(SupportsError::Index { row: 1, found: 3, particles: 2 }));
        assert_eq!(Supports::from_rows(vec![], 0).unwrap().particles(), 0);
    }
}
