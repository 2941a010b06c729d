//! The share of the force Q in a system's accelerations.

use lgs_core::geometry::wide;
use lgs_dynamics::System;

/// `‖Q‖/‖∇U‖` over some states; `‖Q‖` without a potential.
pub(crate) fn force_ratio(system: &System, q: &[[f32; 3]], v: &[[f32; 3]]) -> f64 {
    let size = |rows: &[[f32; 3]]| rows.iter().map(|&r| wide(r).length_squared()).sum::<f64>().sqrt();
    let (force, gradient) = (size(&system.forces(q, v)), size(&system.potential_gradients(q)));
    if gradient > 0.0 { force / gradient } else { force }
}
