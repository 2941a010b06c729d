//! Symmetric matrices with few parameters: the forms that stiffness and damping share.

use super::kind::Block;
use crate::parameter::{Parameter, Space, axis_name};
use crate::thresholds::SMALLEST_EIGENVALUE;
use nalgebra::{DMatrix, SymmetricEigen};
use smallvec::SmallVec;

/// Form of a symmetric matrix `K`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// `k I` with `k ≥ 0`.
    Isotropic,
    /// One `k ≥ 0` for each coordinate.
    Diagonal,
    /// `|m|² I − m mᵀ`: acts across the axis `m`, three dimensions only.
    Axial,
    /// Any symmetric matrix: rows of the upper triangle.
    Full,
    /// `L Lᵀ` with a lower triangle `L`, row by row: positive semidefinite.
    Positive,
}

impl Form {
    /// Whether the form is one of its own in a dimension.
    pub(crate) fn suits(self, dimension: usize) -> bool {
        match self {
            Self::Isotropic => true,
            Self::Axial => dimension == 3,
            Self::Diagonal | Self::Full | Self::Positive => dimension >= 2,
        }
    }

    /// Parameters of a matrix with the unit `timeᵗ`.
    pub(crate) fn parameters(self, name: &str, space: Space, time: i32) -> Vec<Parameter> {
        let d = space.dimension;
        let pair = |i, j| format!("{name}-{}{}", axis_name(d, i), axis_name(d, j));
        match self {
            Self::Isotropic => vec![Parameter::linear(name, 0, time).within(0.0, f64::INFINITY)],
            Self::Diagonal => {
                (0..d).map(|i| Parameter::linear(pair(i, i), 0, time).within(0.0, f64::INFINITY)).collect()
            }
            Self::Axial => (0..3).map(|i| root(format!("{name}-axis-{}", axis_name(d, i)), time)).collect(),
            Self::Full => upper(d).map(|(i, j)| Parameter::linear(pair(i, j), 0, time)).collect(),
            Self::Positive => lower(d).map(|(i, j)| root(format!("{}-root", pair(i, j)), time)).collect(),
        }
    }

    /// `force −= K r`.
    pub(crate) fn subtract(self, p: &[f64], r: &[f64], force: &mut [f64]) {
        let d = r.len();
        match self {
            Self::Isotropic => force.iter_mut().zip(r).for_each(|(f, r)| *f -= p[0] * r),
            Self::Diagonal => (0..d).for_each(|i| force[i] -= p[i] * r[i]),
            Self::Axial => {
                let (square, along) = (dot(p, p), dot(p, r));
                (0..3).for_each(|i| force[i] -= square * r[i] - p[i] * along);
            }
            Self::Full => upper(d).zip(p).for_each(|((i, j), k)| {
                force[i] -= k * r[j];
                if i != j {
                    force[j] -= k * r[i];
                }
            }),
            Self::Positive => {
                for column in 0..d {
                    let u: f64 = (column..d).map(|row| p[lower_index(row, column)] * r[row]).sum();
                    (column..d).for_each(|row| force[row] -= p[lower_index(row, column)] * u);
                }
            }
        }
    }

    /// `½ rᵀ K r`.
    pub(crate) fn half_square(self, p: &[f64], r: &[f64]) -> f64 {
        let mut image = vec![0.0; r.len()];
        self.subtract(p, r, &mut image);
        -0.5 * dot(&image, r)
    }

    /// Writes `−K` and `−∂(K r)/∂p`, the latter into the columns from 0.
    pub(crate) fn derivatives(self, p: &[f64], r: &[f64], by_r: &mut Block, by_p: &mut Block) {
        let d = r.len();
        for i in 0..d {
            by_r.row_mut(i)[..d].iter_mut().enumerate().for_each(|(j, k)| *k = -self.entry(p, d, [i, j]));
        }
        match self {
            Self::Isotropic => (0..d).for_each(|i| by_p[(i, 0)] = -r[i]),
            Self::Diagonal => (0..d).for_each(|i| by_p[(i, i)] = -r[i]),
            Self::Axial => {
                let along = dot(p, r);
                for i in 0..3 {
                    for j in 0..3 {
                        let same = if i == j { along } else { 0.0 };
                        by_p[(i, j)] = same + p[i] * r[j] - 2.0 * p[j] * r[i];
                    }
                }
            }
            Self::Full => upper(d).enumerate().for_each(|(column, (i, j))| {
                by_p[(i, column)] = -r[j];
                by_p[(j, column)] = -r[i];
            }),
            Self::Positive => {
                for (at, (i, j)) in lower(d).enumerate() {
                    by_p[(i, at)] -= (j..d).map(|row| p[lower_index(row, j)] * r[row]).sum::<f64>();
                    (j..d).for_each(|row| by_p[(row, at)] -= p[lower_index(row, j)] * r[i]);
                }
            }
        }
    }

