//! The deformation network as one operation on slices: Gaussians and one time in, `[x', q', Δs]` per Gaussian out.
//!
//! All Gaussians of a frame share its time, so the time's columns of a weight act as a bias that is worked out once per call.
//! Gaussians run in blocks of fixed size, feature-major; a block's weight gradients are kept apart and summed in block order, so the
//! result does not depend on the number of threads. What enters the encoding is a constant (DefGS detaches it, §3.2); gradients
//! reach positions and quaternions where the pose is applied to them.

use rand::RngExt;
use rayon::prelude::*;

use super::config::{DeformationConfig, HeadInit, LinearRange, NetworkLayout};
use super::encoding::{encode, encode_into};
use super::matrix::{Columns, add_backward_weight, add_forward, backward_inputs};
use super::pose::{DELTAS, pose, pose_vjp};

/// Gaussians per block: activations of a small network stay in the second-level cache.
const BLOCK: usize = 256;

/// Blocks whose weight gradients are accumulated together; bounds the memory of the partial sums.
const BLOCKS_PER_PARTIAL: usize = 4;

/// The affine map applied to positions before encoding: `(x − center) / scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputFrame {
    /// World units.
    pub center: [f32; 3],
    /// World units.
    pub scale: f32,
}

impl InputFrame {
    /// Positions as they are.
    pub const IDENTITY: Self = Self { center: [0.0; 3], scale: 1.0 };

    /// Centre and half extent of a box around points (the identity if there are none or they coincide).
    #[must_use]
    pub fn around(points: &[[f32; 3]]) -> Self {
        let low = points.iter().fold([f32::MAX; 3], |a, p| std::array::from_fn(|i| a[i].min(p[i])));
        let high = points.iter().fold([f32::MIN; 3], |a, p| std::array::from_fn(|i| a[i].max(p[i])));
        let scale = (0..3).map(|i| 0.5 * (high[i] - low[i])).fold(0.0, f32::max);
        if scale.is_finite() && scale > 1e-6 {
            Self { center: std::array::from_fn(|i| 0.5 * (low[i] + high[i])), scale }
        } else {
            Self::IDENTITY
        }
    }
}

/// A deformation network with its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformation {
    /// Sizes.
    pub config: DeformationConfig,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// All parameters, laid out as [`DeformationConfig::layout`] says.
    pub params: Vec<f32>,
}

impl Deformation {
    /// A fresh network: weights and biases uniform in ±1/√fan_in, the head as configured.
    #[must_use]
    pub fn init(config: DeformationConfig, frame: InputFrame, seed: u64) -> Self {
        let layout = config.layout();
        let mut random = lgs_core::stream(seed, "deformation network", 0);
        let mut params = Vec::with_capacity(layout.len);
        for (_, linear) in layout.linears() {
            let bound = 1.0 / (linear.inputs as f32).sqrt();
            params.extend((0..linear.inputs * linear.outputs + linear.outputs).map(|_| random.random_range(-bound..bound)));
        }
        let factor = match config.head_init {
            HeadInit::Uniform => 1.0,
            HeadInit::Small => 0.01,
            HeadInit::Zero => 0.0,
        };
        params[layout.head.weight..].iter_mut().for_each(|p| *p *= factor);
        Self { config, frame, params }
    }

    /// Pose rows `[x', q', Δs]` of Gaussians at a time.
    #[must_use]
    pub fn poses(&self, means: &[[f32; 3]], rotations: &[[f32; 4]], time: f32) -> Vec<[f32; DELTAS]> {
        deform(DeformInput { config: &self.config, frame: self.frame, params: &self.params, means, rotations, time })
    }
}

/// What a call works on.
#[derive(Clone, Copy)]
pub struct DeformInput<'a> {
    /// Sizes.
    pub config: &'a DeformationConfig,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// Parameters `[P]`.
    pub params: &'a [f32],
    /// Canonical centres `[n]`.
    pub means: &'a [[f32; 3]],
    /// Canonical quaternions `[n]`, of any length but zero.
    pub rotations: &'a [[f32; 4]],
    /// Time of the frame.
    pub time: f32,
}

/// Cotangents of what a gradient reaches.
#[derive(Clone, Debug, PartialEq)]
pub struct DeformGradients {
    /// By the parameters `[P]`.
    pub params: Vec<f32>,
    /// By the canonical centres, `[n]`; not through the encoding.
    pub means: Vec<[f32; 3]>,
    /// By the canonical quaternions, `[n]`.
    pub rotations: Vec<[f32; 4]>,
}

