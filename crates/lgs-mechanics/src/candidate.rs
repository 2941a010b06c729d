//! Candidates of a fit: coordinates and terms whose parameters are to be found.

use crate::coordinates::{Coordinates, State};
use crate::error::MechanicsError;
use crate::integrate::{self, Design};
use crate::law::{Law, check_term, parameter_count, parameter_table, ranges, space_of, unknown_count};
use crate::terms::{Entry, Scales, Term};

/// Coordinates and terms without values of their parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Coordinates of the object.
    pub coordinates: Coordinates,
    /// Terms, in the order of their parameters.
    pub terms: Vec<Term>,
}

/// A parameter of a candidate, in world units.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeParameter {
    /// Name of the term and of the parameter in it.
    pub name: String,
    /// A typical size of changes.
    pub scale: f64,
    /// Smallest allowed value.
    pub lower: f64,
    /// Largest allowed value.
    pub upper: f64,
    /// How it enters.
    pub entry: Entry,
    /// Standard deviation of its normal prior about the value that fits start from; infinite without one.
    pub spread: f64,
    /// Point from which a place is measured, 0 for everything else.
    pub origin: f64,
}

impl Candidate {
    /// A candidate; an error if a term cannot act where it is placed.
    pub fn new(coordinates: Coordinates, terms: Vec<Term>) -> Result<Self, MechanicsError> {
        terms.iter().try_for_each(|term| check_term(&coordinates, term))?;
        Ok(Self { coordinates, terms })
    }

    /// Number of parameters.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        parameter_count(&self.coordinates, &self.terms)
    }

    /// Number of unknowns beside the start: parameters that are fitted, and what terms take for granted.
    #[must_use]
    pub fn unknown_count(&self) -> usize {
        unknown_count(&self.coordinates, &self.terms)
    }

    /// Number of columns that all terms offer to regression, see [`Self::design`].
    #[must_use]
    pub fn columns(&self) -> usize {
        self.terms.iter().map(|term| term.kind.columns(space_of(&self.coordinates, term))).sum()
    }

    /// The law with values of all parameters and a step.
    pub fn law(&self, parameters: Vec<f64>, step: f64) -> Result<Law, MechanicsError> {
        Law::new(self.coordinates.clone(), self.terms.clone(), parameters, step)
    }

    /// Description of all parameters: those of the coordinates, then those of each term.
    #[must_use]
    pub fn parameters(&self, scales: &Scales) -> Vec<FreeParameter> {
        let table = parameter_table(&self.coordinates, &self.terms);
        let mut prefixes = vec![String::new(); self.coordinates.parameters().len()];
        let mut places = vec![0_usize; prefixes.len()];
        for (term, range) in self.terms.iter().zip(ranges(&self.coordinates, &self.terms)) {
            prefixes.extend(range.clone().map(|_| format!("{}.{}.", term.port.name(), term.kind.name())));
            let mut next = 0;
            places.extend(range.map(|index| {
                next += usize::from(table[index].0.entry == Entry::Place);
                next.saturating_sub(1)
            }));
        }
        let describe = |(((parameter, space), prefix), place): (((_, _), String), usize)| {
            let parameter: crate::terms::Parameter = parameter;
            let scale = scales.of(&parameter, space);
            let origins = scales.origin_of(space);
            let is_place = parameter.entry == Entry::Place;
            let origin =
                origins.get(place % origins.len().max(1)).copied().filter(|_| is_place).unwrap_or(0.0);
            FreeParameter {
                name: format!("{prefix}{}", parameter.name),
                scale,
                lower: origin + parameter.bounds[0] * scale,
                upper: origin + parameter.bounds[1] * scale,
                entry: parameter.entry,
                spread: parameter.spread * scale,
                origin,
            }
        };
        table.into_iter().zip(prefixes).zip(places).map(describe).collect()
    }

    /// Values to start a fit from: every combination of the starts of coordinates and terms. Parameters to
    /// which forces are proportional are zero, see [`Self::with_coefficients`].
    #[must_use]
    pub fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        let mut starts = vec![self.coordinates.start()];
        for term in &self.terms {
            let own = term.kind.starts(space_of(&self.coordinates, term), scales);
            starts = starts
                .iter()
                .flat_map(|start| own.iter().map(|own| [start.as_slice(), own].concat()))
                .collect();
        }
        starts
    }

    /// The columns of linear regression: with coefficients they add up to the
    /// [inertial force](Self::inertial_force).
    #[must_use]
    pub fn design(&self) -> Design<'_> {
        Design::new(&self.coordinates, &self.terms)
    }

    /// The left side of the equation of motion, `M a + ∂(M v)/∂x v − ½ ∂(v·M v)/∂x`, for an acceleration `a`
    /// `[n]`; torques are in units of the middle moment of inertia, pairs are divided by their masses.
    #[must_use]
    pub fn inertial_force(&self, p: &[f64], state: &State, acceleration: &[f64]) -> Vec<f64> {
        integrate::inertial_force(&self.coordinates, p, state, acceleration)
    }

    /// The parameters whose forces are nearest to the columns of [`Self::design`] with these coefficients.
    #[must_use]
    pub fn with_coefficients(&self, p: &[f64], coefficients: &[f64]) -> Vec<f64> {
        let mut values = p.to_vec();
        let mut first = 0;
        for (term, range) in self.terms.iter().zip(ranges(&self.coordinates, &self.terms)) {
            let space = space_of(&self.coordinates, term);
            let columns = term.kind.columns(space);
            let own = &coefficients[first..first + columns];
            values[range.clone()].copy_from_slice(&term.kind.regressed(&p[range], own, space));
            first += columns;
        }
        values
    }
}
