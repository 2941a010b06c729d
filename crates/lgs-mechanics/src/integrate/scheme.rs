//! The scheme that suits a law, and its accelerations.

use super::body_field::BodyField;
use super::field::VectorField;
use super::kick_drift::KickDrift;
use super::kick_field::KickField;
use super::midpoint::Midpoint;
use super::stepper::Stepper;
use crate::coordinates::{Coordinates, State};
use crate::edit::Edit;
use crate::law::Law;

/// The acceleration by the terms of a law under an edit, that of the coordinates' own inertia included only
/// where it depends on the configuration, `[freedoms]`.
pub(crate) fn acceleration(law: &Law, edit: &Edit, state: &State) -> Vec<f64> {
    let mut a = vec![0.0; law.coordinates.freedoms()];
    if law.coordinates.has_rotation() {
        BodyField::new(law, edit).acceleration(&state.x, &state.v, &mut a);
    } else {
        VectorField::new(law, edit).acceleration(&state.x, &state.v, &mut a);
    }
    a
}

/// The scheme that suits a law.
pub(crate) fn stepper<'a>(law: &'a Law, edit: &Edit) -> Box<dyn Stepper + 'a> {
    if law.coordinates.has_rotation() {
        return Box::new(KickDrift::new(BodyField::new(law, edit)));
    }
    let field = VectorField::new(law, edit);
    match law.coordinates {
        Coordinates::Tree(_) => Box::new(Midpoint::new(field)),
        _ => Box::new(KickDrift::new(field)),
    }
}
