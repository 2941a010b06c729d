//! The proper orthogonal decomposition of the affine motion of a deforming body.

use super::kinematics::Configured;
use super::normal_modes::freed;
use super::observed::Laws;
use super::placed::Placed;
use super::posterior::{Compared, Posterior};
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::FLAT_SHAPE;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{outer, principal_axes};
use lgs_mechanics::choose::{Judged, choose};
use lgs_mechanics::coordinates::{AffineMode, Coordinates, Modal};
use lgs_mechanics::fit::Track;
use nalgebra::DMatrix;

/// Numbers of an affine displacement.
pub(super) const ENTRIES: usize = 12;

/// Share of one mode in another by which a fit begins to mix them.
pub(super) const FIRST_MIXING: f64 = 0.01;

/// A law in its coordinates, and what is known of it together with its normal modes.
pub(super) type OfModes = (Configured, Judged, Option<Posterior>);

/// The affine motion about its mean in orthonormal modes, the strongest first.
pub(super) struct Decomposition {
    rest: Pose,
    modes: Vec<Pose>,
    /// Root of the second moments of the particles.
    root: DMat3,
    /// `[T][12]` amplitudes.
    pub(super) amplitudes: Vec<Vec<f64>>,
}

impl Decomposition {
    pub(super) fn of(motion: &SharedMotion) -> Option<Self> {
        let n = motion.poses.len();
        let rest = mean(&motion.poses);
        let root = root_of(&motion.covariance())?;
        let whitened = |pose: &Pose| {
            let change = Pose { linear: (pose.linear - rest.linear) * root, shift: pose.shift - rest.shift };
            change.entries()
        };
        let rows: Vec<f64> = motion.poses.iter().flat_map(whitened).collect();
        let svd = DMatrix::from_row_slice(n, ENTRIES, &rows).svd(false, true);
        let axes = svd.v_t?;
        let mut order: Vec<usize> = (0..axes.nrows()).collect();
        order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
        let back = root.inverse();
        let mode = |&row: &usize| {
            let entries: Vec<f64> = axes.row(row).iter().copied().collect();
            let whitened = Pose::from_entries(&entries);
            Pose { linear: whitened.linear * back, ..whitened }
        };
        let amplitude = |row: &[f64]| order.iter().map(|&axis| dot(row, axes.row(axis).iter())).collect();
        let amplitudes = rows.chunks_exact(ENTRIES).map(amplitude).collect();
        Some(Self { rest, modes: order.iter().map(mode).collect(), root, amplitudes })
    }

    /// Number of modes, of which there are no more than times.
    pub(super) fn count(&self) -> usize {
        self.modes.len()
    }

    /// The first modes as functions of the position at rest.
    pub(super) fn coordinates(&self, modes: usize) -> Coordinates {
        let back = self.rest.linear.inverse();
        let affine = |mode: &Pose| {
            let linear = mode.linear * back;
            let shift = mode.shift - linear * self.rest.shift;
            let row = |i: usize| linear.row(i).to_array();
            AffineMode { linear: [row(0), row(1), row(2)], shift: shift.to_array() }
        };
        let affine = self.modes.iter().take(modes).map(affine).collect();
        Coordinates::Modal(Modal { affine, further: 0 })
    }

    /// The laws of the first amplitudes whose score is at most so far behind the best, in normal modes where
    /// they have any; `whole` has the noise of all amplitudes.
    pub(super) fn laws(&self, modes: usize, whole: &Track, laws: Laws, behind: f64) -> Vec<OfModes> {
        let system = || self.configured(modes, whole);
        let Configured { coordinates, x, .. } = system();
        let noise = whole.noise[..modes].to_vec();
        let track = Track { noise, ..Track::new(&coordinates, whole.samples(), &x) };
        let choice = choose(&laws.candidates(&coordinates), &track, &track.scales(&coordinates));
        let Some(choice) = choice else { return Vec::new() };
        let most = choice.law().score() + behind;
        let near = choice.judged.into_iter().filter(|judged| judged.score() <= most);
        let own = |judged: Judged| match self.freed(&judged, &system(), &track) {
            Some((system, judged, posterior)) => (system, judged, Some(posterior)),
            None => (system(), judged, None),
        };
        near.map(own).collect()
    }

