//! A law of motion: coordinates, terms and the values of all parameters.

use crate::contact::{self, Contact, Impact};
use crate::coordinates::{Coordinates, State};
use crate::error::MechanicsError;
use crate::terms::{self, Parameter, Role, Space, Term};
use std::ops::Range;

/// A law of motion. Its parameters are those of the coordinates' kinetic energy, then those of each term.
#[derive(Clone, Debug, PartialEq)]
pub struct Law {
    /// Coordinates of the object.
    pub coordinates: Coordinates,
    /// Terms, in the order of their parameters.
    pub terms: Vec<Term>,
    /// Values of all parameters, world units.
    pub parameters: Vec<f64>,
    /// Standard deviation of each parameter; empty where none are known.
    pub deviations: Vec<f64>,
    /// Longest step of the integrator, in units of time.
    pub step: f64,
    /// The plane that the object collides with.
    pub contact: Option<Contact>,
    /// Impacts on the planes of the contact that are known from the track, times ascending: on the way back
    /// past one its change is taken back.
    pub impacts: Vec<Impact>,
    /// Impulses by what is outside of the law, times ascending: whatever the edit, the velocity changes at
    /// these times as given.
    pub impulses: Vec<Impact>,
}

impl Law {
    /// A law without deviations; an error if a term cannot act where it is placed, or the number of
    /// parameters or the step is wrong.
    pub fn new(
        coordinates: Coordinates,
        terms: Vec<Term>,
        parameters: Vec<f64>,
        step: f64,
    ) -> Result<Self, MechanicsError> {
        let law = Self {
            coordinates,
            terms,
            parameters,
            deviations: Vec::new(),
            step,
            contact: None,
            impacts: Vec::new(),
            impulses: Vec::new(),
        };
        law.check()?;
        Ok(law)
    }

    /// Number of unknowns beside the start: parameters that are fitted, and what terms take for granted.
    #[must_use]
    pub fn unknown_count(&self) -> usize {
        unknown_count(&self.coordinates, &self.terms)
    }

    /// Unknowns that its terms take for granted, which are among those.
    #[must_use]
    pub fn assumed_unknowns(&self) -> usize {
        assumed_unknowns(&self.coordinates, &self.terms)
    }

    /// Checks sizes, ports and that all numbers are finite.
    pub fn check(&self) -> Result<(), MechanicsError> {
        for term in &self.terms {
            check_term(&self.coordinates, term)?;
        }
        let expected = parameter_count(&self.coordinates, &self.terms);
        let size = |what: &str, found| MechanicsError::Size { what: what.to_owned(), expected, found };
        if self.parameters.len() != expected {
            return Err(size("parameters of a law", self.parameters.len()));
        }
        if !self.deviations.is_empty() && self.deviations.len() != expected {
            return Err(size("deviations of a law's parameters", self.deviations.len()));
        }
        if let Some(&value) = self.parameters.iter().chain(&self.deviations).find(|v| !v.is_finite()) {
            return Err(out_of_bounds("a parameter", value, "a finite number"));
        }
        if !(self.step > 0.0 && self.step.is_finite()) {
            return Err(out_of_bounds("the step", self.step, "a positive number"));
        }
        match &self.contact {
            Some(contact) => contact.check(&self.coordinates)?,
            None if self.impacts.is_empty() => {}
            None => {
                let (what, found) = ("impacts of a law without a plane".to_owned(), self.impacts.len());
                return Err(MechanicsError::Size { what, expected: 0, found });
            }
        }
        let freedoms = self.coordinates.freedoms();
        contact::check_order("impact", &self.impacts, freedoms)?;
        contact::check_order("impulse", &self.impulses, freedoms)
    }

    /// Description of all parameters with the space that each belongs to.
    #[must_use]
    pub fn table(&self) -> Vec<(Parameter, Space)> {
        parameter_table(&self.coordinates, &self.terms)
    }

    /// Where the parameters of a term lie.
    #[must_use]
    pub fn range(&self, term: usize) -> Range<usize> {
        ranges(&self.coordinates, &self.terms).swap_remove(term)
    }

    /// Multiplies the strength of each term by a factor: its energy or force, wherever the body is.
    ///
    /// # Errors
    /// If there are not as many factors as terms, or one is negative or not finite.
    pub fn scale_terms(&mut self, factors: &[f64]) -> Result<(), MechanicsError> {
        if factors.len() != self.terms.len() {
            let what = "factors of the terms".to_owned();
            return Err(MechanicsError::Size { what, expected: self.terms.len(), found: factors.len() });
        }
        for (index, (term, &factor)) in self.terms.iter().zip(factors).enumerate() {
            if !(factor >= 0.0 && factor.is_finite()) {
                return Err(out_of_bounds(&format!("the factor of term {index}"), factor, "at least 0"));
            }
            let parameters = term.kind.parameters(space_of(&self.coordinates, term));
            let values = &mut self.parameters[ranges(&self.coordinates, &self.terms).swap_remove(index)];
            values.iter_mut().zip(parameters).for_each(|(value, p)| *value = p.scaled(*value, factor));
        }
        Ok(())
    }

