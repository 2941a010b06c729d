//! One call of FreeGave's networks: what all blocks of Gaussians share, one block forwards, and one block
//! back.

use lgs_core::linear::quat_mul;
use rayon::prelude::*;

use super::config::{ChainLayout, FreeGaveLayout};
use super::network::{AdvectionInput, Learns};
use super::twist::{TWIST, Twist, integrate, integrate_vjp, rotation, steps, twist_times};
use crate::source::blocks::{Activations, Block, Pass, encoded};
use crate::source::chain::{Activation, Chain, Input, Kept as Layers};
use crate::source::encoding::encode_into;
use crate::source::network::{BLOCK, DeformInput};
use crate::source::pose::DELTAS;

/// Motion bases at all times of the integration.
#[derive(Clone, Debug, Default)]
pub(super) struct Bases {
    /// `[times, k]`; none if the velocity field is not asked.
    pub(super) twists: Vec<Twist>,
    /// Encoded times, `[features, times]`.
    encoding: Vec<f32>,
    layers: Layers,
}

#[derive(Clone, Debug)]
pub(super) struct BlockKept {
    deformation: Activations,
    /// Codes, `[k, block]`.
    codes: Vec<f32>,
    code_layers: Layers,
    /// Present if the velocity field was asked.
    flow: Option<FlowKept>,
}

#[derive(Clone, Debug)]
struct FlowKept {
    /// Mixing weights, `[k, block]`.
    weights: Vec<f32>,
    layers: Layers,
    /// Centres where the integration starts.
    starts: Vec<[f32; 3]>,
    /// Rotations along it.
    turns: Vec<[f32; 4]>,
}

/// A call's constants.
pub(super) struct Call<'a> {
    input: AdvectionInput<'a>,
    layout: FreeGaveLayout,
    pass: Pass<'a>,
    steps: Vec<f32>,
}

/// Gradients of a few blocks.
pub(super) struct Partial {
    pub(super) params: Vec<f32>,
    /// By the motion bases, `[times, k]`.
    pub(super) bases: Vec<Twist>,
}

impl Partial {
    pub(super) fn zero(params: usize, bases: usize) -> Self {
        Self { params: vec![0.0; params], bases: vec![[0.0; TWIST]; bases] }
    }
}

impl<'a> Call<'a> {
    pub(super) fn new(input: AdvectionInput<'a>) -> Self {
        let AdvectionInput { config, frame, params, means, rotations, advection } = input;
        let layout = config.layout();
        assert_eq!(params.len(), layout.len, "parameters of FreeGave's networks");
        assert_eq!(means.len(), rotations.len(), "centres and quaternions");
        let pass = Pass::new(&DeformInput {
            config: &config.deformation,
            frame,
            params,
            means,
            rotations,
            time: advection.from,
        });
        Self { input, layout, pass, steps: steps(advection.from, advection.to, advection.longest_step) }
    }

    fn chain<'b>(&'b self, layout: &'b ChainLayout, activation: Activation) -> Chain<'b> {
        let skip_layer = if std::ptr::eq(layout, &self.layout.code) {
            self.input.config.velocity.code_skip_layer
        } else {
            usize::MAX - 1
        };
        Chain {
            params: self.input.params,
            hidden: &layout.hidden,
            head: &layout.head,
            skip_layer,
            activation,
        }
    }

    fn k(&self) -> usize {
        self.input.config.bases()
    }

