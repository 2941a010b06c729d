//! The deformation network as one operation on slices: positions and one time in, `[Δx, Δrotation, Δscale]` per Gaussian out.
//!
//! All Gaussians of a frame share its time, so the time's columns of a weight act as a bias that is worked out once per call.
//! Gaussians run in blocks of fixed size, feature-major; a block's weight gradients are kept apart and summed in block order, so the
//! result does not depend on the number of threads. Positions are constants here (DefGS detaches them, §3.2).

use rand::RngExt;
use rayon::prelude::*;

use super::config::{DeformationConfig, HeadInit, LinearRange, NetworkLayout};
use super::encoding::{encode, encode_into};
use super::matrix::{Columns, add_backward_weight, add_forward, backward_inputs};

/// Outputs per Gaussian: Δx (3), Δrotation (4), Δscale (3).
pub const DELTAS: usize = 10;

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

    /// The deltas of every position at a time, `[n, DELTAS]`.
    #[must_use]
    pub fn deltas(&self, positions: &[[f32; 3]], time: f32) -> Vec<f32> {
        deltas(&self.config, self.frame, &self.params, positions, time)
    }
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
        let gain = if config.anchored { time } else { 1.0 };
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

    fn forward_block(&self, positions: &[[f32; 3]], out: &mut [f32]) {
        let block = positions.len();
        let x = self.encoded(positions);
        let hidden = self.activations(&x, block);
        let head = &self.layout.head;
        let mut z = vec![0.0; DELTAS * block];
        z.chunks_exact_mut(block).zip(&self.params[head.bias..]).for_each(|(row, &b)| row.fill(b));
        if let Some(last) = hidden.last() {
            add_forward(self.weight(head), self.head_columns(), last, &mut z, block);
        }
        for (b, row) in out.chunks_exact_mut(DELTAS).enumerate() {
            row.iter_mut().enumerate().for_each(|(d, v)| *v = self.gain * z[d * block + b]);
        }
    }

    /// Adds a block's gradients to `v_params`; those of time columns stay in the biases until [`TimePart::backward`].
    fn backward_block(&self, positions: &[[f32; 3]], v_out: &[f32], v_params: &mut [f32]) {
        let block = positions.len();
        let x = self.encoded(positions);
        let hidden = self.activations(&x, block);
        let head = &self.layout.head;
        let mut v_z = vec![0.0; DELTAS * block];
        for (b, row) in v_out.chunks_exact(DELTAS).enumerate() {
            row.iter().enumerate().for_each(|(d, v)| v_z[d * block + b] = self.gain * v);
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

/// The deltas of `positions` `[n]` at a time: `[n, DELTAS]`.
///
/// # Panics
/// If `params` has another length than the configuration's layout.
#[must_use]
pub fn deltas(config: &DeformationConfig, frame: InputFrame, params: &[f32], positions: &[[f32; 3]], time: f32) -> Vec<f32> {
    let pass = Pass::new(config, frame, params, time);
    let mut out = vec![0.0; positions.len() * DELTAS];
    let blocks = out.par_chunks_mut(BLOCK * DELTAS).zip(positions.par_chunks(BLOCK));
    blocks.for_each(|(out, positions)| pass.forward_block(positions, out));
    out
}

/// The gradient by the parameters, given that by the deltas, `[n, DELTAS]`.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn deltas_vjp(
    config: &DeformationConfig,
    frame: InputFrame,
    params: &[f32],
    positions: &[[f32; 3]],
    time: f32,
    v_deltas: &[f32],
) -> Vec<f32> {
    assert_eq!(v_deltas.len(), positions.len() * DELTAS, "cotangents of the deltas");
    let pass = Pass::new(config, frame, params, time);
    let group = BLOCK * BLOCKS_PER_PARTIAL.min(positions.len().div_ceil(16 * BLOCK).max(1));
    let groups = positions.par_chunks(group).zip(v_deltas.par_chunks(group * DELTAS));
    let partials: Vec<Vec<f32>> = groups
        .map(|(positions, v_out)| {
            let mut v_params = vec![0.0; params.len()];
            for (p, v) in positions.chunks(BLOCK).zip(v_out.chunks(BLOCK * DELTAS)) {
                pass.backward_block(p, v, &mut v_params);
            }
            v_params
        })
        .collect();
    let mut v_params = vec![0.0; params.len()];
    for partial in &partials {
        v_params.iter_mut().zip(partial).for_each(|(v, p)| *v += p);
    }
    pass.time.backward(config, &pass.layout, params, &mut v_params);
    v_params
}
