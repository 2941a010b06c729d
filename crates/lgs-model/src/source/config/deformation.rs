//! Sizes and choices of the deformation network (method §3.1, §3.2), and where each parameter lies in the
//! flat vector.

use lgs_nn::encoding::encoded_width;
use lgs_nn::{Activation, LinearRange, MlpLayout, MlpShape, MlpSizes, NamedLayers};
use serde::{Deserialize, Serialize};

use super::heads::{DELTAS, HeadInit, MotionHead, ScaleMode};
use super::ranges::within;

/// The deformation network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DeformationConfig {
    /// Hidden layers (paper: 8). More bends trajectories more finely and costs proportionally.
    pub depth: usize,
    /// Units per hidden layer (paper: 256).
    pub width: usize,
    /// The input enters again after this layer, counted from 0 (paper: 4); `depth` or more: never.
    pub skip_layer: usize,
    /// Frequencies of the position encoding (paper: 10). Fewer make neighbours move alike.
    pub position_frequencies: usize,
    /// Frequencies of the time encoding (paper: 6). Fewer make trajectories smoother.
    pub time_frequencies: usize,
    /// Hidden units of the time network (paper: 256).
    pub time_hidden: usize,
    /// Outputs of the time network (paper: 30); 0: the time encoding enters directly.
    pub time_features: usize,
    /// Features of each Gaussian that enter beside position and time (paper: 0; FreeGave: 16, or 32 indoors).
    /// DefGS has none.
    pub code: usize,
    /// Meaning of the first two outputs (paper: displacement).
    pub motion_head: MotionHead,
    /// Meaning of the third output (paper: additive).
    pub scale_mode: ScaleMode,
    /// Initial values of the output layer (paper: uniform).
    pub head_init: HeadInit,
    /// Outputs are multiplied by `gain_start + gain_slope · t`: at t = 0 by this (paper: 1). Small, motion
    /// starts near the canonical Gaussians; 0 pins them to the first frame, which few images then hold in
    /// place.
    pub gain_start: f32,
    /// Growth of the factor with time (paper: 0). With 1, steady motion asks for an output that hardly
    /// changes with time.
    pub gain_slope: f32,
    /// Centres positions on the initial Gaussians and divides by their half extent before encoding (paper:
    /// false).
    pub normalised_positions: bool,
}

impl Default for DeformationConfig {
    fn default() -> Self {
        Self::quick()
    }
}

impl DeformationConfig {
    /// DefGS for synthetic scenes, exactly (method §3.1).
    #[must_use]
    pub fn paper() -> Self {
        Self {
            depth: 8,
            width: 256,
            skip_layer: 4,
            position_frequencies: 10,
            time_frequencies: 6,
            time_hidden: 256,
            time_features: 30,
            code: 0,
            motion_head: MotionHead::Displacement,
            scale_mode: ScaleMode::Additive,
            head_init: HeadInit::Uniform,
            gain_start: 1.0,
            gain_slope: 0.0,
            normalised_positions: false,
        }
    }

