//! Lists of the Gaussians that touch each tile, nearest first.
//!
//! Gaussians are sorted by depth and number the entries of all lists in that order; a stable sort by tile
//! then leaves every list sorted by depth, ties by index. Buffers have as many entries as there is room for
//! ([`super::room`]): those that an image does not need belong to no tile.

use burn::backend::TensorMetadata;
use burn::tensor::DType;
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeTensor, arguments, empty, units};

use super::extent::{Span, box_rows, tile_columns};
use super::frame::{Frame, PROJECTED, Sizes, TILE, columns};
use super::room::{Room, room};
use super::scan::{place, places};
use super::sort::sorted;

/// Entries of a list whose blending starts from a kept state.
pub(super) const GROUP: usize = 32;

/// The lists of all tiles.
#[derive(Clone, Debug)]
pub(super) struct Lists {
    /// `[entries, 2]`: Gaussian and number of each entry, list by list.
    pub(super) members: CubeTensor,
    /// `[tiles + 1, 2]`: where each list and its groups begin.
    pub(super) ranges: CubeTensor,
    /// `[n, 2]`: number of each Gaussian's first entry, and of its entries.
    pub(super) spans: CubeTensor,
    /// `[n + 1]`: where the entries of Gaussians in the order of depth begin; the last is how many there are.
    pub(super) places: CubeTensor,
    /// Number of entries that there is room for.
    pub(super) entries: usize,
    /// A bound of the number of groups, those of entries of no tile included.
    pub(super) groups: usize,
}

/// Depths, whose bits are in order since they are positive, and indices; what is invisible comes last.
#[cube(launch)]
fn by_depth(projected: &[f32], counts: &[u32], pairs: &mut [u32]) {
    let i = ABSOLUTE_POS;
    if i < counts.len() {
        let bits = u32::reinterpret(projected[i * PROJECTED + 9usize]);
        pairs[2usize * i] = select(counts[i] > 0u32, bits, 0x7fff_ffffu32);
        pairs[2usize * i + 1usize] = i as u32;
    }
}

/// The counts in the order of depth.
#[cube(launch)]
fn in_order(order: &[u32], counts: &[u32], ordered: &mut [u32]) {
    if ABSOLUTE_POS < ordered.len() {
        ordered[ABSOLUTE_POS] = counts[order[2usize * ABSOLUTE_POS + 1usize] as usize];
    }
}

/// The span of entries of each Gaussian, up to the number that there is room for, and the greatest need.
#[cube(launch)]
fn note_spans(order: &[u32], places: &[u32], spans: &mut [u32], greatest: &mut [u32], room: u32) {
    let rank = ABSOLUTE_POS;
    if rank + 1usize < places.len() {
        let i = order[2usize * rank + 1usize] as usize;
        let begin = places[rank].min(room);
        spans[2usize * i] = begin;
        spans[2usize * i + 1usize] = places[rank + 1usize].min(room) - begin;
    }
    if rank == 0usize {
        greatest[0usize] = greatest[0usize].max(places[places.len() - 1usize]);
    }
}

/// Entries of no tile, whose number is behind the last one's.
#[cube(launch)]
fn clear(pairs: &mut [u32], gaussians: &mut [u32], tiles: u32) {
    let entry = ABSOLUTE_POS;
    if entry < gaussians.len() {
        pairs[2usize * entry] = tiles;
        pairs[2usize * entry + 1usize] = entry as u32;
        gaussians[entry] = 0u32;
    }
}

/// Tile and number of every entry. A Gaussian gets as many as were counted, whatever the rounding of this
/// kernel: what is too many is left out, what is missing stays an entry of no tile.
#[cube(launch)]
fn emit(projected: &[f32], spans: &[u32], pairs: &mut [u32], gaussians: &mut [u32], frame: Frame) {
    let i = ABSOLUTE_POS;
    if i < frame.gaussians as usize {
        let mut entry = spans[2usize * i];
        let end = entry + spans[2usize * i + 1usize];
        let columns = columns(&frame);
        let rows = box_rows(projected, i, &frame);
        let mut row = rows.begin / TILE;
        while row * TILE < rows.end && entry < end {
            let span: Span = tile_columns(projected, i, row, &rows, &frame);
            let mut column = span.begin;
            while column < span.end && entry < end {
                pairs[2usize * entry as usize] = row * columns + column;
                pairs[2usize * entry as usize + 1usize] = entry;
                gaussians[entry as usize] = i as u32;
                entry += 1u32;
                column += 1u32;
            }
            row += 1u32;
        }
    }
}

/// Gaussian and number of every entry, in the order of the lists.
#[cube(launch)]
fn resolve(pairs: &[u32], gaussians: &[u32], members: &mut [u32]) {
    if ABSOLUTE_POS < gaussians.len() {
        let entry = pairs[2usize * ABSOLUTE_POS + 1usize];
        members[2usize * ABSOLUTE_POS] = gaussians[entry as usize];
        members[2usize * ABSOLUTE_POS + 1usize] = entry;
    }
}

