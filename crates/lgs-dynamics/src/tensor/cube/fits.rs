//! The fits of supports (Eq. 6): their sums over members, and the rotation of each.
//!
//! Sums are taken about the means, of differences to the support's owner, and the matrix is brought to a
//! largest entry of one, so that single precision holds its determinants whatever the size of a support.

use cubecl::prelude::*;
use lgs_tensor::cube::vectors::{write, zeros};

use super::field::MOTION;
use super::rotation::{fitted, identity};
use super::vectors::taken;
use crate::thresholds::LEAST_SCALE;

/// Numbers of a fit: A over its scale (0), owner minus mean (9), mean of the candidates minus the owner's
/// (12), quaternion (15), scale (19).
pub(super) const FIT: usize = 20;

/// The fits of all supports.
#[cube(launch)]
pub(super) fn fit(motion: &[f32], members: &[u32], fits: &mut [f32], k: u32) {
    let owner = ABSOLUTE_POS;
    if owner < fits.len() / FIT {
        write(fits, owner * FIT, &fit_of(motion, members, owner, k), FIT);
    }
}

/// The fit of a support.
#[cube]
pub(super) fn fit_of(motion: &[f32], members: &[u32], owner: usize, k: u32) -> Array<f32> {
    let (from_mean, to_candidate_mean) = means(motion, members, owner, k);
    let mut a = zeros(9usize);
    for slot in 0..k {
        let (x, y) = differences(motion, members, owner, slot, k);
        #[unroll]
        for i in 0..3usize {
            #[unroll]
            for j in 0..3usize {
                a[3 * i + j] = a[3 * i + j] + (y[i] - to_candidate_mean[i]) * (x[j] + from_mean[j]);
            }
        }
    }
    let mut scale = 0.0f32;
    #[unroll]
    for i in 0..9usize {
        scale = scale.max(a[i].abs());
    }
    let has_scale = scale > LEAST_SCALE && scale < 1.0f32 / LEAST_SCALE;
    let per_scale = select(has_scale, 1.0f32 / scale, 0.0f32);
    let mut out = Array::<f32>::new(FIT);
    #[unroll]
    for i in 0..9usize {
        a[i] = select(has_scale, a[i] * per_scale, 0.0f32);
        out[i] = a[i];
    }
    let mut rotation = identity();
    if has_scale {
        rotation = fitted(&a);
    }
    #[unroll]
    for i in 0..3usize {
        out[9 + i] = from_mean[i];
        out[12 + i] = to_candidate_mean[i];
        out[16 + i] = rotation[i + 1];
    }
    out[15usize] = rotation[0usize];
    out[19usize] = select(has_scale, scale, 1.0f32);
    out
}

/// A number of a motion less the owner's.
#[cube]
fn difference(motion: &[f32], member: usize, owner: usize, #[comptime] at: usize) -> Array<f32> {
    let mut out = Array::<f32>::new(3usize);
    #[unroll]
    for k in 0..3usize {
        out[k] = motion[member * MOTION + at + k] - motion[owner * MOTION + at + k];
    }
    out
}

/// Position and candidate of a support's member in a slot, less the owner's.
#[cube]
fn differences(motion: &[f32], members: &[u32], owner: usize, slot: u32, k: u32) -> (Array<f32>, Array<f32>) {
    let member = members[owner * k as usize + slot as usize] as usize;
    (difference(motion, member, owner, 0usize), difference(motion, member, owner, 3usize))
}

/// The owner's position less the mean of the members', and the mean of their candidates less the owner's.
#[cube]
fn means(motion: &[f32], members: &[u32], owner: usize, k: u32) -> (Array<f32>, Array<f32>) {
    let mut from_mean = zeros(3usize);
    let mut to_candidate_mean = zeros(3usize);
    let per = 1.0f32 / k as f32;
    for slot in 0..k {
        let (x, y) = differences(motion, members, owner, slot, k);
        #[unroll]
        for i in 0..3usize {
            from_mean[i] = from_mean[i] - x[i];
            to_candidate_mean[i] = to_candidate_mean[i] + y[i];
        }
    }
    #[unroll]
    for i in 0..3usize {
        from_mean[i] = from_mean[i] * per;
        to_candidate_mean[i] = to_candidate_mean[i] * per;
    }
    (from_mean, to_candidate_mean)
}

/// A fit's quaternion.
#[cube]
pub(super) fn quaternion(fit: &Array<f32>) -> Array<f32> {
    taken(fit, 15usize, 4usize)
}
