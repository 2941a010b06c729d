//! Sizes and choices of FreeGave's networks (method §3.2), and where each parameter lies in the flat vector.

use lgs_nn::encoding::encoded_width;
use lgs_nn::{LinearRange, MlpLayout, MlpSizes, ParamRange};
use serde::{Deserialize, Serialize};

use super::twist::TWIST;
use crate::source::config::{DeformationConfig, NetworkLayout, within};

/// Hidden units of the segment head, as a multiple of the code's length (method §3.2).
const SEGMENT_FACTOR: usize = 4;

/// Accumulation of the rotation of a Gaussian that the velocity field carries (method §3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RotationForm {
    /// As published: products of `I + h [ω]×`, never orthonormalised, then a quaternion by a formula that
    /// fails near half a turn. Gaussians swell in the plane of rotation, and what is not a number is not
    /// drawn.
    Reference,
    /// Products of exp(h ω), renormalised.
    Fixed,
}

/// Code field, segment head and velocity network, and how they are integrated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VelocityConfig {
    /// Hidden layers of the code field (paper: 4).
    pub code_depth: usize,
    /// Units per hidden layer of the code field (paper: 128).
    pub code_width: usize,
    /// The position enters the code field again after this layer, counted from 0 (paper: 2).
    pub code_skip_layer: usize,
    /// Hidden layers of the velocity network (paper: 5).
    pub depth: usize,
    /// Units per hidden layer of the velocity network (paper: 128).
    pub width: usize,
    /// Frequencies of its time encoding (paper: 3). With 1 velocities change more evenly beyond the captured
    /// window, but some motions are never followed.
    pub time_frequencies: usize,
    /// T*: the deformation ends and the velocity field takes over (paper: 0.70 to 0.75, by scene).
    pub max_time: f32,
    /// Steps of the integration per unit of time (paper: 60).
    pub fps: f32,
    /// Accumulation of rotations (paper: reference).
    pub rotation: RotationForm,
    /// A Gaussian that stays within this distance of where it is at t = 0 does not move at all when drawn,
    /// world units (paper: 0.01).
    pub still_within: f32,
}

impl Default for VelocityConfig {
    fn default() -> Self {
        Self::quick()
    }
}

impl VelocityConfig {
    /// As published, for the scenes that end at 0.75 (method §3.2).
    #[must_use]
    pub fn paper() -> Self {
        Self {
            code_depth: 4,
            code_width: 128,
            code_skip_layer: 2,
            depth: 5,
            width: 128,
            time_frequencies: 3,
            max_time: 0.75,
            fps: 60.0,
            rotation: RotationForm::Reference,
            still_within: 0.01,
        }
    }

    /// Small networks for the processor, and a velocity field that is also followed over the window's last
    /// part.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            code_depth: 2,
            code_width: 32,
            code_skip_layer: 2,
            depth: 2,
            width: 64,
            max_time: 0.7,
            rotation: RotationForm::Fixed,
            ..Self::paper()
        }
    }
}

impl VelocityConfig {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        within(&[
            ("code_depth", self.code_depth, 1, 32),
            ("code_width", self.code_width, 1, 4096),
            ("depth", self.depth, 1, 32),
            ("width", self.width, 1, 4096),
            ("time_frequencies", self.time_frequencies, 0, 16),
        ])?;
        within(&[
            ("max_time", self.max_time, 0.0, 1e3),
            ("fps", self.fps, 1.0, 1e4),
            ("still_within", self.still_within, 0.0, 1e6),
        ])
    }
}

/// Sizes and choices of all of FreeGave's networks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeGaveConfig {
    /// The deformation network; its code is the Gaussians' code.
    pub deformation: DeformationConfig,
    /// The rest.
    pub velocity: VelocityConfig,
}

