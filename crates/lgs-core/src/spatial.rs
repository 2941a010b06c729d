//! An order of points in which neighbours in space lie close to each other in memory.

/// Bits of a coordinate in a Morton code.
const BITS: u32 = 21;

/// Points in the order of their Morton codes on a grid of 2²¹ cells along the longest side of their bounding
/// box: index of the first, of the second, …
///
/// Points of one cell keep their order. Points that are not finite have a place as well.
#[must_use]
pub fn spatial_order(points: &[[f32; 3]]) -> Vec<u32> {
    let finite = || points.iter().filter(|p| p.iter().all(|x| x.is_finite()));
    let lowest: [f32; 3] =
        std::array::from_fn(|axis| finite().map(|p| p[axis]).fold(f32::INFINITY, f32::min));
    let side =
        finite().flat_map(|p| (0..3).map(|axis| p[axis] - lowest[axis])).fold(f32::MIN_POSITIVE, f32::max);
    let per_side = ((1 << BITS) - 1) as f32 / side;
    let code = |p: &[f32; 3]| {
        let [x, y, z] = std::array::from_fn(|axis| spread(((p[axis] - lowest[axis]) * per_side) as u64));
        x << 2 | y << 1 | z
    };
    let codes: Vec<u64> = points.iter().map(code).collect();
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_by_key(|&i| codes[i as usize]);
    order
}

/// The lowest 21 bits with two zeros between any two of them.
fn spread(cell: u64) -> u64 {
    let steps = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    steps.iter().fold(cell & 0x001f_ffff, |bits, &(by, mask)| (bits | bits << by) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_a_cell_are_three_places_apart() {
        for bit in 0..BITS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread(0x001f_ffff), (0..BITS).map(|bit| 1_u64 << (3 * bit)).sum::<u64>());
    }

    #[test]
    fn octants_come_one_after_the_other_with_z_fastest() {
        let corner = |i: u32| [i >> 2 & 1, i >> 1 & 1, i & 1].map(|bit| bit as f32 - 0.5);
        let points: Vec<[f32; 3]> = [6, 1, 7, 0, 3, 5, 2, 4].map(corner).to_vec();
        assert_eq!(spatial_order(&points), [3, 1, 6, 4, 7, 5, 0, 2]);
    }

    #[test]
    fn neighbours_in_space_come_close_and_every_point_once() {
        let side = 16;
        let mut points: Vec<[f32; 3]> = (0..side * side * side)
            .map(|i| [i % side, i / side % side, i / side / side].map(|x| x as f32))
            .collect();
        points.reverse();
        let order = spatial_order(&points);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..points.len() as u32));
        let step = |pair: &[u32]| {
            let [a, b] = [points[pair[0] as usize], points[pair[1] as usize]];
            crate::linear::norm(crate::linear::sub(a, b))
        };
        let mean = order.windows(2).map(step).sum::<f32>() / order.len() as f32;
        assert!(mean < 2.0, "{mean}");
    }

    #[test]
    fn few_equal_and_boundless_points_have_an_order() {
        assert!(spatial_order(&[]).is_empty());
        assert_eq!(spatial_order(&[[2.0; 3]; 3]), [0, 1, 2]);
        assert_eq!(spatial_order(&[[1.0; 3], [f32::NAN; 3], [0.0; 3]]), [1, 2, 0]);
        assert_eq!(spatial_order(&[[f32::MAX; 3], [-f32::MAX; 3]]).len(), 2);
    }
}
