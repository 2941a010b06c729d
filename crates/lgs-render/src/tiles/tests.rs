use super::*;

#[test]
fn lists_come_nearest_first_and_ties_by_index() {
    let gaussian = |i: u32| Projected {
        mean: [(i.wrapping_mul(40_503) % 97) as f32, (i.wrapping_mul(2_654_435_761) % 61) as f32],
        factor: [1.0, 0.0, 1.0],
        reach: if i % 7 == 3 { 0.0 } else { 1.0 },
        half: [1.0; 2],
        depth: 0.3 + (i.wrapping_mul(2_654_435_761) % 1000) as f32 * 0.37,
        ..Projected::default()
    };
    let projected: Vec<Projected> = (0..20_000).map(gaussian).collect();
    let mut tiling = Tiling::default();
    for count in [20_000, 9000, 0] {
        let projected = &projected[..count];
        tiling.update(projected, [97, 61]);
        let mut entries = 0;
        for tile in 0..7 * 4 {
            let list = tiling.tile(tile);
            let key = |member: &Member| (projected[member.gaussian as usize].depth, member.gaussian);
            assert!(list.is_sorted_by(|a, b| key(a) < key(b)));
            assert!(list.iter().all(|member| {
                tiling.entries(member.gaussian as usize).contains(&(member.entry as usize))
            }));
            entries += list.len();
        }
        assert_eq!((entries, tiling.len()), ((0..count).map(|i| tiling.entries(i).len()).sum(), entries));
        let seen = |i: usize| !tiling.entries(i).is_empty();
        assert!((0..count).all(|i| seen(i) == (i % 7 != 3)), "every visible Gaussian is in some list");
    }
}
