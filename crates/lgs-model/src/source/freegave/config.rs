//! Sizes and choices of FreeGave's networks (method §3.2), and where each parameter lies in the flat vector.

use lgs_nn::encoding::encoded_width;
use lgs_nn::{LinearRange, MlpLayout, MlpSizes, NamedLayers};
use serde::{Deserialize, Serialize};

use super::twist::TWIST;
use crate::source::config::{DeformationConfig, NetworkLayout, VelocityConfig};

/// Hidden units of the segment head, as a multiple of the code's length (method §3.2).
const SEGMENT_FACTOR: usize = 4;

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
}

impl NamedLayers for FreeGaveLayout {
    fn linears(&self) -> Vec<(String, &LinearRange)> {
        let own = self.deformation.linears().into_iter().map(|(name, l)| (format!("deformation.{name}"), l));
        let rest = [("code", &self.code), ("segment", &self.segment), ("velocity", &self.velocity)];
        let rest = rest.into_iter().flat_map(|(network, layout)| {
            layout.named_linears().map(move |(name, l)| (format!("{network}.{name}"), l))
        });
        own.chain(rest).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::testing::assert_tiles;

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
        assert_tiles(&layout.params(), layout.len);
    }
}
