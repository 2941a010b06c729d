//! Turning pictures upright: cameras that are held sideways write frames as their sensors see them, and a
//! matrix by which players turn them.

use mp4_atom::Matrix;

/// A turn by a multiple of 90°, perhaps with a reflection: the signs of the matrix that maps a place in the
/// frame, x to the right and y down, to its place in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turn {
    /// Where x goes.
    x: [isize; 2],
    /// Where y goes.
    y: [isize; 2],
}

impl Turn {
    /// The turn nearest to the matrix of a track; scales and shifts are left out.
    pub(super) fn of(matrix: &Matrix) -> Self {
        let larger = |first: i32, second: i32| first.unsigned_abs() > second.unsigned_abs();
        let sign = |entry: i32| if entry < 0 { -1 } else { 1 };
        if larger(matrix.b, matrix.a) && larger(matrix.c, matrix.d) {
            Self { x: [0, sign(matrix.b)], y: [sign(matrix.c), 0] }
        } else {
            Self { x: [sign(matrix.a), 0], y: [0, sign(matrix.d)] }
        }
    }

    /// Width and height of the picture of a frame.
    pub(super) fn size(self, [width, height]: [usize; 2]) -> [usize; 2] {
        if self.x[0] == 0 { [height, width] } else { [width, height] }
    }

    /// The picture of a frame of `size`.
    pub(super) fn apply(self, frame: Vec<[u8; 3]>, size: [usize; 2]) -> Vec<[u8; 3]> {
        if self == (Self { x: [1, 0], y: [0, 1] }) {
            return frame;
        }
        let [width, height] = self.size(size);
        // Each row of the matrix has one entry, ±1: the inverse is the transpose, and −1 counts from the end.
        let place = |axis: [isize; 2], at: [usize; 2], length: usize| {
            let along = at[usize::from(axis[0] == 0)];
            if axis[0] + axis[1] < 0 { length - 1 - along } else { along }
        };
        let source = |at: [usize; 2]| place(self.y, at, size[1]) * size[0] + place(self.x, at, size[0]);
        let places = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        places.map(|at| frame[source(at)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The picture of a frame with two rows, 0 1 2 and 3 4 5.
    fn turned(a: i32, b: i32, c: i32, d: i32) -> (usize, Vec<u8>) {
        let scale = |entry: i32| entry << 16;
        let turn =
            Turn::of(&Matrix { a: scale(a), b: scale(b), c: scale(c), d: scale(d), ..Matrix::default() });
        let picture = turn.apply((0..6).map(|value| [value; 3]).collect(), [3, 2]);
        (turn.size([3, 2])[0], picture.iter().map(|pixel| pixel[0]).collect())
    }

    #[test]
    fn frames_are_turned_as_players_turn_them() {
        assert_eq!(turned(1, 0, 0, 1), (3, vec![0, 1, 2, 3, 4, 5]));
        assert_eq!(turned(0, 1, -1, 0), (2, vec![3, 0, 4, 1, 5, 2]), "a quarter clockwise");
        assert_eq!(turned(-1, 0, 0, -1), (3, vec![5, 4, 3, 2, 1, 0]));
        assert_eq!(turned(0, -1, 1, 0), (2, vec![2, 5, 1, 4, 0, 3]), "a quarter anticlockwise");
        assert_eq!(turned(-1, 0, 0, 1), (3, vec![2, 1, 0, 5, 4, 3]), "a mirror");
        assert_eq!(turned(0, 0, 0, 0), (3, vec![0, 1, 2, 3, 4, 5]), "no matrix");
    }
}
