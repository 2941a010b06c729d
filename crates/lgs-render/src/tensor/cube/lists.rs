//! Lists of the Gaussians that touch each tile, nearest first.
//!
//! Gaussians are sorted by depth and number the entries of all lists in that order; a stable sort by tile
//! then leaves every list sorted by depth, ties by index. The number of entries is read back once: buffers
//! have the size that an image needs.

use burn::tensor::DType;
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeTensor, empty, last_value, units};

use super::extent::{Span, box_rows, tile_columns};
use super::frame::{Frame, PROJECTED, Sizes, TILE, columns};
use super::scan::places;
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
    /// Number of entries.
    pub(super) entries: usize,
    /// A bound of the number of groups.
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

/// The span of entries of each Gaussian.
#[cube(launch)]
fn note_spans(order: &[u32], places: &[u32], spans: &mut [u32]) {
    let rank = ABSOLUTE_POS;
    if rank + 1usize < places.len() {
        let i = order[2usize * rank + 1usize] as usize;
        spans[2usize * i] = places[rank];
        spans[2usize * i + 1usize] = places[rank + 1usize] - places[rank];
    }
}

/// Tile and number of every entry. A Gaussian gets as many as were counted, whatever the rounding of this
/// kernel: what is too many is left out, what is missing belongs to no tile.
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
        while entry < end {
            pairs[2usize * entry as usize] = columns * ((frame.height + TILE - 1u32) / TILE);
            pairs[2usize * entry as usize + 1usize] = entry;
            gaussians[entry as usize] = i as u32;
            entry += 1u32;
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

/// Number of groups of each tile.
#[cube(launch)]
fn count_groups(pairs: &[u32], groups: &mut [u32]) {
    let tile = ABSOLUTE_POS;
    if tile < groups.len() {
        let length = begin_of(pairs, tile as u32 + 1u32) - begin_of(pairs, tile as u32);
        groups[tile] = (length + GROUP as u32 - 1u32) / (GROUP as u32);
    }
}

/// Where every list and its groups begin.
#[cube(launch)]
fn note_ranges(pairs: &[u32], groups: &[u32], ranges: &mut [u32]) {
    let tile = ABSOLUTE_POS;
    if tile < groups.len() {
        ranges[2usize * tile] = begin_of(pairs, tile as u32);
        ranges[2usize * tile + 1usize] = groups[tile];
    }
}

/// Entries by number: the pairs of tile and number, sorted by tile, and each number's Gaussian.
struct Entries {
    pairs: CubeTensor,
    gaussians: CubeTensor,
}

/// Builds the lists of projected Gaussians that touch so many tiles each; none where nothing is visible.
pub(super) fn lists(projected: &CubeTensor, counts: &CubeTensor, sizes: &Sizes) -> Option<Lists> {
    let spans = empty(counts, [sizes.gaussians, 2], DType::U32);
    let total = number(projected, counts, &spans);
    let entries = last_value(total) as usize;
    if entries == 0 {
        return None;
    }
    let Entries { pairs, gaussians } = emitted(projected, &spans, entries, sizes);
    let members = empty(counts, [entries, 2], DType::U32);
    let (cubes, dim) = units(&counts.client, entries);
    resolve::launch(
        &counts.client,
        cubes,
        dim,
        pairs.clone().into_buffer_arg(),
        gaussians.into_buffer_arg(),
        members.clone().into_buffer_arg(),
    );
    let ranges = ranges(&pairs, sizes.tiles());
    Some(Lists { members, ranges, spans, entries, groups: entries / GROUP + sizes.tiles() })
}

/// Fills the spans of the Gaussians' entries, numbered in the order of depth; gives the places that end with
/// the number of entries.
fn number(projected: &CubeTensor, counts: &CubeTensor, spans: &CubeTensor) -> CubeTensor {
    let n = burn::backend::TensorMetadata::shape(counts).num_elements();
    let (client, (cubes, dim)) = (&counts.client, units(&counts.client, n));
    let pairs = empty(counts, [n, 2], DType::U32);
    by_depth::launch(
        client,
        cubes.clone(),
        dim,
        projected.clone().into_buffer_arg(),
        counts.clone().into_buffer_arg(),
        pairs.clone().into_buffer_arg(),
    );
    let order = sorted(pairs, 31);
    let ordered = empty(counts, [n], DType::U32);
    in_order::launch(
        client,
        cubes.clone(),
        dim,
        order.clone().into_buffer_arg(),
        counts.clone().into_buffer_arg(),
        ordered.clone().into_buffer_arg(),
    );
    let places = places(&ordered);
    note_spans::launch(
        client,
        cubes,
        dim,
        order.into_buffer_arg(),
        places.clone().into_buffer_arg(),
        spans.clone().into_buffer_arg(),
    );
    places
}

fn emitted(projected: &CubeTensor, spans: &CubeTensor, entries: usize, sizes: &Sizes) -> Entries {
    let pairs = empty(spans, [entries, 2], DType::U32);
    let gaussians = empty(spans, [entries], DType::U32);
    let (cubes, dim) = units(&spans.client, sizes.gaussians);
    emit::launch(
        &spans.client,
        cubes,
        dim,
        projected.clone().into_buffer_arg(),
        spans.clone().into_buffer_arg(),
        pairs.clone().into_buffer_arg(),
        gaussians.clone().into_buffer_arg(),
        sizes.frame(),
    );
    // Tiles, and the number after the last for entries of none.
    let bits = usize::BITS - sizes.tiles().leading_zeros();
    Entries { pairs: sorted(pairs, bits), gaussians }
}

fn ranges(pairs: &CubeTensor, tiles: usize) -> CubeTensor {
    let groups = empty(pairs, [tiles], DType::U32);
    let (cubes, dim) = units(&pairs.client, tiles + 1);
    count_groups::launch(
        &pairs.client,
        cubes.clone(),
        dim,
        pairs.clone().into_buffer_arg(),
        groups.clone().into_buffer_arg(),
    );
    let out = empty(pairs, [tiles + 1, 2], DType::U32);
    note_ranges::launch(
        &pairs.client,
        cubes,
        dim,
        pairs.clone().into_buffer_arg(),
        places(&groups).into_buffer_arg(),
        out.clone().into_buffer_arg(),
    );
    out
}
