//! Sizes of coordinates, the ports that they offer, their own parameters, and changes of a configuration.

use super::{Coordinates, Inertia, InertiaForm, Port, Site, State};
use crate::error::MechanicsError;
use crate::parameter::{Parameter, Quantity, Space};
use crate::thresholds::UNIT_TOLERANCE;
use glam::DVec3;
use lgs_core::geometry::{components, quaternion, rotate_by, rotation_vector};

impl Coordinates {
    /// Name in files and tables.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Rigid(_) => "rigid",
            Self::Hinge(_) => "hinge",
            Self::Slider(_) => "slider",
            Self::Rolling(_) => "rolling",
            Self::Ball(_) => "ball",
            Self::Modal(_) => "modal",
            Self::Tree(_) => "tree",
            Self::Pair => "pair",
        }
    }

    /// Degrees of freedom: length of `v` and of changes of `x`.
    #[must_use]
    pub fn freedoms(&self) -> usize {
        match self {
            Self::Point | Self::Ball(_) => 3,
            Self::Rigid(_) | Self::Pair => 6,
            Self::Hinge(_) | Self::Slider(_) | Self::Rolling(_) => 1,
            Self::Modal(modal) => modal.amplitudes(),
            Self::Tree(_) => 2,
        }
    }

    /// Number of bodies, each with a placement of its own.
    #[must_use]
    pub fn bodies(&self) -> usize {
        if matches!(self, Self::Tree(_) | Self::Pair) { 2 } else { 1 }
    }

    /// Length of `x`.
    #[must_use]
    pub fn len(&self) -> usize {
        self.freedoms() + usize::from(self.has_rotation())
    }

    /// Whether there is no coordinate at all (modes without any amplitude).
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether `x` begins with a quaternion.
    #[must_use]
    pub fn has_rotation(&self) -> bool {
        self.inertia().is_some()
    }

    /// The inertia of rotations, where there are any.
    #[must_use]
    pub fn inertia(&self) -> Option<&Inertia> {
        match self {
            Self::Rigid(inertia) => Some(inertia),
            Self::Ball(ball) => Some(&ball.inertia),
            _ => None,
        }
    }

    pub(crate) fn inertia_mut(&mut self) -> Option<&mut Inertia> {
        match self {
            Self::Rigid(inertia) => Some(inertia),
            Self::Ball(ball) => Some(&mut ball.inertia),
            _ => None,
        }
    }

    /// Parameters of the kinetic energy, which come before those of the terms.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        match self {
            Self::Pair => {
                let mass_ratio = Parameter::nonlinear("mass-ratio", 0, 0).within(0.02, 50.0);
                let offset = |axis| Parameter::place("offset", axis, Space::PLACE);
                std::iter::once(mass_ratio).chain((0..3).map(offset)).collect()
            }
            Self::Tree(tree) => tree.parameters(),
            Self::Ball(ball) => ball.parameters(),
            _ => self.inertia().map_or_else(Vec::new, Inertia::parameters),
        }
    }

    /// Values of [`Self::parameters`] to start a fit from.
    #[must_use]
    pub fn start(&self) -> Vec<f64> {
        match self {
            Self::Pair => vec![1.0, 0.0, 0.0, 0.0],
            Self::Tree(tree) => tree.start(),
            _ => vec![0.0; self.parameters().len()],
        }
    }

    /// The space behind a port; `None` if these coordinates do not have it.
    #[must_use]
    pub fn space(&self, port: Port) -> Option<Space> {
        let space = |dimension, quantity| Some(Space { dimension, quantity });
        match (self, port) {
            (Self::Point, Port::Whole) | (Self::Rigid(_), Port::Center) => Some(Space::PLACE),
            (Self::Hinge(_), Port::Whole) => space(1, Quantity::Angle),
            (Self::Slider(_) | Self::Rolling(_), Port::Whole) => space(1, Quantity::Separation),
            (Self::Modal(modal), Port::Whole) => space(modal.amplitudes(), Quantity::Amplitude),
            (Self::Modal(modal), Port::Center) => modal.flies().then_some(Space::PLACE),
            (Self::Modal(modal), Port::Shape) if modal.flies() => {
                space(modal.deformation().len(), Quantity::Amplitude)
            }
            (Self::Tree(_), Port::First | Port::Second | Port::Between) => space(1, Quantity::Angle),
            (Self::Pair, Port::First | Port::Second | Port::Both) => Some(Space::PLACE),
            (Self::Pair, Port::Between) => space(3, Quantity::Separation),
            (Self::Rigid(_), Port::BodyAxes | Port::Spin | Port::InertialSpin | Port::Turn) => {
                space(3, Quantity::Rate)
            }
            (Self::Ball(_), Port::Spin | Port::InertialSpin | Port::Turn) => space(3, Quantity::Rate),
            (Self::Ball(_), Port::Arm) => space(3, Quantity::Separation),
            _ => None,
        }
    }

    /// All ports that the coordinates offer.
    #[must_use]
    pub fn ports(&self) -> Vec<Port> {
        use Port::{
            Arm, Between, BodyAxes, Both, Center, First, InertialSpin, Second, Shape, Spin, Turn, Whole,
        };
        let all =
            [Whole, First, Second, Both, Between, Center, Shape, BodyAxes, Spin, InertialSpin, Turn, Arm];
        all.into_iter().filter(|&port| self.space(port).is_some()).collect()
    }

    /// Where a term at a port acts in vector coordinates.
    pub(crate) fn sites(&self, port: Port) -> Vec<Site> {
        let half = self.freedoms() / 2;
        let [mass, offset] = [0, 1].map(|at| matches!(self, Self::Pair).then_some(at));
        match port {
            Port::Second => vec![Site::at(half)],
            Port::Center => vec![Site::at(self.freedoms() - 3)],
            Port::Both => vec![Site::at(0), Site::at(half)],
            Port::Between => vec![Site { plus: 0, minus: Some(half), mass, offset }],
            _ => vec![Site::at(0)],
        }
    }

    /// Root mean square displacement of the object's points per unit of each component of a change,
    /// `[freedoms]`: 1 for lengths, roots of the moments of inertia for rotations. Hinges and trees do not
    /// know the extent of their bodies: 1 per radian.
    #[must_use]
    pub fn levers(&self) -> Vec<f64> {
        let mut levers = vec![1.0; self.freedoms()];
        if let Some(inertia) = self.inertia() {
            let moments = match inertia.form {
                InertiaForm::Isotropic => [inertia.moments[1]; 3],
                _ => inertia.moments,
            };
            levers.iter_mut().zip(moments).for_each(|(lever, moment)| *lever = moment.sqrt());
        }
        levers
    }

    /// Applies a change `[freedoms]` to a configuration.
    #[must_use]
    pub fn retract(&self, x: &[f64], change: &[f64]) -> Vec<f64> {
        let add = |x: &[f64], change: &[f64]| x.iter().zip(change).map(|(x, d)| x + d).collect::<Vec<_>>();
        if !self.has_rotation() {
            return add(x, change);
        }
        let turned = rotate_by(quaternion(x), DVec3::from_slice(change));
        let mut moved = components(turned).to_vec();
        moved.extend(add(&x[4..], &change[3..]));
        moved
    }

    /// The change `[freedoms]` that [`Self::retract`] takes from one configuration to another.
    #[must_use]
    pub fn difference(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        let subtract = |to: &[f64], from: &[f64]| to.iter().zip(from).map(|(a, b)| a - b).collect::<Vec<_>>();
        if !self.has_rotation() {
            return subtract(to, from);
        }
        let mut change = rotation_vector(quaternion(from).inverse() * quaternion(to)).to_array().to_vec();
        change.extend(subtract(&to[4..], &from[4..]));
        change
    }

    /// Checks that a state has the sizes of these coordinates, is finite, and its quaternion has length 1.
    pub fn check_state(&self, state: &State) -> Result<(), MechanicsError> {
        for (what, list, expected) in [("x", &state.x, self.len()), ("v", &state.v, self.freedoms())] {
            if list.len() != expected {
                let what = format!("{what} of a state in {} coordinates", self.name());
                return Err(MechanicsError::Size { what, expected, found: list.len() });
            }
            if let Some(&value) = list.iter().find(|value| !value.is_finite()) {
                let (what, allowed) = (format!("{what} of a state"), "a finite number".to_owned());
                return Err(MechanicsError::OutOfBounds { what, value, allowed });
            }
        }
        let length = if self.has_rotation() { quaternion(&state.x).length() } else { 1.0 };
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            let (what, allowed) = ("length of a quaternion".to_owned(), "1".to_owned());
            return Err(MechanicsError::OutOfBounds { what, value: length, allowed });
        }
        Ok(())
    }
}

