//! The trained parameters of a source model, one Adam group per attribute, and how they become what the
//! rasterizer draws (§2.6, §3.4).

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::{GaussianCloud, sh_coefficients};
use lgs_model::source::{DEFORMED_SCALE_FLOOR, ScaleMode};
use lgs_model::{TensorFile, TensorFileError};
use lgs_render::tensor::SplatTensors;

use super::config::SourceConfig;
use super::densify::{DensifyPlan, new_shapes};
use crate::adam::AdamGroup;

/// Groups of Gaussian attributes, a row per Gaussian, and the network.
pub(super) struct SourceParams {
    means: AdamGroup<2>,
    rotations: AdamGroup<2>,
    log_scales: AdamGroup<2>,
    raw_opacities: AdamGroup<2>,
    sh_dc: AdamGroup<2>,
    /// Absent for colour of degree 0.
    sh_rest: Option<AdamGroup<2>>,
    network: AdamGroup<1>,
    sh_degree: usize,
}

/// Tracked leaves of one iteration.
pub(super) struct Leaves {
    pub(super) means: Tensor<2>,
    pub(super) rotations: Tensor<2>,
    log_scales: Tensor<2>,
    raw_opacities: Tensor<2>,
    sh_dc: Tensor<2>,
    sh_rest: Option<Tensor<2>>,
    pub(super) network: Tensor<1>,
    /// Zeros; its gradient is that by the projected centres.
    pub(super) probe: Tensor<2>,
}

/// Gaussian attributes outside the tensors.
pub(super) struct HostShapes {
    pub(super) means: Vec<[f32; 3]>,
    pub(super) rotations: Vec<[f32; 4]>,
    pub(super) log_scales: Vec<[f32; 3]>,
}

fn rows<const W: usize>(group: &AdamGroup<2>) -> Vec<[f32; W]> {
    group.values().as_chunks::<W>().0.to_vec()
}

