//! Parameters of terms: names, units, scales and bounds, and the spaces that terms act on.

use crate::thresholds::PLACE_REACH;
use serde::{Deserialize, Serialize};

/// Physical dimension of a parameter: `lengthᵃ · timeᵇ`, where `length` is the unit of the space that the
/// term acts on (1 for angles).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Exponent of length; roots have halves.
    pub length: f64,
    /// Exponent of time; roots have halves.
    pub time: f64,
}

/// How a parameter enters a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// The force is proportional to it, together with the other linear ones.
    Linear,
    /// Any other way.
    Nonlinear,
    /// A coordinate of a point in the space, measured from the origin of the scales.
    Place,
    /// Kept in files and never fitted.
    Constant,
}

/// Description of one parameter of a term or of coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name in files and tables.
    pub name: String,
    /// Physical dimension.
    pub unit: Unit,
    /// Smallest and largest value in units of the scale; places are relative to the origin of the scales.
    pub bounds: [f64; 2],
    /// How it enters.
    pub entry: Entry,
    /// Standard deviation of its normal prior about the value that fits start from, in units of the scale;
    /// infinite without one. Places have a prior of their own.
    pub spread: f64,
    /// The force is proportional to this power of it, together with the other parameters that have a power;
    /// 0 for the others.
    pub power: f64,
}

impl Parameter {
    /// A parameter to which the force is proportional, without bounds.
    #[must_use]
    pub fn linear(name: impl Into<String>, length: i32, time: i32) -> Self {
        let bounds = [f64::NEG_INFINITY, f64::INFINITY];
        Self {
            name: name.into(),
            unit: Unit { length: f64::from(length), time: f64::from(time) },
            bounds,
            entry: Entry::Linear,
            spread: f64::INFINITY,
            power: 1.0,
        }
    }

    /// A parameter that enters in any other way, without bounds.
    #[must_use]
    pub fn nonlinear(name: impl Into<String>, length: i32, time: i32) -> Self {
        Self { entry: Entry::Nonlinear, power: 0.0, ..Self::linear(name, length, time) }
    }

    /// Coordinate `axis` of a fitted point; angles lie within a turn of the origin.
    #[must_use]
    pub fn place(name: &str, axis: usize, space: Space) -> Self {
        let reach = if space.quantity == Quantity::Angle { std::f64::consts::TAU } else { PLACE_REACH };
        let name = format!("{name}-{}", axis_name(space.dimension, axis));
        Self { entry: Entry::Place, power: 0.0, ..Self::linear(name, 1, 0) }.within(-reach, reach)
    }

    /// The parameter whose power `degree` this one describes.
    #[must_use]
    pub fn root(self, degree: f64) -> Self {
        let unit = Unit { length: self.unit.length / degree, time: self.unit.time / degree };
        Self { unit, entry: Entry::Nonlinear, power: degree, ..self }
    }

    /// Its value once the force is multiplied by a factor, which is not negative.
    #[must_use]
    pub fn scaled(&self, value: f64, factor: f64) -> f64 {
        if self.power > 0.0 { value * factor.powf(1.0 / self.power) } else { value }
    }

    /// The same with bounds in units of its scale.
    #[must_use]
    pub fn within(self, lower: f64, upper: f64) -> Self {
        Self { bounds: [lower, upper], ..self }
    }

    /// The same with a normal prior.
    #[must_use]
    pub fn spread(self, spread: f64) -> Self {
        Self { spread, ..self }
    }

    /// Those of its bounds that hold whatever the scales are: zeros, and the ones of numbers without a unit;
    /// infinite where a bound depends on a scale.
    #[must_use]
    pub fn absolute_bounds(&self) -> [f64; 2] {
        let is_scaled = self.entry == Entry::Place || self.unit.length != 0.0 || self.unit.time != 0.0;
        let [lower, upper] = self.bounds;
        let kept = |bound: f64, open: f64| if bound == 0.0 || !is_scaled { bound } else { open };
        [kept(lower, f64::NEG_INFINITY), kept(upper, f64::INFINITY)]
    }
}

/// Name of an axis of a space: x, y, z in space, numbers elsewhere.
pub(crate) fn axis_name(dimension: usize, axis: usize) -> String {
    match dimension {
        3 => ["x", "y", "z"][axis].to_owned(),
        _ => (axis + 1).to_string(),
    }
}

/// The kind of quantity that a space consists of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Positions in the world.
    Place,
    /// Differences of positions, or offsets along a rail: lengths whose zero has a meaning.
    Separation,
    /// An angle, radians.
    Angle,
    /// Amplitudes of deformation modes, lengths.
    Amplitude,
    /// A velocity without a position: the angular velocity of a body, or its velocity in body axes.
    Rate,
}

/// The vector space that a term acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Space {
    /// Number of components.
    pub dimension: usize,
    /// Kind of quantity.
    pub quantity: Quantity,
}

impl Space {
    /// Positions of a point in the world.
    pub const PLACE: Self = Self { dimension: 3, quantity: Quantity::Place };

    /// Whether terms can depend on the position in it.
    #[must_use]
    pub fn has_position(&self) -> bool {
        self.quantity != Quantity::Rate
    }

    /// Whether the space is one of lengths, in which a field can be uniform.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        !matches!(self.quantity, Quantity::Rate | Quantity::Angle)
    }
}

/// Scales of a motion, from which parameters get theirs, so that laws do not depend on world units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scales {
    /// Extent of the path, world units.
    pub length: f64,
    /// Length of the window, normalised time.
    pub time: f64,
    /// Centre of the path, world units.
    pub origin: [f64; 3],
    /// Principal directions of the path, rows of unit length.
    pub axes: [[f64; 3]; 3],
}

impl Scales {
    /// Unit scales about the world's origin.
    pub const UNIT: Self = Self {
        length: 1.0,
        time: 1.0,
        origin: [0.0; 3],
        axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };

    /// Unit of length of a space: 1 for angles and rates.
    #[must_use]
    pub fn length_of(&self, space: Space) -> f64 {
        if matches!(space.quantity, Quantity::Angle | Quantity::Rate) { 1.0 } else { self.length }
    }

    /// The scale of a parameter in a space.
    #[must_use]
    pub fn of(&self, parameter: &Parameter, space: Space) -> f64 {
        let Unit { length, time } = parameter.unit;
        self.length_of(space).powf(length) * self.time.powf(time)
    }

    /// The point of a space from which places are measured.
    #[must_use]
    pub fn origin_of(&self, space: Space) -> Vec<f64> {
        match space.quantity {
            Quantity::Place => self.origin[..space.dimension].to_vec(),
            _ => vec![0.0; space.dimension],
        }
    }

    /// Unit directions along which a term of the space may have its axis.
    #[must_use]
    pub fn directions_of(&self, space: Space) -> Vec<Vec<f64>> {
        match space.dimension {
            3 => self.axes.iter().map(|axis| axis.to_vec()).collect(),
            d => (0..d).map(|axis| (0..d).map(|i| f64::from(u8::from(i == axis))).collect()).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_in_units_of_a_scale_are_not_absolute_and_the_others_are() {
        let open = f64::INFINITY;
        let factor = Parameter::nonlinear("log-factor", 0, 0).within(-1.6, 1.6);
        assert_eq!(factor.absolute_bounds(), [-1.6, 1.6]);
        let drag = Parameter::linear("drag", 0, -1).within(0.0, 50.0);
        assert_eq!(drag.absolute_bounds(), [0.0, open]);
        let place = Parameter::place("centre", 0, Space::PLACE);
        assert_eq!(place.absolute_bounds(), [-open, open]);
    }
}