    /// A network whose cost on a CPU is below the rasterizer's, with smooth motion that starts at rest.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            depth: 4,
            width: 64,
            skip_layer: 2,
            position_frequencies: 4,
            time_frequencies: 4,
            time_hidden: 64,
            time_features: 24,
            code: 0,
            motion_head: MotionHead::Rigid,
            scale_mode: ScaleMode::Fixed,
            head_init: HeadInit::Small,
            gain_start: 0.2,
            gain_slope: 1.0,
            normalised_positions: true,
        }
    }

    /// FreeGave's, `light`, for synthetic objects, exactly (method §3.2).
    #[must_use]
    pub fn freegave_paper() -> Self {
        Self {
            depth: 6,
            width: 128,
            skip_layer: 3,
            position_frequencies: 8,
            time_hidden: 128,
            code: 16,
            motion_head: MotionHead::Turn,
            scale_mode: ScaleMode::Exponent,
            ..Self::paper()
        }
    }

    /// The network of [`Self::quick`] with a code of few bases.
    #[must_use]
    pub fn freegave_quick() -> Self {
        Self { code: 8, ..Self::quick() }
    }

    /// Checks the sizes; a refusal is (field, reason).
    ///
    /// # Errors
    /// The first field out of range.
    pub fn validate(&self) -> Result<(), (&'static str, String)> {
        within(&[
            ("gain_start", self.gain_start, 0.0, f32::MAX),
            ("gain_slope", self.gain_slope, 0.0, f32::MAX),
        ])?;
        within(&[
            ("depth", self.depth, 1, 32),
            ("width", self.width, 1, 4096),
            ("position_frequencies", self.position_frequencies, 0, 16),
            ("time_frequencies", self.time_frequencies, 0, 16),
            ("time_hidden", self.time_hidden, 1, 4096),
            ("time_features", self.time_features, 0, 4096),
            ("code", self.code, 0, 1024),
        ])
    }

    /// Numbers per encoded position.
    #[must_use]
    pub fn position_width(&self) -> usize {
        encoded_width(3, self.position_frequencies)
    }

    /// Numbers that stand for the time at the network's input.
    #[must_use]
    pub fn time_width(&self) -> usize {
        if self.time_features > 0 { self.time_features } else { encoded_width(1, self.time_frequencies) }
    }

    /// The factor of the outputs at a time.
    #[must_use]
    pub fn gain(&self, time: f32) -> f32 {
        self.gain_start + self.gain_slope * time
    }

    /// Places of the parameters in the flat vector.
    #[must_use]
    pub fn layout(&self) -> NetworkLayout {
        NetworkLayout::new(self)
    }
}

/// Places of all layers.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkLayout {
    /// The time network's two layers, if there is one.
    pub time: Option<[LinearRange; 2]>,
    /// The network proper. Where a layer reads the input its columns are position, time, code, then the layer
    /// before; its outputs are Δx (3), Δrotation (4), Δscale (3).
    pub mlp: MlpLayout,
    /// Columns of position, time and code at the input.
    columns: [usize; 3],
    /// Floats in all.
    pub len: usize,
}

impl NetworkLayout {
    fn new(config: &DeformationConfig) -> Self {
        let mut len = 0;
        let mut linear = |inputs: usize, outputs: usize| LinearRange::take(inputs, outputs, &mut len);
        let time_encoding = encoded_width(1, config.time_frequencies);
        let time = (config.time_features > 0).then(|| {
            [linear(time_encoding, config.time_hidden), linear(config.time_hidden, config.time_features)]
        });
        let columns = [config.position_width(), config.time_width(), config.code];
        let sizes = MlpSizes {
            inputs: columns.iter().sum(),
            depth: config.depth,
            width: config.width,
            outputs: DELTAS,
            skip_layer: config.skip_layer,
        };
        let mlp = MlpLayout::new(sizes, &mut len);
        Self { time, mlp, columns, len }
    }

    /// The network proper, with positions and, where there are any, codes as its inputs: the time acts
    /// through the biases.
    pub(in crate::source) fn shape(&self) -> MlpShape {
        let [position, time, code] = self.columns;
        let codes = position + time..position + time + code;
        let inputs = [0..position, codes].into_iter().filter(|columns| !columns.is_empty()).collect();
        MlpShape { layout: self.mlp.clone(), inputs, activation: Activation::Relu }
    }
}

impl NamedLayers for NetworkLayout {
    fn linears(&self) -> Vec<(String, &LinearRange)> {
        let time = self.time.iter().flatten().enumerate().map(|(i, l)| (format!("time.{i}"), l));
        time.chain(self.mlp.named_linears()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::testing::assert_tiles;

    #[test]
    fn the_paper_network_has_the_published_number_of_parameters() {
        // Counted in the authors' program.
        assert_eq!(DeformationConfig::paper().layout().len, 522_280);
    }

    #[test]
    fn parameters_tile_the_vector() {
        let layout = DeformationConfig::quick().layout();
        assert_tiles(&layout.params(), layout.len);
    }
}
