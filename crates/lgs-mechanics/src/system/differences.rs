//! Derivatives of motions with impacts, by central differences.

use super::sensitivity::Sensitivity;
use crate::coordinates::State;
use crate::error::MechanicsError;
use crate::law::Law;
use crate::thresholds::DIFFERENCE;
use nalgebra::DMatrix;

/// The motion of a law from a start.
type Motion<'a> = dyn Fn(&Law, &State) -> Result<Vec<State>, MechanicsError> + 'a;

/// The states of a motion with their derivatives by start and parameters.
pub(super) fn of(motion: &Motion<'_>, law: &Law, start: &State) -> Result<Vec<Sensitivity>, MechanicsError> {
    let n = law.coordinates.freedoms();
    let columns = 2 * n + law.parameters.len();
    let zeros = DMatrix::zeros(n, columns);
    let states = motion(law, start)?;
    let unmoved = |state| Sensitivity { state, position: zeros.clone(), velocity: zeros.clone() };
    let mut found: Vec<Sensitivity> = states.into_iter().map(unmoved).collect();
    for column in 0..columns {
        let step = DIFFERENCE * size(law, start, column);
        let [above, below] = [step, -step].map(|step| {
            let (law, start) = moved(law, start, column, step);
            motion(&law, &start)
        });
        for (sample, (above, below)) in found.iter_mut().zip(above?.iter().zip(&below?)) {
            let change = law.coordinates.difference(&below.x, &above.x);
            for (i, change) in change.iter().enumerate() {
                sample.position[(i, column)] = change / (2.0 * step);
                sample.velocity[(i, column)] = (above.v[i] - below.v[i]) / (2.0 * step);
            }
        }
    }
    Ok(found)
}

/// Size of an unknown: a radian or a length for changes of place, at least 1 for all others.
fn size(law: &Law, start: &State, column: usize) -> f64 {
    let n = start.v.len();
    match column {
        place if place < n => 1.0,
        place if place < 2 * n => start.v[place - n].abs().max(1.0),
        place => law.parameters[place - 2 * n].abs().max(1.0),
    }
}

/// Law and start with one unknown moved by a step.
fn moved(law: &Law, start: &State, column: usize, step: f64) -> (Law, State) {
    let (mut law, mut start) = (law.clone(), start.clone());
    let n = start.v.len();
    match column {
        place if place < n => {
            let change: Vec<f64> = (0..n).map(|i| if i == place { step } else { 0.0 }).collect();
            start.x = law.coordinates.retract(&start.x, &change);
        }
        place if place < 2 * n => start.v[place - n] += step,
        place => law.parameters[place - 2 * n] += step,
    }
    (law, start)
}
