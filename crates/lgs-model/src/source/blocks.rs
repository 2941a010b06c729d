//! One block of Gaussians through the deformation network and back; activations are feature-major,
//! `[features, block]`.

use super::chain::{Activation, Chain, Input, Kept};
use super::config::{DeformationConfig, NetworkLayout};
use super::encoding::encode_into;
use super::network::{DeformInput, InputFrame};
use super::pose::{DELTAS, pose, pose_vjp};
use super::time_part::TimePart;

/// What a block's way back needs.
#[derive(Clone, Debug)]
pub(super) struct Activations {
    /// Encoded positions.
    pub(super) encoded: Vec<f32>,
    /// Of the layers.
    layers: Kept,
    /// Outputs of the network, times the gain.
    raw: Vec<[f32; DELTAS]>,
}

/// A block's Gaussians.
#[derive(Clone, Copy)]
pub(super) struct Block<'a> {
    pub(super) means: &'a [[f32; 3]],
    pub(super) rotations: &'a [[f32; 4]],
    /// Codes, `[code, block]`; empty if the network reads none.
    pub(super) codes: &'a [f32],
}

/// A call's constants.
pub(super) struct Pass<'a> {
    config: &'a DeformationConfig,
    layout: NetworkLayout,
    frame: InputFrame,
    params: &'a [f32],
    time: TimePart,
    gain: f32,
}

impl<'a> Pass<'a> {
    /// Of a network whose parameters are the first of those given.
    pub(super) fn new(input: &DeformInput<'a>) -> Self {
        let DeformInput { config, frame, params, time, .. } = *input;
        let layout = config.layout();
        assert!(params.len() >= layout.len, "parameters of the deformation network");
        let gain = config.gain(time);
        let time = TimePart::new(config, &layout, params, time);
        Self { config, layout, frame, params, time, gain }
    }

    fn chain(&self) -> Chain<'_> {
        let NetworkLayout { layers, head, .. } = &self.layout;
        Chain {
            params: self.params,
            hidden: layers,
            head,
            skip_layer: self.config.skip_layer,
            activation: Activation::Relu,
        }
    }

    fn inputs<'b>(&self, encoded: &'b [f32], codes: &'b [f32]) -> [Input<'b>; 2] {
        let (position, code) = (self.config.position_width(), self.config.code);
        [
            Input { values: encoded, first: 0, count: position },
            Input { values: codes, first: position + self.config.time_width(), count: code },
        ]
    }

    /// Pose rows of a block, whose positions are given encoded as well, into `poses`.
    pub(super) fn forward(
        &self,
        gaussians: Block<'_>,
        encoded: Vec<f32>,
        poses: &mut [[f32; DELTAS]],
    ) -> Activations {
        let Block { means, rotations, codes } = gaussians;
        let block = means.len();
        let (z, layers) = self.chain().forward(&self.inputs(&encoded, codes), Some(&self.time.biases), block);
        let raw: Vec<[f32; DELTAS]> =
            (0..block).map(|b| std::array::from_fn(|d| self.gain * z[d * block + b])).collect();
        for (i, row) in poses.iter_mut().enumerate() {
            *row = pose(self.config.motion_head, self.frame, &raw[i], means[i], rotations[i]);
        }
        Activations { encoded, layers, raw }
    }

    /// Adds a block's gradients to `v_params` (those of time columns stay in the biases until
    /// [`Self::finish`]), and turns its rows of `v_poses` into those by centres and quaternions, `[v_x, v_q,
    /// unused]`. Returns the cotangents of the codes, `[code, block]`.
    pub(super) fn backward(
        &self,
        kept: &Activations,
        gaussians: Block<'_>,
        v_poses: &mut [[f32; DELTAS]],
        v_params: &mut [f32],
    ) -> Vec<f32> {
        let Block { means, rotations, codes } = gaussians;
        let block = means.len();
        let mut v_z = vec![0.0; DELTAS * block];
        for (b, row) in v_poses.iter_mut().enumerate() {
            let (v_raw, v_x, v_q) =
                pose_vjp(self.config.motion_head, self.frame, &kept.raw[b], (means[b], rotations[b]), row);
            v_raw.iter().enumerate().for_each(|(d, v)| v_z[d * block + b] = self.gain * v);
            row[..3].copy_from_slice(&v_x);
            row[3..7].copy_from_slice(&v_q);
        }
        let mut v_inputs = [Vec::new(), vec![0.0; codes.len()]];
        self.chain().backward(
            &kept.layers,
            &self.inputs(&kept.encoded, codes),
            &v_z,
            v_params,
            &mut v_inputs,
        );
        let [_, v_codes] = v_inputs;
        v_codes
    }

    /// Turns the gradients of the effective biases into those of time columns and time network, once all
    /// blocks have been added.
    pub(super) fn finish(&self, v_params: &mut [f32]) {
        self.time.backward(self.config, &self.layout, self.params, v_params);
    }
}

/// Encodings of positions in the frame, `[features, block]`.
pub(super) fn encoded(positions: &[[f32; 3]], frame: InputFrame, config: &DeformationConfig) -> Vec<f32> {
    let block = positions.len();
    let mut x = vec![0.0; config.position_width() * block];
    for (b, p) in positions.iter().enumerate() {
        let local: [f32; 3] = std::array::from_fn(|i| (p[i] - frame.center[i]) / frame.scale);
        encode_into(&local, config.position_frequencies, &mut x[b..], block);
    }
    x
}
