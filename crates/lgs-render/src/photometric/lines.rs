//! The sequences that the photometric loss windows: down columns of sixteen floats side by side, along rows
//! with sixteen rows side by side.

use super::pair::CHANNELS;
use crate::simd::{BLOCK, Lanes, V};
use crate::transpose::{self, Square};
use crate::window::{Line, RADIUS, STEP};
use pulp::Simd;

/// Pixels that enter at a time: whole squares.
pub(super) const PIXELS: usize = STEP;
/// Pixels whose windowed slopes wait for the rest of their squares.
pub(super) const WAITING: usize = PIXELS - 2 * RADIUS;

/// Values of sixteen rows in four planes, per pixel and channel.
pub(super) type Cells = [[[Lanes; 4]; CHANNELS]; PIXELS];

/// Windowed slopes of sixteen rows, per pixel and channel.
pub(super) type Waiting = [[[Lanes; 3]; CHANNELS]; WAITING];

/// The plane of cells where windowed slopes of a plane go: the last one is free, then that of the slopes
/// before.
#[inline(always)]
pub(super) fn behind(plane: usize) -> usize {
    (plane + 3) % 4
}

/// Rows, or their squares; results go elsewhere.
pub(super) struct Rows<'a, const SQUARED: bool> {
    pub rows: &'a Square,
    pub square: &'a mut Square,
}

impl<const SQUARED: bool> Line for Rows<'_, SQUARED> {
    #[inline(always)]
    fn get<S: Simd>(&self, simd: S, i: usize, index: usize) -> V<S> {
        let x = self.rows[i].get(simd, index);
        if SQUARED { x * x } else { x }
    }

    #[inline(always)]
    fn set<S: Simd>(&mut self, i: usize, index: usize, value: V<S>) {
        self.square[i].set(index, value);
    }
}

/// A plane of cells.
pub(super) struct Plane<T> {
    pub cells: T,
    pub plane: usize,
}

impl<const PLANES: usize> transpose::Rows for Plane<&[[Lanes; PLANES]; BLOCK]> {
    #[inline(always)]
    fn row(&self, i: usize) -> &Lanes {
        &self.cells[i][self.plane]
    }
}

impl<const PLANES: usize> Line for Plane<&mut [[Lanes; PLANES]; STEP]> {
    #[inline(always)]
    fn get<S: Simd>(&self, simd: S, i: usize, index: usize) -> V<S> {
        self.cells[i][self.plane].get(simd, index)
    }

    #[inline(always)]
    fn set<S: Simd>(&mut self, i: usize, index: usize, value: V<S>) {
        self.cells[i][self.plane].set(index, value);
    }
}

/// A plane of a channel of cells.
pub(super) struct Channel<'a> {
    pub cells: &'a mut Cells,
    pub channel: usize,
    pub plane: usize,
}

impl Line for Channel<'_> {
    #[inline(always)]
    fn get<S: Simd>(&self, simd: S, i: usize, index: usize) -> V<S> {
        self.cells[i][self.channel][self.plane].get(simd, index)
    }

    #[inline(always)]
    fn set<S: Simd>(&mut self, i: usize, index: usize, value: V<S>) {
        self.cells[i][self.channel][self.plane].set(index, value);
    }
}

/// A plane of slopes; results go `2 RADIUS` pixels back, to the plane that is free.
pub(super) struct Behind<'a> {
    pub slopes: Channel<'a>,
    pub waiting: &'a mut Waiting,
}

impl Behind<'_> {
    /// First are the results that waited.
    #[inline(always)]
    pub(super) fn begin<S: Simd>(&mut self, simd: S, index: usize) {
        let Channel { cells, channel, plane } = &mut self.slopes;
        for i in 0..WAITING {
            let waited = self.waiting[i][*channel][*plane].get(simd, index);
            cells[i][*channel][behind(*plane)].set(index, waited);
        }
    }
}

impl Line for Behind<'_> {
    #[inline(always)]
    fn get<S: Simd>(&self, simd: S, i: usize, index: usize) -> V<S> {
        self.slopes.get(simd, i, index)
    }

    #[inline(always)]
    fn set<S: Simd>(&mut self, i: usize, index: usize, value: V<S>) {
        let Channel { cells, channel, plane } = &mut self.slopes;
        if i < 2 * RADIUS {
            cells[WAITING + i][*channel][behind(*plane)].set(index, value);
        } else {
            self.waiting[i - 2 * RADIUS][*channel][*plane].set(index, value);
        }
    }
}