impl SourceParams {
    pub(super) fn new(cloud: &GaussianCloud, network: Vec<f32>, device: &Device) -> Self {
        let n = cloud.len();
        let stride = cloud.sh_stride();
        let columns = |from: usize, to: usize| {
            cloud.sh.chunks_exact(stride).flat_map(|row| &row[from..to]).copied().collect::<Vec<f32>>()
        };
        let group = |values: Vec<f32>, width: usize| AdamGroup::new(values, [n, width], device);
        let len = network.len();
        Self {
            means: group(cloud.means.as_flattened().to_vec(), 3),
            rotations: group(cloud.rotations.as_flattened().to_vec(), 4),
            log_scales: group(cloud.log_scales.as_flattened().to_vec(), 3),
            raw_opacities: group(cloud.raw_opacities.clone(), 1),
            sh_dc: group(columns(0, 3), 3),
            sh_rest: (stride > 3).then(|| group(columns(3, stride), stride - 3)),
            network: AdamGroup::new(network, [len], device),
            sh_degree: cloud.sh_degree,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.means.rows()
    }

    pub(super) fn leaves(&self) -> Leaves {
        let zeros = Tensor::<2>::zeros([self.len(), 2], &self.means.device());
        Leaves {
            means: self.means.leaf(),
            rotations: self.rotations.leaf(),
            log_scales: self.log_scales.leaf(),
            raw_opacities: self.raw_opacities.leaf(),
            sh_dc: self.sh_dc.leaf(),
            sh_rest: self.sh_rest.as_ref().map(AdamGroup::leaf),
            network: self.network.leaf(),
            probe: zeros.autodiff().require_grad(),
        }
    }

    /// What is drawn: the canonical Gaussians, or those in pose rows `[n, DELTAS]`, whose last numbers change
    /// scales in a mode.
    pub(super) fn splats(&self, leaves: &Leaves, poses: Option<(Tensor<2>, ScaleMode)>) -> SplatTensors {
        let n = self.len();
        let dc = leaves.sh_dc.clone().reshape([n, 1, 3]);
        let sh = match &leaves.sh_rest {
            Some(rest) => {
                Tensor::cat(vec![dc, rest.clone().reshape([n, sh_coefficients(self.sh_degree) - 1, 3])], 1)
            }
            None => dc,
        };
        let mut splats = SplatTensors {
            means: leaves.means.clone(),
            rotations: leaves.rotations.clone(),
            log_scales: leaves.log_scales.clone(),
            raw_opacities: leaves.raw_opacities.clone().reshape([n]),
            sh,
            means2d_probe: leaves.probe.clone(),
        };
        if let Some((pose, mode)) = poses {
            splats.means = pose.clone().narrow(1, 0, 3);
            splats.rotations = pose.clone().narrow(1, 3, 4);
            splats.log_scales = match mode {
                ScaleMode::Additive => {
                    (splats.log_scales.exp() + pose.narrow(1, 7, 3)).clamp_min(DEFORMED_SCALE_FLOOR).log()
                }
                ScaleMode::Exponent => splats.log_scales + pose.narrow(1, 7, 3),
                ScaleMode::Fixed => splats.log_scales,
            };
        }
        splats
    }

    /// One step of Adam for every group whose gradient counts at this iteration.
    pub(super) fn step(
        &mut self,
        leaves: &Leaves,
        gradients: &mut burn::tensor::Gradients,
        skip: Skip,
        rates: &Rates<'_>,
    ) {
        let Rates { config, iteration } = *rates;
        let rates = &config.learning_rates;
        if !skip.gaussians {
            self.means.step(config.position_rate(iteration), leaves.means.grad_remove(gradients));
            self.rotations.step(rates.rotation, leaves.rotations.grad_remove(gradients));
            self.log_scales.step(rates.scale, leaves.log_scales.grad_remove(gradients));
            if !skip.opacity {
                self.raw_opacities.step(rates.opacity, leaves.raw_opacities.grad_remove(gradients));
            }
            self.sh_dc.step(rates.sh, leaves.sh_dc.grad_remove(gradients));
            if let (Some(group), Some(leaf)) = (&mut self.sh_rest, &leaves.sh_rest) {
                group.step(rates.sh_rest, leaf.grad_remove(gradients));
            }
        }
        self.network.step(config.deformation_rate(iteration), leaves.network.grad_remove(gradients));
    }

    pub(super) fn shapes(&self) -> HostShapes {
        HostShapes {
            means: rows(&self.means),
            rotations: rows(&self.rotations),
            log_scales: rows(&self.log_scales),
        }
    }

    pub(super) fn raw_opacities(&self) -> Vec<f32> {
        self.raw_opacities.values()
    }

    /// Applies a plan of densification to all groups.
    pub(super) fn densify(&mut self, plan: &DensifyPlan, random: &mut lgs_core::Stream) {
        let shapes = self.shapes();
        let (means, log_scales) =
            new_shapes(plan, &shapes.means, &shapes.rotations, &shapes.log_scales, random);
        let copies = |group: &AdamGroup<2>| {
            let (values, width) = (group.values(), group.width());
            plan.parents().flat_map(|i| values[i * width..(i + 1) * width].to_vec()).collect::<Vec<f32>>()
        };
        self.means.reselect(&plan.keep, means.as_flattened());
        self.log_scales.reselect(&plan.keep, log_scales.as_flattened());
        for group in [
            Some(&mut self.rotations),
            Some(&mut self.raw_opacities),
            Some(&mut self.sh_dc),
            self.sh_rest.as_mut(),
        ]
        .into_iter()
        .flatten()
        {
            let appended = copies(group);
            group.reselect(&plan.keep, &appended);
        }
    }

    /// Lowers opacities to at most `opacity` and forgets their moments.
    pub(super) fn cap_opacity(&mut self, opacity: f32) {
        let cap = (opacity / (1.0 - opacity)).ln();
        self.raw_opacities.replace(self.raw_opacities().into_iter().map(|o| o.min(cap)).collect());
    }

    /// The canonical Gaussians.
    pub(super) fn cloud(&self) -> GaussianCloud {
        let HostShapes { means, rotations, log_scales } = self.shapes();
        let dc = self.sh_dc.values();
        let rest = self.sh_rest.as_ref().map_or_else(Vec::new, AdamGroup::values);
        let width = 3 * (sh_coefficients(self.sh_degree) - 1);
        let sh = (0..means.len())
            .flat_map(|i| dc[3 * i..3 * i + 3].iter().chain(&rest[width * i..width * (i + 1)]))
            .copied()
            .collect();
        GaussianCloud {
            means,
            rotations,
            log_scales,
            raw_opacities: self.raw_opacities(),
            sh,
            sh_degree: self.sh_degree,
        }
    }

    pub(super) fn network(&self) -> Vec<f32> {
        self.network.values()
    }

    fn named(&self) -> Vec<(&'static str, &AdamGroup<2>)> {
        let always = [
            ("means", &self.means),
            ("rotations", &self.rotations),
            ("log_scales", &self.log_scales),
            ("raw_opacities", &self.raw_opacities),
            ("sh_dc", &self.sh_dc),
        ];
        always.into_iter().chain(self.sh_rest.as_ref().map(|g| ("sh_rest", g))).collect()
    }

    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        for (name, group) in self.named() {
            group.insert_into(file, name);
        }
        self.network.insert_into(file, "network");
    }

    /// Reads what [`Self::insert_into`] wrote.
    pub(super) fn read_from(
        file: &TensorFile,
        sh_degree: usize,
        network: usize,
        device: &Device,
    ) -> Result<Self, TensorFileError> {
        let means = AdamGroup::read_from(file, "means", [None, Some(3)], device)?;
        let n = means.rows();
        let group =
            |name: &str, width: usize| AdamGroup::read_from(file, name, [Some(n), Some(width)], device);
        let rest = 3 * (sh_coefficients(sh_degree) - 1);
        Ok(Self {
            rotations: group("rotations", 4)?,
            log_scales: group("log_scales", 3)?,
            raw_opacities: group("raw_opacities", 1)?,
            sh_dc: group("sh_dc", 3)?,
            sh_rest: if rest > 0 { Some(group("sh_rest", rest)?) } else { None },
            network: AdamGroup::read_from(file, "network", [Some(network)], device)?,
            means,
            sh_degree,
        })
    }
}

/// Groups that take no step, because densification or a reset has just replaced what their gradient belonged
/// to (§2.7).
#[derive(Clone, Copy, Default)]
pub(super) struct Skip {
    pub(super) gaussians: bool,
    pub(super) opacity: bool,
}

/// Learning rates at an iteration.
#[derive(Clone, Copy)]
pub(super) struct Rates<'a> {
    pub(super) config: &'a SourceConfig,
    pub(super) iteration: usize,
}

/// An image as a `[h, w, 3]` tensor.
pub(super) fn image_tensor(image: &lgs_core::Image, device: &Device) -> Tensor<3> {
    let shape = [image.height as usize, image.width as usize, 3];
    Tensor::from_data(TensorData::new(image.pixels.as_flattened().to_vec(), shape), device)
}