    /// The matrix.
    pub(crate) fn matrix(self, p: &[f64], d: usize) -> DMatrix<f64> {
        DMatrix::from_fn(d, d, |i, j| self.entry(p, d, [i, j]))
    }

    /// An entry of the matrix.
    fn entry(self, p: &[f64], d: usize, [i, j]: [usize; 2]) -> f64 {
        let (first, last) = (i.min(j), i.max(j));
        match self {
            Self::Isotropic | Self::Diagonal if i != j => 0.0,
            Self::Isotropic => p[0],
            Self::Diagonal => p[i],
            Self::Axial => (if i == j { dot(p, p) } else { 0.0 }) - p[i] * p[j],
            Self::Full => p[upper_index(first, last, d)],
            Self::Positive => (0..=first).map(|k| p[lower_index(i, k)] * p[lower_index(j, k)]).sum(),
        }
    }

    /// Columns that the form offers to regression: those of the smallest linear form that holds it.
    pub(crate) fn regressed(self) -> Self {
        if matches!(self, Self::Isotropic | Self::Diagonal) { self } else { Self::Full }
    }

    /// The parameters whose matrix is nearest to the one regressed, whose coefficients these are.
    pub(crate) fn nearest(self, coefficients: &[f64], d: usize) -> Vec<f64> {
        match self {
            Self::Isotropic | Self::Diagonal => coefficients.iter().map(|k| k.max(0.0)).collect(),
            Self::Full => coefficients.to_vec(),
            Self::Axial => axial(&SymmetricEigen::new(full_matrix(coefficients, d))),
            Self::Positive => positive_root(&SymmetricEigen::new(full_matrix(coefficients, d))),
        }
    }
}

/// A parameter whose square has the unit `timeᵗ`.
fn root(name: String, time: i32) -> Parameter {
    Parameter::linear(name, 0, time).root(2.0)
}

/// The axis along the eigenvector of the smallest eigenvalue, as long as the others say.
fn axial(eigen: &SymmetricEigen<f64, nalgebra::Dyn>) -> Vec<f64> {
    let axis = eigen.eigenvalues.imin();
    let square = 0.5 * (eigen.eigenvalues.sum() - eigen.eigenvalues[axis]);
    eigen.eigenvectors.column(axis).iter().map(|v| v * square.max(0.0).sqrt()).collect()
}

/// The lower triangular root of the matrix with its negative eigenvalues raised to (almost) zero.
fn positive_root(eigen: &SymmetricEigen<f64, nalgebra::Dyn>) -> Vec<f64> {
    let least = (SMALLEST_EIGENVALUE * eigen.eigenvalues.amax()).max(f64::MIN_POSITIVE.sqrt());
    let values = eigen.eigenvalues.map(|value| value.max(least));
    let matrix = &eigen.eigenvectors * DMatrix::from_diagonal(&values) * eigen.eigenvectors.transpose();
    let d = values.len();
    match matrix.cholesky() {
        Some(factor) => lower(d).map(|(i, j)| factor.l_dirty()[(i, j)]).collect(),
        None => lower(d).map(|(i, j)| if i == j { values.max().sqrt() } else { 0.0 }).collect(),
    }
}

/// The symmetric matrix of its upper triangle, row by row.
pub(crate) fn full_matrix(p: &[f64], d: usize) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(d, d);
    for ((i, j), &value) in upper(d).zip(p) {
        matrix[(i, j)] = value;
        matrix[(j, i)] = value;
    }
    matrix
}

/// Index pairs of the upper triangle, row by row.
pub(crate) fn upper(d: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..d).flat_map(move |i| (i..d).map(move |j| (i, j)))
}

/// Index pairs of the lower triangle, row by row.
fn lower(d: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..d).flat_map(|i| (0..=i).map(move |j| (i, j)))
}

/// Place of an entry in the upper triangle of a matrix of `d` rows.
fn upper_index(i: usize, j: usize, d: usize) -> usize {
    i * (2 * d - i + 1) / 2 + j - i
}

/// Place of an entry in the lower triangle.
fn lower_index(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

/// A place from a centre, `y − c`.
pub(crate) fn offset(center: &[f64], y: &[f64]) -> SmallVec<[f64; 6]> {
    y.iter().zip(center).map(|(y, c)| y - c).collect()
}

/// Inner product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
