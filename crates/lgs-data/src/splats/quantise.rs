//! Opacities, colours and rotations as a few bits.

use lgs_core::SH_C0;
use lgs_core::linear::quat_normalize;

/// The nearest of 2^bits values that divide [0, 1] evenly.
pub(super) fn unit_to_bits(value: f32, bits: u32) -> u32 {
    let most = ((1_u32 << bits) - 1) as f32;
    (value * most).round().clamp(0.0, most) as u32
}

/// The value in [0, 1] of some bits, the lowest of `word`.
pub(super) fn unit_of_bits(word: u32, bits: u32) -> f32 {
    let most = (1_u32 << bits) - 1;
    (word & most) as f32 / most as f32
}

/// A byte for the opacity of a logit.
pub(super) fn opacity_byte(raw: f32) -> u8 {
    unit_to_bits(1.0 / (1.0 + (-raw).exp()), 8) as u8
}

/// The logit of an opacity byte.
pub(super) fn raw_opacity(byte: u8) -> f32 {
    raw_of_opacity(unit_of_bits(byte.into(), 8))
}

/// The logit of an opacity, held a quarter of a byte's step inside of [0, 1], whose own logits are infinite.
pub(super) fn raw_of_opacity(opacity: f32) -> f32 {
    let quarter = 0.25 / 255.0;
    let opacity = opacity.clamp(quarter, 1.0 - quarter);
    (opacity / (1.0 - opacity)).ln()
}

/// The colour of a zeroth coefficient.
pub(super) fn color(dc: f32) -> f32 {
    0.5 + SH_C0 * dc
}

/// The zeroth coefficient of a colour.
pub(super) fn dc(color: f32) -> f32 {
    (color - 0.5) / SH_C0
}

/// A unit quaternion whose largest component, the index returned, is positive.
pub(super) fn largest_positive(rotation: [f32; 4]) -> ([f32; 4], usize) {
    let unit = quat_normalize(rotation);
    let largest = (1..4).fold(0, |best, i| if unit[i].abs() > unit[best].abs() { i } else { best });
    (if unit[largest] < 0.0 { unit.map(|v| -v) } else { unit }, largest)
}

/// The unit quaternion of three components and the index of the fourth, which is positive.
pub(super) fn complete(largest: usize, others: [f32; 3]) -> [f32; 4] {
    let squares: f32 = others.iter().map(|v| v * v).sum();
    let mut rest = others.into_iter();
    let mut component =
        |i| if i == largest { (1.0 - squares).max(0.0).sqrt() } else { rest.next().unwrap_or(0.0) };
    std::array::from_fn(&mut component)
}