/// The first entry whose tile is not before `tile`.
#[cube]
fn begin_of(pairs: &[u32], tile: u32) -> u32 {
    let mut low = 0u32;
    let mut high = (pairs.len() / 2usize) as u32;
    while low < high {
        let middle = (low + high) / 2u32;
        if pairs[2usize * middle as usize] < tile {
            low = middle + 1u32;
        } else {
            high = middle;
        }
    }
    low
}

/// Where the list of every tile begins, and that of entries of no tile, and the number of groups of each.
#[cube(launch)]
fn count_groups(pairs: &[u32], ranges: &mut [u32], groups: &mut [u32]) {
    let tile = ABSOLUTE_POS;
    if tile <= groups.len() {
        let begin = begin_of(pairs, tile as u32);
        ranges[2usize * tile] = begin;
        if tile < groups.len() {
            let length = begin_of(pairs, tile as u32 + 1u32) - begin;
            groups[tile] = (length + GROUP as u32 - 1u32) / (GROUP as u32);
        }
    }
}

/// Builds the lists of projected Gaussians that touch so many tiles each.
pub(super) fn lists(projected: &CubeTensor, counts: &CubeTensor, sizes: &Sizes) -> Lists {
    let [order, ordered] = by_depth_ordered(projected, counts);
    let places = places(&ordered);
    let room = room(&places, sizes);
    let spans = spans(&order, &places, &room);
    let Entries { pairs, gaussians } = emitted(projected, &spans, room.entries, sizes);
    let members = empty(counts, [room.entries, 2], DType::U32);
    let (cubes, dim) = units(&counts.client, room.entries);
    let [from, of, to] = arguments([&pairs, &gaussians, &members]);
    resolve::launch(&counts.client, cubes, dim, from, of, to);
    let ranges = ranges(&pairs, sizes.tiles());
    let groups = room.entries / GROUP + sizes.tiles() + 1;
    Lists { members, ranges, spans, places, entries: room.entries, groups }
}

/// Depth and index of the Gaussians, sorted, and the counts in that order.
fn by_depth_ordered(projected: &CubeTensor, counts: &CubeTensor) -> [CubeTensor; 2] {
    let n = counts.shape().num_elements();
    let (client, (cubes, dim)) = (&counts.client, units(&counts.client, n));
    let pairs = empty(counts, [n, 2], DType::U32);
    let [from, visible, to] = arguments([projected, counts, &pairs]);
    by_depth::launch(client, cubes.clone(), dim, from, visible, to);
    let (order, ordered) = (sorted(pairs, 31), empty(counts, [n], DType::U32));
    let [by, from, to] = arguments([&order, counts, &ordered]);
    in_order::launch(client, cubes, dim, by, from, to);
    [order, ordered]
}

/// The spans of the Gaussians' entries, numbered in the order of depth.
fn spans(order: &CubeTensor, places: &CubeTensor, room: &Room) -> CubeTensor {
    let n = order.shape()[0];
    let (client, (cubes, dim)) = (&order.client, units(&order.client, n));
    let spans = empty(order, [n, 2], DType::U32);
    let [by, from, to, greatest] = arguments([order, places, &spans, &room.greatest]);
    note_spans::launch(client, cubes, dim, by, from, to, greatest, room.entries as u32);
    spans
}

/// Entries by number: the pairs of tile and number, sorted by tile, and each number's Gaussian.
struct Entries {
    pairs: CubeTensor,
    gaussians: CubeTensor,
}

fn emitted(projected: &CubeTensor, spans: &CubeTensor, entries: usize, sizes: &Sizes) -> Entries {
    let (client, pairs) = (&spans.client, empty(spans, [entries, 2], DType::U32));
    let gaussians = empty(spans, [entries], DType::U32);
    let (cubes, dim) = units(client, entries);
    let [to, of] = arguments([&pairs, &gaussians]);
    clear::launch(client, cubes, dim, to, of, sizes.tiles() as u32);
    let (cubes, dim) = units(client, sizes.gaussians);
    let [from, places, to, of] = arguments([projected, spans, &pairs, &gaussians]);
    emit::launch(client, cubes, dim, from, places, to, of, sizes.frame());
    // Tiles, and the number after the last for entries of none.
    let bits = usize::BITS - sizes.tiles().leading_zeros();
    Entries { pairs: sorted(pairs, bits), gaussians }
}

fn ranges(pairs: &CubeTensor, tiles: usize) -> CubeTensor {
    let (out, groups) = (empty(pairs, [tiles + 1, 2], DType::U32), empty(pairs, [tiles], DType::U32));
    let (cubes, dim) = units(&pairs.client, tiles + 1);
    let [from, begins, numbers] = arguments([pairs, &out, &groups]);
    count_groups::launch(&pairs.client, cubes, dim, from, begins, numbers);
    place(&groups, &out, 1);
    out
}