    fn position<'b>(&self, encoded: &'b [f32]) -> Input<'b> {
        Input { values: encoded, first: 0, count: self.input.config.deformation.position_width() }
    }

    fn code<'b>(&self, codes: &'b [f32]) -> Input<'b> {
        Input { values: codes, first: 0, count: self.k() }
    }

    fn time<'b>(&self, encoding: &'b [f32]) -> Input<'b> {
        Input { values: encoding, first: 0, count: self.layout.velocity.hidden[0].inputs }
    }

    /// The motion bases at the times of the integration.
    pub(super) fn bases(&self) -> Bases {
        let times = twist_times(self.input.advection.from, &self.steps);
        if times.is_empty() {
            return Bases::default();
        }
        let (k, count) = (self.k(), times.len());
        let mut encoding = vec![0.0; self.layout.velocity.hidden[0].inputs * count];
        for (j, t) in times.iter().enumerate() {
            encode_into(&[*t], self.input.config.velocity.time_frequencies, &mut encoding[j..], count);
        }
        let (out, layers) =
            self.chain(&self.layout.velocity, Activation::Silu).forward(&[self.time(&encoding)], None, count);
        let twist = |j: usize, i: usize| std::array::from_fn(|c| out[(TWIST * i + c) * count + j]);
        let twists = (0..count).flat_map(|j| (0..k).map(move |i| (j, i))).map(|(j, i)| twist(j, i)).collect();
        Bases { twists, encoding, layers }
    }

    /// Pose rows, and what `keep` makes of what every block leaves.
    pub(super) fn forward<T: Send>(
        &self,
        bases: &Bases,
        keep: impl Fn(BlockKept) -> T + Sync,
    ) -> (Vec<[f32; DELTAS]>, Vec<T>) {
        let AdvectionInput { means, rotations, .. } = self.input;
        let mut poses = vec![[0.0; DELTAS]; means.len()];
        let blocks =
            poses.par_chunks_mut(BLOCK).zip(means.par_chunks(BLOCK)).zip(rotations.par_chunks(BLOCK));
        let kept = blocks
            .map(|((poses, means), rotations)| keep(self.forward_block(means, rotations, bases, poses)))
            .collect();
        (poses, kept)
    }

    fn forward_block(
        &self,
        means: &[[f32; 3]],
        rotations: &[[f32; 4]],
        bases: &Bases,
        poses: &mut [[f32; DELTAS]],
    ) -> BlockKept {
        let block = means.len();
        let encoded = encoded(means, self.input.frame, &self.input.config.deformation);
        let (codes, code_layers) =
            self.chain(&self.layout.code, Activation::Relu).forward(&[self.position(&encoded)], None, block);
        let deformation = self.pass.forward(Block { means, rotations, codes: &codes }, encoded, poses);
        let flow = (!self.steps.is_empty()).then(|| self.forward_flow(&codes, bases, poses));
        BlockKept { deformation, codes, code_layers, flow }
    }

    fn forward_flow(&self, codes: &[f32], bases: &Bases, poses: &mut [[f32; DELTAS]]) -> FlowKept {
        let block = poses.len();
        let (weights, layers) =
            self.chain(&self.layout.segment, Activation::Relu).forward(&[self.code(codes)], None, block);
        let starts: Vec<[f32; 3]> = poses.iter().map(|&[x, y, z, ..]| [x, y, z]).collect();
        let mut turns = Vec::new();
        for (b, pose) in poses.iter_mut().enumerate() {
            let twists = self.mixed(&weights, bases, (b, block));
            pose[..3].copy_from_slice(&integrate(&self.steps, &twists, starts[b]));
            if self.input.advection.turns {
                let turn = rotation(self.input.config.velocity.rotation, &self.steps, &twists);
                let turned = quat_mul(turn, [pose[3], pose[4], pose[5], pose[6]]);
                pose[3..7].copy_from_slice(&turned);
                turns.push(turn);
            }
        }
        FlowKept { weights, layers, starts, turns }
    }

    /// A Gaussian's twists at the times of the integration.
    fn mixed(&self, weights: &[f32], bases: &Bases, (b, block): (usize, usize)) -> Vec<Twist> {
        let mix = |bases: &[Twist]| {
            let mut sum = [0.0; TWIST];
            for (i, basis) in bases.iter().enumerate() {
                let w = weights[i * block + b];
                sum.iter_mut().zip(basis).for_each(|(s, a)| *s += w * a);
            }
            sum
        };
        bases.twists.chunks_exact(self.k()).map(mix).collect()
    }

    /// Adds a block's gradients to `partial`, and turns its rows of cotangents into those by centres and
    /// quaternions.
    pub(super) fn backward(
        &self,
        (kept, bases): (&BlockKept, &Bases),
        gaussians: std::ops::Range<usize>,
        rows: &mut [[f32; DELTAS]],
        partial: &mut Partial,
    ) {
        let v_from_flow =
            kept.flow.as_ref().map(|flow| self.backward_flow(flow, (&kept.codes, bases), rows, partial));
        let mut v_codes = vec![0.0; kept.codes.len()];
        if self.input.advection.learns == Learns::All {
            let (means, rotations) = (&self.input.means[gaussians.clone()], &self.input.rotations[gaussians]);
            let block = Block { means, rotations, codes: &kept.codes };
            v_codes = self.pass.backward(&kept.deformation, block, rows, &mut partial.params);
        } else {
            rows.fill([0.0; DELTAS]);
        }
        if let Some(v) = v_from_flow {
            v_codes.iter_mut().zip(v).for_each(|(sum, v)| *sum += v);
        }
        let inputs = [self.position(&kept.deformation.encoded)];
        self.chain(&self.layout.code, Activation::Relu).backward(
            &kept.code_layers,
            &inputs,
            &v_codes,
            &mut partial.params,
            &mut [],
        );
    }

    /// Adds the gradients of segment head and bases, takes the turns out of the rows' quaternions, and
    /// returns the codes' cotangents.
    fn backward_flow(
        &self,
        flow: &FlowKept,
        (codes, bases): (&[f32], &Bases),
        rows: &mut [[f32; DELTAS]],
        partial: &mut Partial,
    ) -> Vec<f32> {
        let (block, k) = (rows.len(), self.k());
        let mut v_weights = vec![0.0; k * block];
        for (b, row) in rows.iter_mut().enumerate() {
            let twists = self.mixed(&flow.weights, bases, (b, block));
            let (v_twists, _) = integrate_vjp(&self.steps, &twists, flow.starts[b], [row[0], row[1], row[2]]);
            for (j, v_twist) in v_twists.iter().enumerate() {
                for i in 0..k {
                    let (w, at) = (flow.weights[i * block + b], j * k + i);
                    v_weights[i * block + b] +=
                        v_twist.iter().zip(&bases.twists[at]).map(|(v, a)| v * a).sum::<f32>();
                    partial.bases[at].iter_mut().zip(v_twist).for_each(|(sum, v)| *sum += w * v);
                }
            }
            if let Some(&[w, x, y, z]) = flow.turns.get(b) {
                let before = quat_mul([w, -x, -y, -z], [row[3], row[4], row[5], row[6]]);
                row[3..7].copy_from_slice(&before);
            }
        }
        let mut v_codes = [vec![0.0; k * block]];
        let chain = self.chain(&self.layout.segment, Activation::Relu);
        chain.backward(&flow.layers, &[self.code(codes)], &v_weights, &mut partial.params, &mut v_codes);
        let [v_codes] = v_codes;
        v_codes
    }

    /// Gradients of what does not depend on the Gaussian, once all blocks have been added.
    pub(super) fn finish(&self, bases: &Bases, sum: &mut Partial) {
        self.pass.finish(&mut sum.params);
        if bases.twists.is_empty() {
            return;
        }
        let (k, count) = (self.k(), bases.twists.len() / self.k());
        let mut v_out = vec![0.0; TWIST * k * count];
        for (at, v_twist) in sum.bases.iter().enumerate() {
            let (j, i) = (at / k, at % k);
            v_twist.iter().enumerate().for_each(|(c, v)| v_out[(TWIST * i + c) * count + j] = *v);
        }
        let chain = self.chain(&self.layout.velocity, Activation::Silu);
        chain.backward(&bases.layers, &[self.time(&bases.encoding)], &v_out, &mut sum.params, &mut []);
    }
}
