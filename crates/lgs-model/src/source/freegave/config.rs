//! Sizes and choices of FreeGave's networks (§4.1, §4.2), and where each parameter lies in the flat vector.

use serde::{Deserialize, Serialize};

use crate::source::config::{DeformationConfig, LinearRange, NetworkLayout, ParamRange, params_of};
use crate::source::encoding::encoded_width;

use super::twist::TWIST;

/// Hidden units of the segment head, as a multiple of the code's length (§4.1).
const SEGMENT_FACTOR: usize = 4;

/// How the rotation of a Gaussian that the velocity field carries is accumulated (§4.2).
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
    /// How rotations are accumulated (paper: reference).
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
    /// As published, for the scenes that end at 0.75 (§4.1, §4.5).
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

/// All that decides what FreeGave's networks compute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeGaveConfig {
    /// The deformation network; its code is the Gaussians' code.
    pub deformation: DeformationConfig,
    /// The rest.
    pub velocity: VelocityConfig,
}

impl FreeGaveConfig {
    /// What is wrong with the values, as (field, reason).
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
        let velocity = &self.velocity;
        let sizes = [
            ("code_depth", velocity.code_depth, 1, 32),
            ("code_width", velocity.code_width, 1, 4096),
            ("depth", velocity.depth, 1, 32),
            ("width", velocity.width, 1, 4096),
            ("time_frequencies", velocity.time_frequencies, 0, 16),
        ];
        if let Some((field, value, low, high)) =
            sizes.into_iter().find(|&(_, value, low, high)| value < low || value > high)
        {
            return Err((format!("velocity.{field}"), format!("{value} is not between {low} and {high}")));
        }
        let numbers = [
            ("max_time", velocity.max_time, 0.0, 1e3),
            ("fps", velocity.fps, 1.0, 1e4),
            ("still_within", velocity.still_within, 0.0, 1e6),
        ];
        match numbers.into_iter().find(|(_, value, low, high)| !(low..=high).contains(&value)) {
            Some((field, value, low, high)) => {
                Err((format!("velocity.{field}"), format!("{value} is not between {low} and {high}")))
            }
            None => Ok(()),
        }
    }

    /// Motion bases K, which is the length of a code.
    #[must_use]
    pub fn bases(&self) -> usize {
        self.deformation.code
    }

    /// Where the parameters lie.
    #[must_use]
    pub fn layout(&self) -> FreeGaveLayout {
        FreeGaveLayout::new(self)
    }
}

/// Places of the layers of a network without side inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainLayout {
    /// Hidden layers.
    pub hidden: Vec<LinearRange>,
    /// The output layer.
    pub head: LinearRange,
}

impl ChainLayout {
    /// A chain from `inputs` through `depth` layers of `width` to `outputs`, from float `len` on, which is
    /// moved to its end.
    fn new([inputs, depth, width, outputs]: [usize; 4], skip_layer: usize, len: &mut usize) -> Self {
        let hidden = (0..depth).map(|i| {
            let own = if i == 0 { 0 } else { width };
            let read = if i == 0 || i == skip_layer + 1 { inputs } else { 0 };
            LinearRange::take(own + read, width, len)
        });
        Self { hidden: hidden.collect(), head: LinearRange::take(width, outputs, len) }
    }

    fn linears<'a>(&'a self, name: &'a str) -> impl Iterator<Item = (String, &'a LinearRange)> {
        let hidden = self.hidden.iter().enumerate().map(move |(i, l)| (format!("{name}.layer.{i}"), l));
        hidden.chain([(format!("{name}.head"), &self.head)])
    }
}

/// Places of all layers.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeGaveLayout {
    /// The deformation network, from the first float on.
    pub deformation: NetworkLayout,
    /// The code field.
    pub code: ChainLayout,
    /// The segment head.
    pub segment: ChainLayout,
    /// The velocity network.
    pub velocity: ChainLayout,
    /// Floats in all.
    pub len: usize,
}

impl FreeGaveLayout {
    fn new(config: &FreeGaveConfig) -> Self {
        let FreeGaveConfig { deformation, velocity } = config;
        let (k, never) = (config.bases(), usize::MAX - 1);
        let own = deformation.layout();
        let mut len = own.len;
        let position = deformation.position_width();
        let code = ChainLayout::new(
            [position, velocity.code_depth, velocity.code_width, k],
            velocity.code_skip_layer,
            &mut len,
        );
        let segment = ChainLayout::new([k, 2, SEGMENT_FACTOR * k, k], never, &mut len);
        let time = encoded_width(1, velocity.time_frequencies);
        let velocity = ChainLayout::new([time, velocity.depth, velocity.width, TWIST * k], never, &mut len);
        Self { deformation: own, code, segment, velocity, len }
    }

    /// Every layer with its name.
    #[must_use]
    pub fn linears(&self) -> Vec<(String, &LinearRange)> {
        let deformation =
            self.deformation.linears().into_iter().map(|(name, l)| (format!("deformation.{name}"), l));
        let rest = self
            .code
            .linears("code")
            .chain(self.segment.linears("segment"))
            .chain(self.velocity.linears("velocity"));
        deformation.chain(rest).collect()
    }

    /// Names, shapes and ranges of all parameters.
    #[must_use]
    pub fn params(&self) -> Vec<ParamRange> {
        params_of(self.linears())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_networks_have_the_published_numbers_of_parameters() {
        // reference-systems.md §4.8
        let deformation = DeformationConfig::freegave_paper();
        let layout = FreeGaveConfig { deformation, velocity: VelocityConfig::paper() }.layout();
        let end = |l: &ChainLayout| l.head.bias + l.head.outputs;
        let (code, segment) = (end(&layout.code), end(&layout.segment));
        assert_eq!(
            (layout.deformation.len, segment - layout.deformation.len, layout.len - segment),
            (114_472, 71_072, 79_456)
        );
        assert!(code < segment && end(&layout.velocity) == layout.len);
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