    /// A law of orthogonal modes with its normal modes instead, which need not be orthogonal.
    fn freed(
        &self,
        judged: &Judged,
        system: &Configured,
        track: &Track,
    ) -> Option<(Configured, Judged, Posterior)> {
        let modes = track.noise.len();
        let weights = track.weights();
        let whitened = |poses: &[Vec<Pose>]| -> Vec<f64> {
            let of_sample = |(sample, of_time): (usize, &Vec<Pose>)| {
                let predicted = self.amplitudes_of(&of_time[0], modes);
                let pairs = predicted.into_iter().zip(&track.x[sample]).zip(&weights[sample]);
                pairs.map(|((x, observed), weight)| (x - observed) * weight).collect::<Vec<f64>>()
            };
            poses.iter().enumerate().flat_map(of_sample).collect()
        };
        let noise = [FIRST_MIXING, 0.0];
        let compared = Compared { times: &track.times, whitened: &whitened, noise, radius: 1.0 };
        let bases = system.poses_in(&judged.fitted.start.x);
        let (judged, posterior) =
            freed(judged, track, &compared, &|fitted| Placed::at(fitted, bases.clone()))?;
        let system = Configured {
            coordinates: judged.fitted.law.coordinates.clone(),
            x: vec![posterior.placed.reference().to_vec()],
            bases: posterior.placed.bases.clone(),
            order: vec![0],
            constants: system.constants + judged.fitted.law.coordinates.geometry(),
            chi_square: system.chi_square,
        };
        Some((system, judged, posterior))
    }

    /// The first amplitudes of a pose.
    pub(super) fn amplitudes_of(&self, pose: &Pose, modes: usize) -> Vec<f64> {
        let change = Pose {
            linear: (pose.linear - self.rest.linear) * self.root,
            shift: pose.shift - self.rest.shift,
        };
        let entries = change.entries();
        let whitened = |mode: &Pose| Pose { linear: mode.linear * self.root, ..*mode }.entries();
        self.modes.iter().take(modes).map(|mode| dot(&entries, whitened(mode).iter())).collect()
    }

    /// The first modes with their amplitudes; `whole` has the noise of all.
    fn configured(&self, modes: usize, whole: &Track) -> Configured {
        let x: Vec<Vec<f64>> = self.amplitudes.iter().map(|row| row[..modes].to_vec()).collect();
        let weights = whole.weights();
        let rows = self.amplitudes.iter().zip(&weights);
        let left_out = rows.flat_map(|(row, weights)| row.iter().zip(weights).skip(modes));
        let left_out = left_out.map(|(x, weight)| (x * weight).powi(2));
        let sum = |pose: Pose, (mode, &x): (&Pose, &f64)| Pose {
            linear: pose.linear + mode.linear * x,
            shift: pose.shift + mode.shift * x,
        };
        Configured {
            coordinates: self.coordinates(modes),
            order: vec![0],
            bases: vec![self.modes.iter().zip(&x[0]).fold(self.rest, sum)],
            x,
            // The pose at rest, and the directions of the modes.
            constants: ENTRIES + modes * (ENTRIES - modes),
            chi_square: left_out.sum(),
        }
    }
}

/// The mean of affine poses.
pub(super) fn mean(poses: &[Pose]) -> Pose {
    let scale = (poses.len() as f64).recip();
    Pose {
        linear: poses.iter().map(|pose| pose.linear).sum::<DMat3>() * scale,
        shift: poses.iter().map(|pose| pose.shift).sum::<DVec3>() * scale,
    }
}

/// The symmetric root of second moments, with thin directions thickened so that it can be inverted.
fn root_of(covariance: &DMat3) -> Option<DMat3> {
    let axes = principal_axes(covariance);
    let least = FLAT_SHAPE * FLAT_SHAPE * axes[0].0;
    let root: DMat3 = axes.iter().map(|&(value, axis)| value.max(least).sqrt() * outer(axis, axis)).sum();
    (root.is_finite() && root.determinant() > 0.0).then_some(root)
}

fn dot<'a>(a: &[f64], b: impl Iterator<Item = &'a f64>) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
