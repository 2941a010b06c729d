//! Which points of an object belong to which of its bodies.

use glam::DVec3;
use lgs_core::geometry::wide;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The points of an object, body by body: where those of the second and of later bodies begin.
///
/// ```
/// use lgs_mechanics::coordinates::Bodies;
///
/// let bodies = Bodies::of_sizes(&[3, 2]);
/// assert_eq!(bodies.ranges(5), [0..3, 3..5]);
/// assert_eq!(bodies.of(&[0, 2, 4]).ranges(3), [0..2, 2..3]);
/// assert_eq!(Bodies::default().ranges(5), [0..5]);
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Bodies {
    later: Vec<usize>,
}

impl Bodies {
    /// Bodies with so many points each.
    #[must_use]
    pub fn of_sizes(sizes: &[usize]) -> Self {
        let mut end = 0;
        let mut ends = sizes.iter().map(|size| {
            end += size;
            end
        });
        Self { later: ends.by_ref().take(sizes.len().saturating_sub(1)).collect() }
    }

    /// Number of bodies.
    #[must_use]
    pub fn count(&self) -> usize {
        self.later.len() + 1
    }

    /// The points of each body, of so many in all.
    #[must_use]
    pub fn ranges(&self, points: usize) -> Vec<Range<usize>> {
        let starts = std::iter::once(0).chain(self.later.iter().copied());
        let ends = self.later.iter().copied().chain([points]);
        starts.zip(ends).map(|(start, end)| start.min(points)..end.min(points)).collect()
    }

    /// At most so many of the points of each body, spread evenly over their order.
    #[must_use]
    pub fn spread(&self, points: &[[f32; 3]], most: usize) -> Vec<Vec<DVec3>> {
        let some = |own: &[[f32; 3]]| {
            let count = own.len().min(most);
            (0..count).map(|i| wide(own[i * own.len() / count])).collect()
        };
        self.ranges(points.len()).into_iter().map(|rows| some(&points[rows])).collect()
    }

    /// The bodies of some of the points, whose indices ascend.
    #[must_use]
    pub fn of(&self, chosen: &[u32]) -> Self {
        let before = |&start: &usize| chosen.partition_point(|&i| (i as usize) < start);
        Self { later: self.later.iter().map(before).collect() }
    }

    /// Whether every body has a point, of so many in all.
    #[must_use]
    pub fn fit(&self, points: usize) -> bool {
        let starts = [&[0], self.later.as_slice(), &[points]].concat();
        starts.windows(2).all(|pair| pair[0] < pair[1])
    }
}