impl Coordinates {
    /// Checks that axes and quaternions have unit length, moments and radii are positive, and all is finite.
    pub fn check(&self) -> Result<(), MechanicsError> {
        let unit = |what: &str, vector: &[f64]| {
            let length = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
            let inside = (length - 1.0).abs() <= UNIT_TOLERANCE;
            if inside { Ok(()) } else { Err(bounds(format!("length of the {what}"), length, "1")) }
        };
        let positive = |what: &str, value: f64| {
            let inside = value > 0.0 && value.is_finite();
            if inside { Ok(()) } else { Err(bounds(what.to_owned(), value, "a positive number")) }
        };
        match self {
            Self::Hinge(hinge) => unit("axis", &hinge.axis)?,
            Self::Tree(tree) => unit("axis", &tree.axis)?,
            Self::Slider(slider) => unit("direction", &slider.direction)?,
            Self::Rolling(rolling) => {
                unit("axis", &rolling.axis)?;
                unit("direction", &rolling.direction)?;
                positive("radius", rolling.radius)?;
            }
            Self::Modal(modal) if modal.amplitudes() == 0 => {
                let what = "modes".to_owned();
                return Err(MechanicsError::Size { what, expected: 1, found: 0 });
            }
            Self::Point | Self::Pair | Self::Rigid(_) | Self::Ball(_) | Self::Modal(_) => {}
        }
        if let Some(inertia) = self.inertia() {
            unit("frame", &inertia.frame)?;
            inertia.moments.iter().try_for_each(|&moment| positive("moment of inertia", moment))?;
        }
        Ok(())
    }
}

fn bounds(what: String, value: f64, allowed: &str) -> MechanicsError {
    MechanicsError::OutOfBounds { what, value, allowed: allowed.to_owned() }
}
