//! The driver of the forward derivative: tangents of the Gaussians that move, and blending of every tile that
//! they reach.

use crate::blend_jvp::{BlendJvp, Moved, TileTangent};
use crate::image_part::ImagePart;
use crate::project_jvp::{AffineMotion, SplatTangent, project_jvp};
use crate::rasterize::{CHUNK, Rasterized};
use crate::splats::Splats;
use crate::tile_list::TileList;
use crate::tiles::TILE;
use crate::view::View;
use lgs_core::Camera;
use pulp::Arch;
use rayon::prelude::*;
use std::ops::Range;

/// How a part of an image changes with a motion of some Gaussians; the rest of it does not.
#[derive(Clone, Debug, Default)]
pub struct ImageTangent {
    /// The part of the image.
    pub part: ImagePart,
    /// Change of the colours, row by row of the part.
    pub image: Vec<[f32; 3]>,
    /// Change of the transmittances.
    pub transmittance: Vec<f32>,
}

impl ImageTangent {
    fn zero(part: ImagePart) -> Self {
        let pixels = part.pixels();
        Self { part, image: vec![[0.0; 3]; pixels], transmittance: vec![0.0; pixels] }
    }

    /// Writes the pixels of a tile whose corner is at `origin`.
    fn write(&mut self, tangent: &TileTangent, origin: [usize; 2], size: [usize; 2]) {
        let [red, green, blue, transmittance] = tangent;
        for y in 0..size[1] {
            let ImagePart { columns, rows } = &self.part;
            let start = (origin[1] + y - rows.start) * columns.len() + origin[0] - columns.start;
            for x in 0..size[0] {
                let at = y * TILE + x;
                self.image[start + x] = [red.0[at], green.0[at], blue.0[at]];
                self.transmittance[start + x] = transmittance.0[at];
            }
        }
    }
}

/// Changes of an image by small motions of the Gaussians `members`, one after the other: all of one length,
/// over the same part of the image, which is empty if none of them is seen.
///
/// `splats` and `camera` must be those of the forward pass. Which Gaussians a pixel sees, and their order, do
/// not change. The transpose of this map is [`crate::rasterize_vjp`].
///
/// # Panics
/// If `members` are not all among the Gaussians.
#[must_use]
pub fn rasterize_jvp(
    splats: &Splats,
    camera: &Camera,
    forward: &Rasterized,
    (members, motions): (Range<usize>, &[AffineMotion]),
) -> Vec<ImageTangent> {
    let tangents = tangents(splats, &View::from(camera), forward, (members.clone(), motions));
    let is_colored = splats.active_degree > 0;
    let moved =
        Moved { first: members.start, tangents: &tangents, motions: motions.len().max(1), is_colored };
    let tiles = tiles_of(forward, &members);
    let mut out = vec![ImageTangent::zero(span(forward, &tiles)); motions.len()];
    let arch = Arch::new();
    let of_tile = |&tile: &usize| {
        let (list, state) = (forward.tile_list(tile), &forward.tiles[tile]);
        arch.dispatch(BlendJvp { list, state, background: forward.background, moved })
    };
    let found: Vec<Vec<TileTangent>> = tiles.par_iter().with_max_len(1).map(of_tile).collect();
    for (&tile, found) in tiles.iter().zip(&found) {
        let list = forward.tile_list(tile);
        out.iter_mut().zip(found).for_each(|(out, found)| out.write(found, list.origin, list.size));
    }
    out
}

/// Tangents by Gaussian and motion; zero for what is not seen.
fn tangents(
    splats: &Splats,
    view: &View,
    forward: &Rasterized,
    (members, motions): (Range<usize>, &[AffineMotion]),
) -> Vec<SplatTangent> {
    let mut out = vec![SplatTangent::default(); members.len() * motions.len()];
    let rows = out.par_chunks_mut(motions.len().max(1)).zip(members).with_min_len(CHUNK);
    rows.filter(|(_, index)| forward.is_visible(*index)).for_each(|(row, index)| {
        let found = project_jvp(splats, view, (index, &forward.projected[index]), motions);
        row.iter_mut().zip(found).for_each(|(row, found)| *row = found);
    });
    out
}

/// The tiles in which some of the Gaussians are listed.
fn tiles_of(forward: &Rasterized, members: &Range<usize>) -> Vec<usize> {
    let is_reached = |tile: &usize| {
        let processed = &forward.tile_list(*tile).members[..forward.tiles[*tile].processed];
        processed.iter().any(|member| members.contains(&(member.gaussian as usize)))
    };
    (0..forward.tiles.len()).into_par_iter().filter(is_reached).collect()
}

/// The least rectangle around some tiles.
fn span(forward: &Rasterized, tiles: &[usize]) -> ImagePart {
    let of_tile = |&tile: &usize| {
        let TileList { origin: [x, y], size: [width, height], .. } = forward.tile_list(tile);
        ImagePart { columns: x..x + width, rows: y..y + height }
    };
    tiles.iter().map(of_tile).fold(ImagePart::default(), ImagePart::around)
}