/// Per layer that reads the input, what the time adds to its bias; and what is needed to go back.
struct TimePart {
    encoding: Vec<f32>,
    hidden: Vec<f32>,
    features: Vec<f32>,
    /// Bias plus time columns, per hidden layer.
    biases: Vec<Vec<f32>>,
}

impl TimePart {
    fn new(config: &DeformationConfig, layout: &NetworkLayout, params: &[f32], time: f32) -> Self {
        let encoding = encode(&[time], config.time_frequencies);
        let (hidden, features) = match &layout.time {
            Some([first, second]) => {
                let hidden: Vec<f32> = linear_row(first, params, &encoding).into_iter().map(|v| v.max(0.0)).collect();
                let features = linear_row(second, params, &hidden);
                (hidden, features)
            }
            None => (Vec::new(), encoding.clone()),
        };
        let first_column = config.position_width();
        let biases = layout.layers.iter().enumerate().map(|(i, l)| {
            let mut bias = params[l.bias..l.bias + l.outputs].to_vec();
            if config.reads_input(i) {
                for (o, b) in bias.iter_mut().enumerate() {
                    let row = &params[l.weight + o * l.inputs + first_column..][..features.len()];
                    *b += dot(row, &features);
                }
            }
            bias
        });
        let biases = biases.collect();
        Self { encoding, hidden, features, biases }
    }

    /// Turns the gradients of the effective biases, already in `v_params`, into those of time columns and time network.
    fn backward(&self, config: &DeformationConfig, layout: &NetworkLayout, params: &[f32], v_params: &mut [f32]) {
        let first_column = config.position_width();
        let mut v_features = vec![0.0; self.features.len()];
        for (_, l) in layout.layers.iter().enumerate().filter(|&(i, _)| config.reads_input(i)) {
            for o in 0..l.outputs {
                let v_bias = v_params[l.bias + o];
                let row = l.weight + o * l.inputs + first_column;
                for (t, &feature) in self.features.iter().enumerate() {
                    v_params[row + t] += v_bias * feature;
                    v_features[t] += v_bias * params[row + t];
                }
            }
        }
        let Some([first, second]) = &layout.time else { return };
        let mut v_hidden = linear_row_vjp(second, params, &self.hidden, &v_features, v_params);
        v_hidden.iter_mut().zip(&self.hidden).filter(|(_, h)| **h <= 0.0).for_each(|(v, _)| *v = 0.0);
        linear_row_vjp(first, params, &self.encoding, &v_hidden, v_params);
    }
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn linear_row(l: &LinearRange, params: &[f32], x: &[f32]) -> Vec<f32> {
    (0..l.outputs).map(|o| params[l.bias + o] + dot(&params[l.weight + o * l.inputs..][..l.inputs], x)).collect()
}

fn linear_row_vjp(l: &LinearRange, params: &[f32], x: &[f32], v_z: &[f32], v_params: &mut [f32]) -> Vec<f32> {
    let mut v_x = vec![0.0; l.inputs];
    for (o, &v) in v_z.iter().enumerate() {
        v_params[l.bias + o] += v;
        let row = l.weight + o * l.inputs;
        for i in 0..l.inputs {
            v_params[row + i] += v * x[i];
            v_x[i] += v * params[row + i];
        }
    }
    v_x
}

/// A call's constants.
struct Pass<'a> {
    config: &'a DeformationConfig,
    layout: NetworkLayout,
    frame: InputFrame,
    params: &'a [f32],
    time: TimePart,
    gain: f32,
}