impl FreeGaveConfig {
    /// Checks the values; a refusal is (field, reason).
    ///
    /// # Errors
    /// The first field out of range.
    pub fn validate(&self) -> Result<(), (String, String)> {
        self.deformation.validate().map_err(|(field, reason)| (format!("deformation.{field}"), reason))?;
        if self.deformation.code == 0 {
            return Err((
                "deformation.code".to_owned(),
                "0 leaves the velocity field without bases".to_owned(),
            ));
        }
        self.velocity.validate().map_err(|(field, reason)| (format!("velocity.{field}"), reason))
    }

    /// Motion bases K, which is the length of a code.
    #[must_use]
    pub fn bases(&self) -> usize {
        self.deformation.code
    }

    /// Places of the parameters in the flat vector.
    #[must_use]
    pub fn layout(&self) -> FreeGaveLayout {
        FreeGaveLayout::new(self)
    }
}

/// Places of all layers.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeGaveLayout {
    /// The deformation network, from the first float on.
    pub deformation: NetworkLayout,
    /// The code field.
    pub code: MlpLayout,
    /// The segment head.
    pub segment: MlpLayout,
    /// The velocity network.
    pub velocity: MlpLayout,
    /// Floats in all.
    pub len: usize,
}

impl FreeGaveLayout {
    fn new(config: &FreeGaveConfig) -> Self {
        let FreeGaveConfig { deformation, velocity } = config;
        let k = config.bases();
        let own = deformation.layout();
        let mut len = own.len;
        let mut mlp = |inputs, [depth, width]: [usize; 2], outputs, skip_layer| {
            MlpLayout::new(MlpSizes { inputs, depth, width, outputs, skip_layer }, &mut len)
        };
        let position = deformation.position_width();
        let code = mlp(position, [velocity.code_depth, velocity.code_width], k, velocity.code_skip_layer);
        let segment = mlp(k, [2, SEGMENT_FACTOR * k], k, MlpSizes::NO_SKIP);
        let time = encoded_width(1, velocity.time_frequencies);
        let velocity = mlp(time, [velocity.depth, velocity.width], TWIST * k, MlpSizes::NO_SKIP);
        Self { deformation: own, code, segment, velocity, len }
    }

    /// Every layer with its name.
    #[must_use]
    pub fn linears(&self) -> Vec<(String, &LinearRange)> {
        let own = self.deformation.linears().into_iter().map(|(name, l)| (format!("deformation.{name}"), l));
        let rest = [("code", &self.code), ("segment", &self.segment), ("velocity", &self.velocity)];
        let rest = rest.into_iter().flat_map(|(network, layout)| {
            layout.named_linears().map(move |(name, l)| (format!("{network}.{name}"), l))
        });
        own.chain(rest).collect()
    }

    /// Names, shapes and ranges of all parameters.
    #[must_use]
    pub fn params(&self) -> Vec<ParamRange> {
        self.linears().into_iter().flat_map(|(name, layer)| layer.params(&name)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_networks_have_the_published_numbers_of_parameters() {
        // Counted in the authors' program.
        let deformation = DeformationConfig::freegave_paper();
        let layout = FreeGaveConfig { deformation, velocity: VelocityConfig::paper() }.layout();
        let (code, segment) = (layout.code.end(), layout.segment.end());
        assert_eq!(
            (layout.deformation.len, segment - layout.deformation.len, layout.len - segment),
            (114_472, 71_072, 79_456)
        );
        assert!(code < segment && layout.velocity.end() == layout.len);
    }

    #[test]
    fn parameters_tile_the_vector() {
        let layout = FreeGaveConfig {
            deformation: DeformationConfig::freegave_quick(),
            velocity: VelocityConfig::quick(),
        }
        .layout();
        let mut end = 0;
        for param in layout.params() {
            assert_eq!(param.range.start, end, "{}", param.name);
            assert_eq!(param.range.len(), param.shape.iter().product::<usize>());
            end = param.range.end;
        }
        assert_eq!(end, layout.len);
    }
}
