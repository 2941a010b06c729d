//! Blocks of particles.
//!
//! A block holds [`WIDTH`] particles; positions, velocities and forces lie feature-major,
//! `[features, WIDTH]`, as the networks read them. The last block of a set is padded with copies of its first
//! particle; the padding's cotangents are zero.

/// Particles in a block. Results do not depend on how blocks are spread over threads.
pub(crate) const WIDTH: usize = 64;

/// A row of a block: one feature of every particle.
pub(crate) type Row = [f32; WIDTH];

/// Three rows: x, y and z of every particle.
pub(crate) type Vec3Rows = [Row; 3];

/// Three rows of zeros.
pub(crate) const ZERO_ROWS: Vec3Rows = [[0.0; WIDTH]; 3];

/// Particles of a block, as rows; missing ones repeat the first.
pub(crate) fn gather(points: &[[f32; 3]]) -> Vec3Rows {
    let mut rows = ZERO_ROWS;
    for lane in 0..WIDTH {
        let point = points[if lane < points.len() { lane } else { 0 }];
        for axis in 0..3 {
            rows[axis][lane] = point[axis];
        }
    }
    rows
}

/// Cotangents of a block, as rows; missing ones are zero.
pub(crate) fn gather_or_zero(points: &[[f32; 3]]) -> Vec3Rows {
    let mut rows = ZERO_ROWS;
    for (lane, point) in points.iter().enumerate() {
        for axis in 0..3 {
            rows[axis][lane] = point[axis];
        }
    }
    rows
}

/// Writes the first rows' lanes back to particles.
pub(crate) fn scatter(rows: &Vec3Rows, points: &mut [[f32; 3]]) {
    for (lane, point) in points.iter_mut().enumerate() {
        *point = std::array::from_fn(|axis| rows[axis][lane]);
    }
}

/// `a + s b`, in place.
pub(crate) fn add_scaled(a: &mut Vec3Rows, b: &Vec3Rows, s: f32) {
    for (x, &y) in a.as_flattened_mut().iter_mut().zip(b.as_flattened()) {
        *x += s * y;
    }
}
