//! One call of FreeGave's networks: the motion bases, which all Gaussians share, and blocks of Gaussians
//! forwards and backwards.

use lgs_core::linear::quat_mul;
use lgs_nn::encoding::encode_into;
use lgs_nn::{Activation, Mlp, MlpGradients, MlpLayout, MlpShape, OutputCotangents, Scratch, Tape};
use rayon::prelude::*;

use super::config::FreeGaveConfig;
use super::input::Learns;
use super::twist::{TWIST, Twist, integrate, integrate_vjp, rotation, steps, twist_times};
use crate::source::blocks::{Activations, Block, Pass, encoded};
use crate::source::config::DELTAS;
use crate::source::network::BLOCK;
use crate::source::pose_network::NetworkInput;

/// Motion bases at all times of the integration.
#[derive(Debug, Default)]
pub(super) struct Bases {
    /// `[times, k]`; none if the velocity field is not asked.
    pub(super) twists: Vec<Twist>,
    /// Encoded times, `[features, times]`.
    encoding: Vec<f32>,
    tape: Option<Tape>,
}

/// The values of a block that its backward pass needs.
#[derive(Debug)]
pub(super) struct BlockKept {
    deformation: Activations,
    /// Codes, `[k, block]`.
    codes: Vec<f32>,
    code_tape: Tape,
    /// Present if the velocity field was asked.
    flow: Option<FlowKept>,
}

#[derive(Debug)]
struct FlowKept {
    /// Mixing weights, `[k, block]`.
    weights: Vec<f32>,
    tape: Tape,
    /// Centres where the integration starts.
    starts: Vec<[f32; 3]>,
    /// Rotations along it.
    turns: Vec<[f32; 4]>,
}

/// A call's constants.
pub(super) struct Call<'a> {
    input: NetworkInput<'a, FreeGaveConfig>,
    pass: Pass<'a>,
    code: Mlp,
    segment: Mlp,
    velocity: Mlp,
    steps: Vec<f32>,
}

/// Gradients of a few blocks.
pub(super) struct Partial {
    deformation: MlpGradients,
    code: MlpGradients,
    segment: MlpGradients,
    /// Gradients by the motion bases, `[times, k]`.
    bases: Vec<Twist>,
}

impl<'a> Call<'a> {
    pub(super) fn new(input: NetworkInput<'a, FreeGaveConfig>) -> Self {
        let NetworkInput { config, frame, params, means, rotations, time: advection } = input;
        let layout = config.layout();
        assert_eq!(params.len(), layout.len, "parameters of FreeGave's networks");
        assert_eq!(means.len(), rotations.len(), "centres and quaternions");
        let pass = Pass::new(&NetworkInput {
            config: &config.deformation,
            frame,
            params,
            means,
            rotations,
            time: advection.from,
        });
        let mlp = |layout: MlpLayout, activation| Mlp::new(MlpShape::new(layout, activation), params);
        Self {
            input,
            pass,
            code: mlp(layout.code, Activation::Relu),
            segment: mlp(layout.segment, Activation::Relu),
            velocity: mlp(layout.velocity, Activation::Silu),
            steps: steps(advection.from, advection.to, advection.longest_step),
        }
    }

    fn k(&self) -> usize {
        self.input.config.bases()
    }

    /// The motion bases at the times of the integration.
    pub(super) fn bases(&self) -> Bases {
        let times = twist_times(self.input.time.from, &self.steps);
        if times.is_empty() {
            return Bases::default();
        }
        let (k, count) = (self.k(), times.len());
        let mut encoding = vec![0.0; self.velocity.shape().layout.hidden[0].inputs * count];
        for (j, t) in times.iter().enumerate() {
            encode_into(&[*t], self.input.config.velocity.time_frequencies, &mut encoding[j..], count);
        }
        let (out, tape) = self.velocity.evaluate(&[&encoding], count);
        let twist = |j: usize, i: usize| std::array::from_fn(|c| out[(TWIST * i + c) * count + j]);
        let twists = (0..count).flat_map(|j| (0..k).map(move |i| (j, i))).map(|(j, i)| twist(j, i)).collect();
        Bases { twists, encoding, tape: Some(tape) }
    }

    /// Pose rows, and what `keep` makes of what every block leaves.
    pub(super) fn forward<T: Send>(
        &self,
        bases: &Bases,
        keep: impl Fn(BlockKept) -> T + Sync,
    ) -> (Vec<[f32; DELTAS]>, Vec<T>) {
        let NetworkInput { means, rotations, .. } = self.input;
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
        let (codes, code_tape) = self.code.evaluate(&[&encoded], block);
        let deformation = self.pass.forward(Block { means, rotations, codes: &codes }, encoded, poses);
        let flow = (!self.steps.is_empty()).then(|| self.forward_flow(&codes, bases, poses));
        BlockKept { deformation, codes, code_tape, flow }
    }

