//! Positional encoding (method §3.1): `[v, sin(2⁰v), cos(2⁰v), …, sin(2^{L−1}v),
//! cos(2^{L−1}v)]`, no factor π.

/// Numbers per encoded vector of `dimensions` with `frequencies`.
#[must_use]
pub fn encoded_width(dimensions: usize, frequencies: usize) -> usize {
    dimensions * (1 + 2 * frequencies)
}

/// Encodes one vector into `out`, whose entries lie `stride` floats apart (1: contiguous; the block length:
/// feature-major).
pub fn encode_into(vector: &[f32], frequencies: usize, out: &mut [f32], stride: usize) {
    let d = vector.len();
    for (i, &v) in vector.iter().enumerate() {
        out[i * stride] = v;
        let mut frequency = 1.0;
        for l in 0..frequencies {
            let (sin, cos) = (frequency * v).sin_cos();
            out[(d * (1 + 2 * l) + i) * stride] = sin;
            out[(d * (2 + 2 * l) + i) * stride] = cos;
            frequency *= 2.0;
        }
    }
}

/// Encodes one vector.
#[must_use]
pub fn encode(vector: &[f32], frequencies: usize) -> Vec<f32> {
    let mut out = vec![0.0; encoded_width(vector.len(), frequencies)];
    encode_into(vector, frequencies, &mut out, 1);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_input_then_sine_and_cosine_by_frequency() {
        let found = encode(&[0.5, -1.0], 2);
        let expected = [
            0.5,
            -1.0,
            0.5_f32.sin(),
            (-1.0_f32).sin(),
            0.5_f32.cos(),
            (-1.0_f32).cos(),
            1.0_f32.sin(),
            (-2.0_f32).sin(),
            1.0_f32.cos(),
            (-2.0_f32).cos(),
        ];
        assert_eq!(found, expected);
    }
}
