//! The result of the segmentation: an object, or none, for every particle.

/// Labels of all particles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Partition {
    /// `[n]` object of each particle, −1 for a static one.
    pub object: Vec<i32>,
    /// Number of objects, labelled by falling size.
    pub objects: usize,
}

impl Partition {
    /// The partition of `particles` into groups of indices, the largest first (ties by their first particle);
    /// particles of no group are static.
    #[must_use]
    pub(crate) fn of_groups(mut groups: Vec<Vec<usize>>, particles: usize) -> Self {
        largest_first(&mut groups);
        let mut object = vec![-1; particles];
        for (label, members) in groups.iter().enumerate() {
            members.iter().for_each(|&i| object[i] = label as i32);
        }
        Self { object, objects: groups.len() }
    }

    /// The particles of an object, ascending.
    #[must_use]
    pub fn members(&self, object: usize) -> Vec<usize> {
        (0..self.object.len()).filter(|&i| self.object[i] == object as i32).collect()
    }

    /// The partition with only the objects that `kept` says, labelled anew in the same order; the particles
    /// of the others are static.
    #[must_use]
    pub fn with_only(&self, kept: &[bool]) -> Self {
        let mut next = 0..;
        let labels: Vec<i32> =
            kept.iter().map(|&kept| if kept { next.next().unwrap_or(-1) } else { -1 }).collect();
        let label = |&o: &i32| usize::try_from(o).ok().and_then(|o| labels.get(o).copied()).unwrap_or(-1);
        Self {
            object: self.object.iter().map(label).collect(),
            objects: labels.iter().filter(|&&l| l >= 0).count(),
        }
    }

    /// The partition in which every object is part of the one that `whole` says, itself or another one, which
    /// may be part of a further one; labelled anew by falling size.
    ///
    /// # Panics
    /// If there are not as many as objects.
    #[must_use]
    pub fn joined(&self, whole: &[usize]) -> Self {
        assert_eq!(whole.len(), self.objects, "objects");
        let root = |object: usize| (0..whole.len()).fold(object, |object, _| whole[object]);
        let mut groups = vec![Vec::new(); self.objects];
        for (i, &object) in self.object.iter().enumerate() {
            if let Ok(object) = usize::try_from(object) {
                groups[root(object)].push(i);
            }
        }
        groups.retain(|members| !members.is_empty());
        Self::of_groups(groups, self.object.len())
    }

    /// Number of moving particles.
    #[must_use]
    pub fn moving(&self) -> usize {
        self.object.iter().filter(|&&o| o >= 0).count()
    }
}

/// Sorts groups by falling size, ties by their first particle.
pub(crate) fn largest_first(groups: &mut [Vec<usize>]) {
    groups.sort_by_key(|members| (std::cmp::Reverse(members.len()), members.first().copied()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_parts_belong_to_one_object() {
        let partition = Partition { object: vec![2, 1, 0, -1, 0, 3, 0], objects: 4 };
        let joined = partition.joined(&[0, 1, 1, 2]);
        assert_eq!(joined, Partition { object: vec![0, 0, 1, -1, 1, 0, 1], objects: 2 });
        assert_eq!(partition.joined(&[0, 1, 2, 3]).objects, 4);
    }
}
