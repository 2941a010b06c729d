//! Poses as rotations and translations in double precision, checked, and what is wrong with those that are
//! none.

use crate::thresholds::ROTATION_TOLERANCE;
use glam::{DMat3, DMat4, DVec3};

/// What a pose should be, and what was found instead.
pub(super) type Wrong = (&'static str, String);

/// The pose with a rotation and a translation.
///
/// # Errors
/// What was expected and what was found: a value that is not finite, a reflection, axes of another length
/// than 1, or axes that are not perpendicular.
pub(super) fn rigid(rotation: DMat3, translation: DVec3) -> Result<DMat4, Wrong> {
    if !(rotation.is_finite() && translation.is_finite()) {
        return Err(("finite", "a value that is not".to_owned()));
    }
    check_rotation(rotation)?;
    let [x, y, z] = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
    Ok(DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), translation.extend(1.0)))
}

/// Refuses a matrix that is no rotation.
fn check_rotation(rotation: DMat3) -> Result<(), Wrong> {
    const EXPECTED: &str = "a rigid pose";
    let tolerance = f64::from(ROTATION_TOLERANCE);
    let product = rotation.transpose() * rotation;
    let lengths = [product.x_axis.x, product.y_axis.y, product.z_axis.z].map(f64::sqrt);
    let determinant = rotation.determinant();
    if (product - DMat3::IDENTITY).to_cols_array().iter().all(|v| v.abs() <= tolerance) {
        return if determinant > 0.0 {
            Ok(())
        } else {
            Err((EXPECTED, "a reflection (determinant −1): one axis points the other way".to_owned()))
        };
    }
    if lengths.iter().any(|l| (l - 1.0).abs() > tolerance) {
        let [x, y, z] = lengths.map(|l| format!("{l:.4}"));
        let mirrored = if determinant < 0.0 { ", which reflect" } else { "" };
        return Err((EXPECTED, format!("a rotation part with axes of lengths {x}, {y}, {z}{mirrored}")));
    }
    let skew = product.x_axis.y.abs().max(product.x_axis.z.abs()).max(product.y_axis.z.abs());
    let angle = skew.clamp(0.0, 1.0).acos().to_degrees();
    Err((EXPECTED, format!("a rotation part with axes at {angle:.1}° instead of 90°")))
}

/// The rotation of a vector whose direction is the axis and whose length is the angle (Rodrigues).
pub(super) fn rotation_of_vector(v: DVec3) -> DMat3 {
    let angle = v.length();
    if angle > 0.0 { DMat3::from_axis_angle(v / angle, angle) } else { DMat3::IDENTITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(rotation: DMat3) -> String {
        rigid(rotation, DVec3::ZERO).unwrap_err().1
    }

    #[test]
    fn what_is_wrong_with_a_rotation_is_said() {
        let turn = rotation_of_vector(DVec3::new(0.3, -1.2, 0.4));
        assert!(rigid(turn, DVec3::ONE).is_ok());
        let mirror = DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
        assert!(refusal(turn * mirror).contains("reflection"));
        assert!(refusal(turn * 1.1).contains("1.1000"));
        let slanted = DMat3::from_cols(DVec3::X, DVec3::new(0.5, 0.75_f64.sqrt(), 0.0), DVec3::Z);
        assert!(refusal(slanted).contains("60.0°"), "{}", refusal(slanted));
        assert!(refusal(turn * f64::NAN).contains("not"));
        assert!(rigid(turn, DVec3::splat(f64::INFINITY)).is_err());
    }
}
