//! Fourth order by composition of symmetric steps.

use super::stepper::{Solved, Stepper, Tangent};
use crate::coordinates::State;

/// `1 / (4 − ∛4)`: with two such parts, one of `1 − 4 s`, and two again, the third-order error of a symmetric
/// step cancels (Suzuki 1990).
const PART: f64 = 0.414_490_771_794_375_7;

/// Parts of a step.
const PARTS: [f64; 5] = [PART, PART, 1.0 - 4.0 * PART, PART, PART];

/// One step of fourth order.
pub(crate) fn advance(stepper: &mut dyn Stepper, state: &mut State, h: f64) -> Solved {
    PARTS.iter().try_for_each(|part| stepper.step(state, part * h))
}

/// One step of fourth order with its tangent.
pub(crate) fn advance_with_tangent(
    stepper: &mut dyn Stepper,
    state: &mut State,
    tangent: &mut Tangent,
    h: f64,
) -> Solved {
    PARTS.iter().try_for_each(|part| stepper.step_with_tangent(state, tangent, part * h))
}
