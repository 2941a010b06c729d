//! One block of Gaussians through the deformation network and back; activations are feature-major, `[features, block]`.

use super::config::{DeformationConfig, LinearRange, NetworkLayout};
use super::encoding::encode_into;
use super::matrix::{Columns, add_backward_weight, add_forward, backward_inputs};
use super::network::{DeformInput, InputFrame};
use super::pose::{DELTAS, pose, pose_vjp};
use super::time_part::TimePart;

/// What a block's way back needs.
#[derive(Clone, Debug)]
pub(super) struct Activations {
    /// Encoded positions.
    encoded: Vec<f32>,
    /// Outputs of the hidden layers.
    hidden: Vec<Vec<f32>>,
    /// Outputs of the network, times the gain.
    raw: Vec<[f32; DELTAS]>,
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
    pub(super) fn new(input: &DeformInput<'a>) -> Self {
        let DeformInput { config, frame, params, time, .. } = *input;
        let layout = config.layout();
        assert_eq!(params.len(), layout.len, "parameters of the deformation network");
        let gain = config.gain(time);
        let time = TimePart::new(config, &layout, params, time);
        Self { config, layout, frame, params, time, gain }
    }

    fn encoded(&self, positions: &[[f32; 3]]) -> Vec<f32> {
        let block = positions.len();
        let mut x = vec![0.0; self.config.position_width() * block];
        for (b, p) in positions.iter().enumerate() {
            let local: [f32; 3] = std::array::from_fn(|i| (p[i] - self.frame.center[i]) / self.frame.scale);
            encode_into(&local, self.config.position_frequencies, &mut x[b..], block);
        }
        x
    }

    /// Columns of layer `index` that the encoded position meets, and those that the layer before meets.
    fn columns(&self, index: usize) -> (Option<Columns>, Option<Columns>) {
        let l = &self.layout.layers[index];
        let reads = self.config.reads_input(index);
        let columns = |first, count| Columns { row: l.inputs, first, count, outputs: l.outputs };
        let from_input = reads.then(|| columns(0, self.config.position_width()));
        let own = self.config.width;
        let from_layer = (index > 0).then(|| columns(l.inputs - own, own));
        (from_input, from_layer)
    }

