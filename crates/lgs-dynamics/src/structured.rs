//! The structured force of a lane, `−softplus(d − 6) v + w × v`, from the outputs `[1 + 3, WIDTH]` of its
//! network: d and w.

use crate::block::{Vec3Rows, WIDTH, ZERO_ROWS};
use crate::system::DAMPING_SHIFT;

/// Damping, spin and velocity of a lane.
pub(crate) fn structured(outputs: &[f32], v: &Vec3Rows, lane: usize) -> (f32, [f32; 3], [f32; 3]) {
    let (damping, _) = softplus(outputs[lane] - DAMPING_SHIFT);
    let spin = std::array::from_fn(|axis| outputs[(1 + axis) * WIDTH + lane]);
    (damping, spin, std::array::from_fn(|axis| v[axis][lane]))
}

/// Backwards through `scale (−softplus(d − 6) v + w × v)`: writes the cotangents of the network's outputs and
/// returns those of the velocities.
pub(crate) fn structured_vjp(
    outputs: &[f32],
    v: &Vec3Rows,
    v_force: &Vec3Rows,
    scale: f32,
    v_outputs: &mut [f32],
) -> Vec3Rows {
    let mut v_velocity = ZERO_ROWS;
    for lane in 0..WIDTH {
        let (damping, spin, velocity) = structured(outputs, v, lane);
        let (_, slope) = softplus(outputs[lane] - DAMPING_SHIFT);
        let v_f: [f32; 3] = std::array::from_fn(|axis| scale * v_force[axis][lane]);
        let power: f32 = (0..3).map(|axis| v_f[axis] * velocity[axis]).sum();
        v_outputs[lane] = -slope * power;
        for axis in 0..3 {
            let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
            // ⟨f̄, w × v⟩ = ⟨w, v × f̄⟩ = ⟨v, f̄ × w⟩
            v_outputs[(1 + axis) * WIDTH + lane] = velocity[j] * v_f[k] - velocity[k] * v_f[j];
            v_velocity[axis][lane] = v_f[j] * spin[k] - v_f[k] * spin[j] - damping * v_f[axis];
        }
    }
    v_velocity
}

/// `softplus(x) = ln(1 + eˣ)`, and its slope, the sigmoid.
#[inline(always)]
fn softplus(x: f32) -> (f32, f32) {
    let e = (-x.abs()).exp();
    (x.max(0.0) + e.ln_1p(), if x >= 0.0 { 1.0 / (1.0 + e) } else { e / (1.0 + e) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn softplus_is_stable_at_both_ends() {
        assert_eq!(softplus(200.0), (200.0, 1.0));
        assert!(softplus(-200.0).0 >= 0.0 && softplus(-200.0).0 < 1e-30);
        assert!((softplus(0.3).0 - 0.3_f32.exp().ln_1p()).abs() < 1e-6);
    }
}
