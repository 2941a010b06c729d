//! The few contact points that carry a body, of all that touch.

use super::impulses::Touch;
use crate::thresholds::MOST_CARRYING;

/// At most four of the contact points of a body on each plane, as rigid-body engines keep them: the deepest
/// one, and those that span the largest quadrilateral with it. More points share the same load in many ways,
/// which impulses come to slowly. Points stay in their order, which is plane by plane.
pub(crate) fn carrying(touches: &[Touch], height: impl Fn(&Touch) -> f64) -> Vec<Touch> {
    let planes = touches.chunk_by(|a, b| a.plane_normal == b.plane_normal);
    planes.flat_map(|of_plane| carrying_on_plane(of_plane.to_vec(), &height)).collect()
}

fn carrying_on_plane(mut touches: Vec<Touch>, height: impl Fn(&Touch) -> f64) -> Vec<Touch> {
    if touches.len() <= MOST_CARRYING {
        return touches;
    }
    let normal = touches[0].plane_normal;
    let largest = |value: &dyn Fn(&Touch) -> f64| -> usize {
        let values = touches.iter().map(value).enumerate();
        values.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(index, _)| index)
    };
    let first = largest(&|touch| -height(touch));
    let offset = |touch: &Touch| (touch.arm - touches[first].arm).reject_from(normal);
    let second = largest(&|touch| offset(touch).length_squared());
    let along = offset(&touches[second]);
    let area = |touch: &Touch| along.cross(offset(touch)).dot(normal);
    let third = largest(&|touch| area(touch).abs());
    let side = area(&touches[third]).signum();
    let fourth = largest(&|touch| -side * area(touch));
    let kept = [first, second, third, fourth];
    let mut index = 0..;
    touches.retain(|_| index.next().is_some_and(|index| kept.contains(&index)));
    touches
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_body_on_many_points_is_carried_by_a_wide_four_with_the_deepest_one() {
        let around = |k: u8| {
            let angle = f64::from(k) * 0.1;
            DVec3::new(angle.cos(), angle.sin(), if k == 7 { -0.01 } else { 0.0 })
        };
        let touch = |arm: DVec3| Touch {
            plane_normal: DVec3::Z,
            gap: arm.z,
            arm,
            least: 0.0,
            normal: 0.0,
            across: DVec3::ZERO,
        };
        let all: Vec<Touch> = (0..62).map(|k| touch(around(k))).collect();
        let kept = carrying(&all, |touch| touch.gap);
        assert_eq!(kept.len(), 4);
        assert!(kept.iter().any(|touch| touch.gap == -0.01), "the deepest one");
        let widest = kept.iter().flat_map(|a| kept.iter().map(|b| a.arm.distance(b.arm))).fold(0.0, f64::max);
        assert!(widest > 1.99, "{widest}");
        let center = kept.iter().map(|touch| touch.arm).sum::<DVec3>() / 4.0;
        assert!(center.length() < 0.1, "on all sides: {center}");
        let few = carrying(&all[..4], |touch| touch.gap);
        assert!(few.iter().zip(&all).all(|(a, b)| a.arm == b.arm), "four stay as they are");
    }
}