    fn weight(&self, l: &LinearRange) -> &'a [f32] {
        &self.params[l.weight..l.bias]
    }

    /// Activations of all hidden layers, `[layer][width, block]`.
    fn activations(&self, x: &[f32], block: usize) -> Vec<Vec<f32>> {
        let mut hidden: Vec<Vec<f32>> = Vec::with_capacity(self.layout.layers.len());
        for (i, l) in self.layout.layers.iter().enumerate() {
            let mut z = vec![0.0; l.outputs * block];
            z.chunks_exact_mut(block).zip(&self.time.biases[i]).for_each(|(row, &b)| row.fill(b));
            let (from_input, from_layer) = self.columns(i);
            if let Some(columns) = from_input {
                add_forward(self.weight(l), columns, x, &mut z, block);
            }
            if let (Some(columns), Some(before)) = (from_layer, hidden.last()) {
                add_forward(self.weight(l), columns, before, &mut z, block);
            }
            z.iter_mut().for_each(|v| *v = if *v > 0.0 { *v } else { 0.0 });
            hidden.push(z);
        }
        hidden
    }

    fn head_columns(&self) -> Columns {
        let head = &self.layout.head;
        Columns { row: head.inputs, first: 0, count: head.inputs, outputs: head.outputs }
    }

    /// Raw rows of a block, from its last hidden layer.
    fn raw_rows(&self, last: &[f32], block: usize) -> Vec<[f32; DELTAS]> {
        let head = &self.layout.head;
        let mut z = vec![0.0; DELTAS * block];
        z.chunks_exact_mut(block).zip(&self.params[head.bias..]).for_each(|(row, &b)| row.fill(b));
        add_forward(self.weight(head), self.head_columns(), last, &mut z, block);
        (0..block).map(|b| std::array::from_fn(|d| self.gain * z[d * block + b])).collect()
    }

    /// Pose rows of a block into `poses`.
    pub(super) fn forward(&self, means: &[[f32; 3]], rotations: &[[f32; 4]], poses: &mut [[f32; DELTAS]]) -> Activations {
        let block = means.len();
        let encoded = self.encoded(means);
        let hidden = self.activations(&encoded, block);
        let raw = self.raw_rows(hidden.last().map_or(&[], Vec::as_slice), block);
        for (i, row) in poses.iter_mut().enumerate() {
            *row = pose(self.config.motion_head, self.frame, &raw[i], means[i], rotations[i]);
        }
        Activations { encoded, hidden, raw }
    }

    /// Adds a block's gradients to `v_params` (those of time columns stay in the biases until [`Self::finish`]), and turns its rows of
    /// `v_poses` into those by centres and quaternions, `[v_x, v_q, unused]`.
    pub(super) fn backward(
        &self,
        kept: &Activations,
        means: &[[f32; 3]],
        rotations: &[[f32; 4]],
        v_poses: &mut [[f32; DELTAS]],
        v_params: &mut [f32],
    ) {
        let block = means.len();
        let head = &self.layout.head;
        let mut v_z = vec![0.0; DELTAS * block];
        for (b, row) in v_poses.iter_mut().enumerate() {
            let (v_raw, v_x, v_q) = pose_vjp(self.config.motion_head, self.frame, &kept.raw[b], (means[b], rotations[b]), row);
            v_raw.iter().enumerate().for_each(|(d, v)| v_z[d * block + b] = self.gain * v);
            row[..3].copy_from_slice(&v_x);
            row[3..7].copy_from_slice(&v_q);
        }
        add_bias_gradient(&mut v_params[head.bias..], &v_z, block);
        let mut v_h = vec![0.0; head.inputs * block];
        if let Some(last) = kept.hidden.last() {
            add_backward_weight(&mut v_params[head.weight..head.bias], self.head_columns(), &v_z, last, block);
        }
        backward_inputs(self.weight(head), self.head_columns(), &v_z, &mut v_h, block);
        self.backward_layers(kept, v_h, block, v_params);
    }

    /// Goes back through the hidden layers, from the cotangent of the last one's outputs.
    fn backward_layers(&self, kept: &Activations, mut v_h: Vec<f32>, block: usize, v_params: &mut [f32]) {
        for (i, l) in self.layout.layers.iter().enumerate().rev() {
            v_h.iter_mut().zip(&kept.hidden[i]).for_each(|(v, h)| *v = if *h > 0.0 { *v } else { 0.0 });
            add_bias_gradient(&mut v_params[l.bias..l.bias + l.outputs], &v_h, block);
            let (from_input, from_layer) = self.columns(i);
            let v_weight = &mut v_params[l.weight..l.bias];
            if let Some(columns) = from_input {
                add_backward_weight(v_weight, columns, &v_h, &kept.encoded, block);
            }
            if let Some(columns) = from_layer {
                add_backward_weight(v_weight, columns, &v_h, &kept.hidden[i - 1], block);
                let mut v_before = vec![0.0; columns.count * block];
                backward_inputs(self.weight(l), columns, &v_h, &mut v_before, block);
                v_h = v_before;
            }
        }
    }

    /// Turns the gradients of the effective biases into those of time columns and time network, once all blocks have been added.
    pub(super) fn finish(&self, v_params: &mut [f32]) {
        self.time.backward(self.config, &self.layout, self.params, v_params);
    }
}

fn add_bias_gradient(v_bias: &mut [f32], v_z: &[f32], block: usize) {
    for (v, row) in v_bias.iter_mut().zip(v_z.chunks_exact(block)) {
        // Eight running sums in a fixed order let the loop use vector registers.
        let mut lanes = [0.0_f32; 8];
        let (chunks, rest) = row.as_chunks::<8>();
        chunks.iter().for_each(|c| (0..8).for_each(|i| lanes[i] += c[i]));
        *v += lanes.iter().sum::<f32>() + rest.iter().sum::<f32>();
    }
}