impl<'a> Pass<'a> {
    fn new(config: &'a DeformationConfig, frame: InputFrame, params: &'a [f32], time: f32) -> Self {
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

    fn forward_block(&self, means: &[[f32; 3]], rotations: &[[f32; 4]], out: &mut [[f32; DELTAS]]) {
        let block = means.len();
        let hidden = self.activations(&self.encoded(means), block);
        let raw = self.raw_rows(hidden.last().map_or(&[], Vec::as_slice), block);
        for (i, row) in out.iter_mut().enumerate() {
            *row = pose(self.config.motion_head, self.frame, &raw[i], means[i], rotations[i]);
        }
    }

    /// Adds a block's gradients to `v_params` (those of time columns stay in the biases until [`TimePart::backward`]), and turns its rows
    /// of `v_poses` into those by centres and quaternions, `[v_x, v_q, unused]`.
    fn backward_block(&self, means: &[[f32; 3]], rotations: &[[f32; 4]], v_poses: &mut [[f32; DELTAS]], v_params: &mut [f32]) {
        let block = means.len();
        let x = self.encoded(means);
        let hidden = self.activations(&x, block);
        let head = &self.layout.head;
        let raw = self.raw_rows(hidden.last().map_or(&[], Vec::as_slice), block);
        let mut v_z = vec![0.0; DELTAS * block];
        for (b, row) in v_poses.iter_mut().enumerate() {
            let (v_raw, v_x, v_q) = pose_vjp(self.config.motion_head, self.frame, &raw[b], (means[b], rotations[b]), row);
            v_raw.iter().enumerate().for_each(|(d, v)| v_z[d * block + b] = self.gain * v);
            row[..3].copy_from_slice(&v_x);
            row[3..7].copy_from_slice(&v_q);
        }
        add_bias_gradient(&mut v_params[head.bias..], &v_z, block);
        let mut v_h = vec![0.0; head.inputs * block];
        if let Some(last) = hidden.last() {
            add_backward_weight(&mut v_params[head.weight..head.bias], self.head_columns(), &v_z, last, block);
        }
        backward_inputs(self.weight(head), self.head_columns(), &v_z, &mut v_h, block);
        for (i, l) in self.layout.layers.iter().enumerate().rev() {
            v_h.iter_mut().zip(&hidden[i]).for_each(|(v, h)| *v = if *h > 0.0 { *v } else { 0.0 });
            add_bias_gradient(&mut v_params[l.bias..l.bias + l.outputs], &v_h, block);
            let (from_input, from_layer) = self.columns(i);
            let v_weight = &mut v_params[l.weight..l.bias];
            if let Some(columns) = from_input {
                add_backward_weight(v_weight, columns, &v_h, &x, block);
            }
            if let Some(columns) = from_layer {
                add_backward_weight(v_weight, columns, &v_h, &hidden[i - 1], block);
                let mut v_before = vec![0.0; columns.count * block];
                backward_inputs(self.weight(l), columns, &v_h, &mut v_before, block);
                v_h = v_before;
            }
        }
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

/// Pose rows `[x', q', Δs]` of Gaussians at a time.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn deform(input: DeformInput<'_>) -> Vec<[f32; DELTAS]> {
    assert_eq!(input.means.len(), input.rotations.len(), "centres and quaternions");
    let pass = Pass::new(input.config, input.frame, input.params, input.time);
    let mut out = vec![[0.0; DELTAS]; input.means.len()];
    let blocks = out.par_chunks_mut(BLOCK).zip(input.means.par_chunks(BLOCK)).zip(input.rotations.par_chunks(BLOCK));
    blocks.for_each(|((out, means), rotations)| pass.forward_block(means, rotations, out));
    out
}

/// Gradients of [`deform`], given those by its rows.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn deform_vjp(input: DeformInput<'_>, v_poses: &[[f32; DELTAS]]) -> DeformGradients {
    let n = input.means.len();
    assert_eq!((input.rotations.len(), v_poses.len()), (n, n), "Gaussians and cotangents");
    let pass = Pass::new(input.config, input.frame, input.params, input.time);
    let mut rows = v_poses.to_vec();
    let group = BLOCK * BLOCKS_PER_PARTIAL.min(n.div_ceil(16 * BLOCK).max(1));
    let groups = rows.par_chunks_mut(group).zip(input.means.par_chunks(group)).zip(input.rotations.par_chunks(group));
    let partials: Vec<Vec<f32>> = groups
        .map(|((rows, means), rotations)| {
            let mut v_params = vec![0.0; input.params.len()];
            for ((rows, means), rotations) in rows.chunks_mut(BLOCK).zip(means.chunks(BLOCK)).zip(rotations.chunks(BLOCK)) {
                pass.backward_block(means, rotations, rows, &mut v_params);
            }
            v_params
        })
        .collect();
    let mut params = vec![0.0; input.params.len()];
    for partial in &partials {
        params.iter_mut().zip(partial).for_each(|(v, p)| *v += p);
    }
    pass.time.backward(input.config, &pass.layout, input.params, &mut params);
    let (means, rotations) = rows.iter().map(|r| ([r[0], r[1], r[2]], [r[3], r[4], r[5], r[6]])).unzip();
    DeformGradients { params, means, rotations }
}
