//! Comparison of float arrays for tests: worst index, relative L2 error and cosine in one message; and
//! numbers to compare with other languages.

/// Numbers in [0, 1) from a 32-bit mixing of seed and index: the same in any language, for expected values
/// made by another program.
pub fn pseudo_random(count: usize, seed: u32) -> impl Iterator<Item = f64> {
    (0..count as u32).map(move |i| {
        let mut x = i.wrapping_add(seed.wrapping_mul(0x9E37_79B1));
        x = (x ^ x >> 16).wrapping_mul(0x7FEB_352D);
        x = (x ^ x >> 15).wrapping_mul(0x846C_A68B);
        f64::from((x ^ x >> 16) >> 8) / f64::from(1 << 24)
    })
}

/// [`pseudo_random`] numbers in ±`bound`.
#[must_use]
pub fn pseudo_random_within(bound: f64, count: usize, seed: u32) -> Vec<f32> {
    pseudo_random(count, seed).map(|v| ((2.0 * v - 1.0) * bound) as f32).collect()
}

/// The largest difference of two arrays.
#[derive(Clone, Copy, Debug)]
pub struct Distance {
    /// Largest absolute difference.
    pub max_abs: f64,
    /// Index of the largest difference.
    pub worst: usize,
    /// `‖a − b‖ / ‖b‖` (absolute where `b` is zero).
    pub relative_l2: f64,
    /// Cosine of the angle between the arrays (1 where both are zero).
    pub cosine: f64,
}

/// Measures `found` against `expected`.
///
/// # Panics
/// If the lengths differ or a value is not finite.
#[must_use]
pub fn distance(found: &[f32], expected: &[f32]) -> Distance {
    assert_eq!(found.len(), expected.len(), "lengths differ");
    let (mut max_abs, mut worst, mut diff2, mut norm2, mut found2, mut dot) = (0.0, 0, 0.0, 0.0, 0.0, 0.0);
    for (i, (&a, &b)) in found.iter().zip(expected).enumerate() {
        assert!(a.is_finite(), "value {i} is {a}, expected {b}");
        let (a, b) = (f64::from(a), f64::from(b));
        if (a - b).abs() > max_abs {
            (max_abs, worst) = ((a - b).abs(), i);
        }
        diff2 += (a - b) * (a - b);
        norm2 += b * b;
        found2 += a * a;
        dot += a * b;
    }
    let relative_l2 = if norm2 > 0.0 { (diff2 / norm2).sqrt() } else { diff2.sqrt() };
    let cosine = if norm2 > 0.0 && found2 > 0.0 {
        dot / (norm2 * found2).sqrt()
    } else {
        f64::from(u8::from(norm2 == found2))
    };
    Distance { max_abs, worst, relative_l2, cosine }
}

/// Asserts the agreement asked of values: largest difference and relative L2.
///
/// # Panics
/// If they differ by more.
pub fn assert_values_close(name: &str, found: &[f32], expected: &[f32], max_abs: f64, relative_l2: f64) {
    let d = distance(found, expected);
    assert!(
        d.max_abs <= max_abs && d.relative_l2 <= relative_l2,
        "{name}: {d:?}, found {} expected {}",
        found[d.worst],
        expected[d.worst]
    );
}

/// Asserts the agreement asked of gradients: relative L2 ≤ 1e-3 and cosine ≥ 0.99999, and no gradient missing
/// altogether.
///
/// # Panics
/// If they differ by more.
pub fn assert_gradient_close(name: &str, found: &[f32], expected: &[f32]) {
    let d = distance(found, expected);
    assert!(d.relative_l2 <= 1e-3 && d.cosine >= 0.99999, "{name}: {d:?}");
}
