//! One block of Gaussians through the deformation network and back; activations are feature-major,
//! `[features, block]`.

use lgs_nn::encoding::encode_into;
use lgs_nn::{Mlp, MlpGradients, OutputCotangents, Scratch, Tape};

use super::config::{DELTAS, DeformationConfig, NetworkLayout};
use super::input::InputFrame;
use super::pose::{pose, pose_vjp};
use super::pose_network::NetworkInput;
use super::time_part::TimePart;

/// The values of a block that its backward pass needs.
#[derive(Debug)]
pub(super) struct Activations {
    /// Encoded positions.
    pub(super) encoded: Vec<f32>,
    /// Activations of the layers.
    tape: Tape,
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
    mlp: Mlp,
}

impl<'a> Pass<'a> {
    /// The pass of a network whose parameters are the first of those given.
    pub(super) fn new(input: &NetworkInput<'a, DeformationConfig>) -> Self {
        let NetworkInput { config, frame, params, time, .. } = *input;
        let layout = config.layout();
        assert!(params.len() >= layout.len, "parameters of the deformation network");
        let gain = config.gain(time);
        let time = TimePart::new(config, &layout, params, time);
        let mlp = Mlp::new(layout.shape(), params).with_biases(&time.biases);
        Self { config, layout, frame, params, time, gain, mlp }
    }

    /// Zeros, one for each parameter of the network proper.
    pub(super) fn gradients(&self) -> MlpGradients {
        MlpGradients::zeros(self.mlp.shape())
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
        let (z, tape) = self.mlp.evaluate(&inputs(&encoded, codes), block);
        let raw: Vec<[f32; DELTAS]> =
            (0..block).map(|b| std::array::from_fn(|d| self.gain * z[d * block + b])).collect();
        for (i, row) in poses.iter_mut().enumerate() {
            *row = pose(self.config.motion_head, self.frame, &raw[i], means[i], rotations[i]);
        }
        Activations { encoded, tape, raw }
    }

    /// Adds a block's gradients to `gradients` (those of time columns stay in the biases until
    /// [`Self::finish`]), and turns its rows of `v_poses` into those by centres and quaternions, `[v_x, v_q,
    /// unused]`. Returns the cotangents of the codes, `[code, block]`.
    pub(super) fn backward(
        &self,
        kept: &Activations,
        gaussians: Block<'_>,
        v_poses: &mut [[f32; DELTAS]],
        gradients: &mut MlpGradients,
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
        let mut v_codes = vec![0.0; codes.len()];
        let inputs = inputs(&kept.encoded, codes);
        let cotangents = OutputCotangents { inputs: &inputs, tape: &kept.tape, v_y: &v_z };
        let mut scratch = Scratch::new(&self.mlp, block);
        self.mlp.output_vjp(cotangents, &mut scratch, gradients, &mut [&mut [], &mut v_codes]);
        v_codes
    }

    /// Turns the gradients of the effective biases into those of time columns and time network, once all
    /// blocks have been added.
    pub(super) fn finish(&self, v_params: &mut [f32]) {
        self.time.backward(self.config, &self.layout, self.params, v_params);
    }
}

/// The inputs of the network proper.
fn inputs<'a>(encoded: &'a [f32], codes: &'a [f32]) -> Vec<&'a [f32]> {
    if codes.is_empty() { vec![encoded] } else { vec![encoded, codes] }
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
