//! SiLU with its first two derivatives, and softplus, on whole rows.
//!
//! `φ(z) = z s`, `φ' = s (1 + z (1 − s))`, `φ'' = s (1 − s) (2 + z (1 − 2 s))` with `s = sigmoid(z)` (reference §8.3). The exponential is a
//! polynomial of degree 6 after reduction to ±½ ln 2 (relative error below 3e-7), so that the loops are vectorised.

use pulp::Arch;

/// `exp(x)` for x clamped to ±87, relative error below 3e-7.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    const ROUND: f32 = 12_582_912.0; // 1.5 · 2²³: adding it leaves the rounded integer in the low bits
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    // A NaN must stay one: `clamp` keeps it.
    let x = x.clamp(-87.0, 87.0);
    let shifted = x.mul_add(std::f32::consts::LOG2_E, ROUND);
    let power = shifted - ROUND;
    let f = power.mul_add(-LN2_LOW, power.mul_add(-LN2_HIGH, x));
    let mut p = 1.0_f32 / 720.0;
    for c in [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        p = p.mul_add(f, c);
    }
    p * f32::from_bits(shifted.to_bits().wrapping_add(127) << 23)
}

#[inline(always)]
fn sigmoid(z: f32) -> f32 {
    1.0 / (1.0 + exp(-z))
}

/// `out = φ(z)`.
pub(crate) fn silu(z: &[f32], out: &mut [f32]) {
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for (out, &z) in out.iter_mut().zip(z) {
                *out = z * sigmoid(z);
            }
        },
    );
}

/// `value = φ(z)` and `slope = φ'(z)`.
pub(crate) fn silu_with_slope(z: &[f32], value: &mut [f32], slope: &mut [f32]) {
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for ((value, slope), &z) in value.iter_mut().zip(slope).zip(z) {
                let s = sigmoid(z);
                *value = z * s;
                *slope = s * z.mul_add(1.0 - s, 1.0);
            }
        },
    );
}

/// Backwards through `e = φ'(z) g` given `v_e`: overwrites `v_e` with `v_g` and writes the part of `v_z` that comes through `φ''`.
pub(crate) fn slope_product_vjp(z: &[f32], g: &[f32], v_e: &mut [f32], v_z: &mut [f32]) {
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for (((v_e, v_z), &z), &g) in v_e.iter_mut().zip(v_z).zip(z).zip(g) {
                let s = sigmoid(z);
                let curvature = s * (1.0 - s) * z.mul_add(1.0 - 2.0 * s, 2.0);
                *v_z = curvature * g * *v_e;
                *v_e *= s * z.mul_add(1.0 - s, 1.0);
            }
        },
    );
}

/// `a ⊙ b`.
pub(crate) fn multiply(a: &[f32], b: &[f32], out: &mut [f32]) {
    for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *out = a * b;
    }
}

/// `softplus(x) = ln(1 + eˣ)`, and its slope, the sigmoid.
#[inline(always)]
pub(crate) fn softplus(x: f32) -> (f32, f32) {
    let e = (-x.abs()).exp();
    (x.max(0.0) + e.ln_1p(), if x >= 0.0 { 1.0 / (1.0 + e) } else { e / (1.0 + e) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_keeps_its_bound() {
        for step in -8000..8000 {
            let x = step as f32 * 0.0107;
            let expected = f64::from(x).exp();
            assert!((f64::from(exp(x)) - expected).abs() <= 4e-7 * expected, "exp({x}) = {}", exp(x));
        }
        assert!(exp(f32::NAN).is_nan());
        assert!(exp(1e30).is_finite() && exp(-1e30) < 1e-37);
    }

    #[test]
    fn softplus_is_stable_at_both_ends() {
        assert_eq!(softplus(200.0), (200.0, 1.0));
        assert!(softplus(-200.0).0 >= 0.0 && softplus(-200.0).0 < 1e-30);
        assert!((softplus(0.3).0 - 0.3_f32.exp().ln_1p()).abs() < 1e-6);
    }
}