    fn forward_flow(&self, codes: &[f32], bases: &Bases, poses: &mut [[f32; DELTAS]]) -> FlowKept {
        let block = poses.len();
        let (weights, tape) = self.segment.evaluate(&[codes], block);
        let starts: Vec<[f32; 3]> = poses.iter().map(|&[x, y, z, ..]| [x, y, z]).collect();
        let mut turns = Vec::new();
        for (b, pose) in poses.iter_mut().enumerate() {
            let twists = self.mixed(&weights, bases, (b, block));
            pose[..3].copy_from_slice(&integrate(&self.steps, &twists, starts[b]));
            if self.input.time.turns {
                let turn = rotation(self.input.config.velocity.rotation, &self.steps, &twists);
                let turned = quat_mul(turn, [pose[3], pose[4], pose[5], pose[6]]);
                pose[3..7].copy_from_slice(&turned);
                turns.push(turn);
            }
        }
        FlowKept { weights, tape, starts, turns }
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
        if self.input.time.learns == Learns::All {
            let (means, rotations) = (&self.input.means[gaussians.clone()], &self.input.rotations[gaussians]);
            let block = Block { means, rotations, codes: &kept.codes };
            v_codes = self.pass.backward(&kept.deformation, block, rows, &mut partial.deformation);
        } else {
            rows.fill([0.0; DELTAS]);
        }
        if let Some(v) = v_from_flow {
            v_codes.iter_mut().zip(v).for_each(|(sum, v)| *sum += v);
        }
        let inputs = [&kept.deformation.encoded[..]];
        let cotangents = OutputCotangents { inputs: &inputs, tape: &kept.code_tape, v_y: &v_codes };
        let mut scratch = Scratch::new(&self.code, rows.len());
        self.code.output_vjp(cotangents, &mut scratch, &mut partial.code, &mut []);
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
        let mut v_codes = vec![0.0; k * block];
        let cotangents = OutputCotangents { inputs: &[codes], tape: &flow.tape, v_y: &v_weights };
        let mut scratch = Scratch::new(&self.segment, block);
        self.segment.output_vjp(cotangents, &mut scratch, &mut partial.segment, &mut [&mut v_codes]);
        v_codes
    }

    /// Zeros.
    pub(super) fn partial(&self, bases: &Bases) -> Partial {
        Partial {
            deformation: self.pass.gradients(),
            code: MlpGradients::zeros(self.code.shape()),
            segment: MlpGradients::zeros(self.segment.shape()),
            bases: vec![[0.0; TWIST]; bases.twists.len()],
        }
    }

    /// The gradient by all parameters: the partial sums in order, and then what reaches the time network and
    /// the velocity network through them.
    pub(super) fn sum(&self, bases: &Bases, partials: &[Partial]) -> Vec<f32> {
        let mut params = vec![0.0; self.input.params.len()];
        let mut v_bases = vec![[0.0; TWIST]; bases.twists.len()];
        for partial in partials {
            let Partial { deformation, code, segment, bases } = partial;
            [deformation, code, segment].into_iter().for_each(|mlp| mlp.add_to(&mut params));
            let sums = v_bases.as_flattened_mut().iter_mut();
            sums.zip(bases.as_flattened()).for_each(|(sum, v)| *sum += v);
        }
        self.pass.finish(&mut params);
        self.backward_bases(bases, &v_bases, &mut params);
        params
    }

    fn backward_bases(&self, bases: &Bases, v_bases: &[Twist], v_params: &mut [f32]) {
        let Some(tape) = &bases.tape else { return };
        let (k, count) = (self.k(), bases.twists.len() / self.k());
        let mut v_out = vec![0.0; TWIST * k * count];
        for (at, v_twist) in v_bases.iter().enumerate() {
            let (j, i) = (at / k, at % k);
            v_twist.iter().enumerate().for_each(|(c, v)| v_out[(TWIST * i + c) * count + j] = *v);
        }
        let cotangents = OutputCotangents { inputs: &[&bases.encoding], tape, v_y: &v_out };
        let mut scratch = Scratch::new(&self.velocity, count);
        let mut gradients = MlpGradients::zeros(self.velocity.shape());
        self.velocity.output_vjp(cotangents, &mut scratch, &mut gradients, &mut []);
        gradients.add_to(v_params);
    }
}