    /// Whether no velocity changes suddenly.
    #[must_use]
    pub fn is_smooth(&self) -> bool {
        self.contact.is_none() && self.impulses.is_empty()
    }

    /// All known sudden changes of velocity: impacts on planes, then impulses.
    pub fn events(&self) -> impl Iterator<Item = &Impact> {
        self.impacts.iter().chain(&self.impulses)
    }

    /// Whether a term may add energy.
    #[must_use]
    pub fn is_driven(&self) -> bool {
        self.terms.iter().any(|term| term.kind.role() == Role::Drives)
    }

    /// Whether every term has an energy.
    #[must_use]
    pub fn is_conservative(&self) -> bool {
        self.terms.iter().all(|term| term.kind.role() == Role::Conserves)
    }

    /// Whether a force depends on where the bodies are: on their places, on angles, or on each other's.
    #[must_use]
    pub fn has_varying_potential(&self) -> bool {
        let varies = |term: &Term| term.kind.role() == Role::Conserves && term.kind.name() != "uniform-field";
        self.terms.iter().any(varies)
    }

    /// Kinetic energy per mass.
    #[must_use]
    pub fn kinetic_energy(&self, state: &State) -> f64 {
        self.coordinates.kinetic_energy(&self.parameters, state)
    }

    /// Potential energy per mass, the sum over the terms that conserve.
    #[must_use]
    pub fn potential_energy(&self, state: &State) -> f64 {
        let ranges = ranges(&self.coordinates, &self.terms);
        let mut sum = 0.0;
        for (term, range) in self.terms.iter().zip(ranges) {
            if term.kind.role() == Role::Conserves {
                for (weight, y) in self.coordinates.positions(&self.parameters, term.port, state) {
                    sum += weight * term.kind.energy(&self.parameters[range.clone()], &y);
                }
            }
        }
        sum
    }

    /// Kinetic and potential energy per mass.
    #[must_use]
    pub fn energy(&self, state: &State) -> f64 {
        self.kinetic_energy(state) + self.potential_energy(state)
    }
}

/// Checks that a term can act where it is placed.
pub(crate) fn check_term(coordinates: &Coordinates, term: &Term) -> Result<(), MechanicsError> {
    match coordinates.space(term.port) {
        Some(space) if term.kind.suits(space) => Ok(()),
        _ => Err(MechanicsError::NoSuchPort {
            term: term.kind.name().to_owned(),
            port: term.port.name(),
            coordinates: coordinates.name(),
        }),
    }
}

/// The space of a term that was checked; an empty one otherwise.
pub(crate) fn space_of(coordinates: &Coordinates, term: &Term) -> Space {
    coordinates.space(term.port).unwrap_or(Space { dimension: 0, quantity: terms::Quantity::Rate })
}

/// Where the parameters of each term lie.
pub(crate) fn ranges(coordinates: &Coordinates, terms: &[Term]) -> Vec<Range<usize>> {
    let mut end = coordinates.parameters().len();
    let next = |term: &Term| {
        let start = end;
        end += term.kind.parameters(space_of(coordinates, term)).len();
        start..end
    };
    terms.iter().map(next).collect()
}

/// Number of parameters of coordinates and terms.
pub(crate) fn parameter_count(coordinates: &Coordinates, terms: &[Term]) -> usize {
    ranges(coordinates, terms).last().map_or(coordinates.parameters().len(), |range| range.end)
}

/// Number of what is unknown of coordinates and terms: parameters that are fitted, and what terms take for
/// granted.
pub(crate) fn unknown_count(coordinates: &Coordinates, terms: &[Term]) -> usize {
    let table = parameter_table(coordinates, terms);
    let fitted = table.iter().filter(|(parameter, _)| parameter.entry != terms::Entry::Constant).count();
    fitted + assumed_unknowns(coordinates, terms)
}

fn assumed_unknowns(coordinates: &Coordinates, terms: &[Term]) -> usize {
    terms.iter().map(|term| term.kind.assumed_unknowns(space_of(coordinates, term))).sum()
}

/// Description of the parameters of coordinates and terms.
pub(crate) fn parameter_table(coordinates: &Coordinates, terms: &[Term]) -> Vec<(Parameter, Space)> {
    // Lengths among the coordinates' own parameters are measured by the extent of the path.
    let own = Space { dimension: 0, quantity: terms::Quantity::Separation };
    let mut table: Vec<(Parameter, Space)> =
        coordinates.parameters().into_iter().map(|parameter| (parameter, own)).collect();
    for term in terms {
        let space = space_of(coordinates, term);
        table.extend(term.kind.parameters(space).into_iter().map(|parameter| (parameter, space)));
    }
    table
}

fn out_of_bounds(what: &str, value: f64, allowed: &str) -> MechanicsError {
    MechanicsError::OutOfBounds { what: what.to_owned(), value, allowed: allowed.to_owned() }
}
