//! Which points of an object belong to which of its bodies.

use glam::DVec3;
use lgs_core::geometry::wide;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The points of an object, range by range: where the second and later ranges begin, and which of the ranges
/// each body has, if not that of its number.
///
/// ```
/// use lgs_mechanics::coordinates::Bodies;
///
/// let bodies = Bodies::of_sizes(&[3, 2]);
/// assert_eq!(bodies.ranges(5), [0..3, 3..5]);
/// assert_eq!(bodies.of(&[0, 2, 4]).ranges(3), [0..2, 2..3]);
/// assert_eq!(bodies.taken_in_order(&[1, 0]).ranges(5), [3..5, 0..3]);
/// assert_eq!(Bodies::default().ranges(5), [0..5]);
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "File", into = "File")]
pub struct Bodies {
    later: Vec<usize>,
    /// Index of the range of each body; empty where each has that of its number.
    order: Vec<usize>,
}

/// What a file holds of bodies: the beginnings of the later ranges alone, or the order as well.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum File {
    InOrder(Vec<usize>),
    Ordered { later: Vec<usize>, order: Vec<usize> },
}

impl From<File> for Bodies {
    fn from(file: File) -> Self {
        match file {
            File::InOrder(later) => Self { later, order: Vec::new() },
            File::Ordered { later, order } => Self { later, order },
        }
    }
}

impl From<Bodies> for File {
    fn from(Bodies { later, order }: Bodies) -> Self {
        if order.is_empty() { Self::InOrder(later) } else { Self::Ordered { later, order } }
    }
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
        let later = ends.by_ref().take(sizes.len().saturating_sub(1)).collect();
        Self { later, order: Vec::new() }
    }

    /// The same ranges, of which the first body has the one with the first index, and so on.
    #[must_use]
    pub fn taken_in_order(&self, order: &[usize]) -> Self {
        let is_own = order.iter().copied().eq(0..order.len());
        Self { order: if is_own { Vec::new() } else { order.to_vec() }, ..self.clone() }
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
        let ranges: Vec<Range<usize>> =
            starts.zip(ends).map(|(start, end)| start.min(points)..end.min(points)).collect();
        if self.order.is_empty() {
            return ranges;
        }
        self.order.iter().map(|&index| ranges[index].clone()).collect()
    }

    /// A value for each of so many points, by the number of its body and its own.
    #[must_use]
    pub fn of_points<T: Clone + Default>(
        &self,
        points: usize,
        of_point: impl Fn(usize, usize) -> T,
    ) -> Vec<T> {
        let mut all = vec![T::default(); points];
        for (body, rows) in self.ranges(points).into_iter().enumerate() {
            for row in rows {
                all[row] = of_point(body, row);
            }
        }
        all
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
        Self { later: self.later.iter().map(before).collect(), ..self.clone() }
    }

    /// Whether every body has a point, of so many in all, and no point has two bodies.
    #[must_use]
    pub fn fit(&self, points: usize) -> bool {
        let starts = [&[0], self.later.as_slice(), &[points]].concat();
        let mut order = self.order.clone();
        order.sort_unstable();
        let is_order = order.is_empty() || order.into_iter().eq(0..self.count());
        is_order && starts.windows(2).all(|pair| pair[0] < pair[1])
    }
}
