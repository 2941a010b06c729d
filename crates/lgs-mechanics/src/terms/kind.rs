//! The interface of a kind of term.

use crate::parameter::{Entry, Parameter, Scales, Space};
use std::fmt::Debug;
use std::ops::{Index, IndexMut};

/// Effect of a term on the energy of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// The force is the negative gradient of an energy; scaled by β in edits.
    Conserves,
    /// The power of the force is never positive.
    Dissipates,
    /// The power of the force is zero.
    Gyroscopic,
    /// The force may add energy: a law with such a term is *driven*.
    Drives,
}

/// How a kind of term is called, and what it does to the energy of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Label {
    /// Name in files and tables.
    pub name: &'static str,
    /// Effect on the energy.
    pub role: Role,
}

/// Position and velocity in the space of a term.
#[derive(Clone, Copy, Debug)]
pub struct At<'a> {
    /// Position `y`, `[d]`.
    pub y: &'a [f64],
    /// Velocity `w = ẏ`, `[d]`.
    pub w: &'a [f64],
}

/// A small matrix, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Block {
    columns: usize,
    values: Vec<f64>,
}

impl Block {
    /// A matrix of zeros.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { columns, values: vec![0.0; rows * columns] }
    }

    /// Takes a shape and fills the matrix with zeros; keeps its memory.
    pub fn reset(&mut self, rows: usize, columns: usize) {
        self.columns = columns;
        self.values.clear();
        self.values.resize(rows * columns, 0.0);
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// One row.
    #[must_use]
    pub fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.columns..(row + 1) * self.columns]
    }

    /// All values, row by row, to be written.
    pub(crate) fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// One row, to be written.
    pub fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[row * self.columns..(row + 1) * self.columns]
    }
}

impl Index<(usize, usize)> for Block {
    type Output = f64;

    fn index(&self, (row, column): (usize, usize)) -> &f64 {
        &self.values[row * self.columns + column]
    }
}

impl IndexMut<(usize, usize)> for Block {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut f64 {
        &mut self.values[row * self.columns + column]
    }
}

/// Derivatives of a force; kinds write into zeroed blocks.
#[derive(Clone, Debug, Default)]
pub struct Derivatives {
    /// By the position, `[d, d]`.
    pub y: Block,
    /// By the velocity, `[d, d]`.
    pub w: Block,
    /// By the parameters, `[d, parameters]`.
    pub p: Block,
}

impl Derivatives {
    /// Zeroed blocks for a space and a number of parameters.
    pub fn reset(&mut self, dimension: usize, parameters: usize) {
        self.y.reset(dimension, dimension);
        self.w.reset(dimension, dimension);
        self.p.reset(dimension, parameters);
    }
}

/// One kind of term, such as `linear-drag`.
///
/// Parameters are passed as a slice in the order of [`TermKind::parameters`]; the dimension of the space is
/// the length of `at.y`. Symmetric special cases (an isotropic spring) are kinds of their own.
pub trait TermKind: Debug + Send + Sync {
    /// Its name and role.
    fn label(&self) -> Label;

    /// Name in files and tables.
    fn name(&self) -> &'static str {
        self.label().name
    }

    /// Effect on the energy.
    fn role(&self) -> Role {
        self.label().role
    }

    /// Whether the kind makes sense in a space.
    fn suits(&self, space: Space) -> bool;

    /// The parameters in a space, in order.
    fn parameters(&self, space: Space) -> Vec<Parameter>;

    /// Unknowns that a force of this kind takes for granted beside its parameters, which count against a law.
    fn assumed_unknowns(&self, _space: Space) -> usize {
        0
    }

    /// The energy whose negative gradient is the force; zero for a kind that does not conserve.
    fn energy(&self, _p: &[f64], _y: &[f64]) -> f64 {
        0.0
    }

    /// Writes the force, `[d]`.
    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]);

    /// Writes the non-zero derivatives of the force into zeroed blocks.
    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives);

    /// Whether the force depends on the velocity.
    fn depends_on_velocity(&self) -> bool {
        self.role() != Role::Conserves && self.role() != Role::Drives
    }

    /// Values to start a fit from, world units: at least one. Linear parameters are left at zero, weak-form
    /// regression fills them in; parameters that enter in another way get several values.
    fn starts(&self, space: Space, scales: &Scales) -> Vec<Vec<f64>> {
        vec![default_start(&self.parameters(space), space, scales)]
    }

    /// Number of columns that the kind offers to linear regression.
    fn columns(&self, space: Space) -> usize {
        self.parameters(space).iter().filter(|parameter| parameter.entry == Entry::Linear).count()
    }

    /// Writes the columns of linear regression into zeros `[d, columns]`; their combination is the force, and
    /// parameters that do not enter linearly have the values in `p`. Those that do have the indices `linear`.
    fn design(&self, p: &[f64], at: At<'_>, linear: &[usize], out: &mut Block) {
        let mut derivatives = Derivatives::default();
        derivatives.reset(at.y.len(), p.len());
        self.derivatives(p, at, &mut derivatives);
        for (column, &index) in linear.iter().enumerate() {
            for row in 0..at.y.len() {
                out[(row, column)] = derivatives.p[(row, index)];
            }
        }
    }

    /// The parameters whose force is the combination of the columns of [`Self::design`] with `coefficients`,
    /// or is nearest to it.
    fn regressed(&self, p: &[f64], coefficients: &[f64], space: Space) -> Vec<f64> {
        let mut values = p.to_vec();
        for (&coefficient, index) in coefficients.iter().zip(linear_entries(&self.parameters(space))) {
            values[index] = coefficient;
        }
        values
    }
}

/// Indices of the linear parameters.
pub(crate) fn linear_entries(parameters: &[Parameter]) -> impl Iterator<Item = usize> {
    parameters.iter().enumerate().filter(|(_, p)| p.entry == Entry::Linear).map(|(index, _)| index)
}

/// Places at the origin of the scales, everything else at the number in the bounds that is nearest to zero.
pub(crate) fn default_start(parameters: &[Parameter], space: Space, scales: &Scales) -> Vec<f64> {
    let origin = scales.origin_of(space);
    let mut places = origin.iter().cycle();
    let start = |parameter: &Parameter| match parameter.entry {
        Entry::Place => *places.next().unwrap_or(&0.0),
        _ => 0.0_f64.clamp(parameter.bounds[0], parameter.bounds[1]) * scales.of(parameter, space),
    };
    parameters.iter().map(start).collect()
}
