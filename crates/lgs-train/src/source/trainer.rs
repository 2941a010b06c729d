//! One iteration of source training, and everything that a checkpoint has to hold to go on as if nothing had
//! happened.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::{Camera, Image, stream};
use lgs_data::dataset::{Dataset, Frame, SceneBox};
use lgs_model::source::{InputFrame, SourceModel};
use lgs_model::{TensorFile, TensorFileError};
use lgs_render::tensor::{photometric_loss, rasterize};

use super::config::SourceConfig;
use super::densify::{Attributes, DensifyPlan, DensifyStatistics};
use super::guide::Guide;
use super::initial::initial_cloud;
use super::motion::{Captured, Moment, SourceMotion, source_motion};
use super::order::{FrameOrder, Round};
use super::params::{Leaves, Rates, Skip, SourceParams, image_tensor};
use super::rigidity::NeighborGraph;
use super::static_regulariser;
use crate::TrainError;
use crate::adam::values;

/// Opacity that a reset lowers to (§2.7).
const RESET_OPACITY: f32 = 0.01;

/// What an iteration found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// Iterations done.
    pub iteration: usize,
    /// Photometric loss of the frame.
    pub loss: f32,
    /// PSNR of the frame before the step, dB.
    pub psnr: f32,
    /// Gaussians after the step.
    pub gaussians: usize,
}

/// Training between two iterations.
pub struct SourceTrainer<'a> {
    frames: &'a [Frame],
    background: [f32; 3],
    extent: f32,
    bounds: SceneBox,
    config: SourceConfig,
    seed: u64,
    device: Device,
    iteration: usize,
    params: SourceParams,
    motion: Box<dyn SourceMotion>,
    statistics: DensifyStatistics,
    order: FrameOrder,
    graph: Option<NeighborGraph>,
    guide: Guide,
}

impl<'a> SourceTrainer<'a> {
    /// A fresh start. The configuration must have been validated.
    ///
    /// # Errors
    /// If the dataset has no training frames.
    pub fn new(dataset: &'a Dataset, config: &SourceConfig, seed: u64) -> Result<Self, TrainError> {
        let frames = dataset.split("train");
        if frames.is_empty() {
            return Err(TrainError::NoFrames(dataset.root.clone()));
        }
        let device = Device::flex();
        let config = config.stretched(frames[0].camera.width);
        let guide = Guide::new(dataset, &config.guide);
        let cloud = initial_cloud(dataset, &config, guide.tracks(), seed);
        let frame = if config.deformation.normalised_positions {
            InputFrame::around(&cloud.means)
        } else {
            InputFrame::IDENTITY
        };
        let order = FrameOrder::new(frames, &config, seed);
        let motion = source_motion(&config, Captured { frame, time_window: order.span().1, seed });
        Ok(Self {
            order,
            frames,
            background: dataset.background,
            extent: dataset.extent(),
            bounds: dataset.scene_box(),
            config,
            seed,
            iteration: 0,
            statistics: DensifyStatistics::new(cloud.len()),
            params: SourceParams::new(&cloud, motion.init(seed), &device),
            motion,
            graph: None,
            guide,
            device,
        })
    }

    /// Iterations done.
    #[must_use]
    pub fn iteration(&self) -> usize {
        self.iteration
    }

    /// Iterations in all.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.config.iterations
    }

    /// Whether all iterations are done.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.iteration >= self.config.iterations
    }

    /// One iteration.
    ///
    /// # Errors
    /// If the loss is not finite.
    pub fn step(&mut self) -> Result<StepReport, TrainError> {
        let iteration = self.iteration + 1;
        let frame = &self.frames[self.order.next(iteration, &self.config)];
        let (camera, target) = tracing::trace_span!("frame").in_scope(|| self.view(frame, iteration));
        let deformed = !self.config.is_warmup(iteration);
        let leaves = self.params.leaves();
        let (first, last) = self.order.span();
        let at = Moment {
            time: frame.time,
            iteration,
            window_end: self.config.window_end(iteration, first, last),
        };
        let poses = deformed.then(|| {
            let poses =
                self.motion.poses(leaves.network.clone(), leaves.means.clone(), leaves.rotations.clone(), at);
            (poses, self.motion.scale_mode())
        });
        let splats = self.params.splats(&leaves, poses);
        let drawn = rasterize(&splats, &camera, self.background, self.config.active_degree(iteration));
        let psnr = psnr_of(values(&drawn.image).as_chunks().0, &target);
        let visible = drawn.visible();
        let photometric =
            photometric_loss(drawn.image, image_tensor(&target, &self.device), self.config.ssim_weight);
        let loss = values(&photometric)[0];
        if !loss.is_finite() {
            return Err(TrainError::NonFinite { name: "loss", iteration });
        }
        let total = if deformed {
            self.with_priors(photometric, &splats.means, &leaves.network, at)
        } else {
            photometric
        };
        let mut gradients = tracing::trace_span!("backward").in_scope(|| total.backward());
        self.observe(&leaves, &mut gradients, &visible, (&camera, iteration));
        let skip = self.adapt_density(iteration);
        let rates = Rates { config: &self.config, iteration };
        self.params.step(&leaves, &mut gradients, skip, &rates);
        self.iteration = iteration;
        Ok(StepReport { iteration, loss, psnr, gaussians: self.params.len() })
    }

    /// Camera and image of an iteration, reduced in size early on if so configured.
    fn view(&self, frame: &Frame, iteration: usize) -> (Camera, Image) {
        let image = frame.composited(self.background);
        let factor = self.config.reduction;
        let fits = image.width >= factor && image.height >= factor;
        if factor > 1 && iteration < self.config.reduced_before && fits {
            (frame.camera.reduced(factor), image.reduced(factor))
        } else {
            (frame.camera, image)
        }
    }

    /// The loss with what the configuration expects of motions: agreement of its parts, rigid neighbourhoods,
    /// still surroundings, paths that silhouettes tell.
    fn with_priors(
        &mut self,
        loss: Tensor<1>,
        means: &Tensor<2>,
        network: &Tensor<1>,
        at: Moment,
    ) -> Tensor<1> {
        let _span = tracing::trace_span!("priors of motion").entered();
        let shapes = self.params.shapes();
        let loss = match self.motion.prior(network, &shapes, at) {
            Some(prior) => loss + prior,
            None => loss,
        };
        let rigidity = &self.config.rigidity;
        let static_regulariser = if self.iteration >= self.config.static_regulariser_after {
            self.config.static_regulariser
        } else {
            0.0
        };
        if rigidity.weight <= 0.0 && static_regulariser <= 0.0 && self.guide.is_empty() {
            return loss;
        }
        let canonical = shapes.means;
        let deformed = values(means);
        let deformed = deformed.as_chunks::<3>().0;
        let mut pull = static_regulariser::gradient(&canonical, deformed, static_regulariser, self.extent);
        if rigidity.weight > 0.0 {
            let graph = self.graph.get_or_insert_with(|| NeighborGraph::new(&canonical, rigidity.neighbors));
            let rigid = graph.gradient(&canonical, deformed, rigidity);
            pull.iter_mut().zip(rigid).for_each(|(p, r)| *p = lgs_core::linear::add(*p, r));
        }
        if !self.guide.is_empty() {
            let guided =
                self.guide.gradient(&canonical, deformed, at.time, self.config.guide_weight(self.iteration));
            pull.iter_mut().zip(guided).for_each(|(p, g)| *p = lgs_core::linear::add(*p, g));
        }
        // The inner product with a constant has that constant as its gradient.
        let pull = TensorData::new(pull.as_flattened().to_vec(), [canonical.len(), 3]);
        loss + (means.clone() * Tensor::<2>::from_data(pull, &self.device).autodiff()).sum()
    }

    fn observe(
        &mut self,
        leaves: &Leaves,
        gradients: &mut burn::tensor::Gradients,
        visible: &[bool],
        at: (&Camera, usize),
    ) {
        let (camera, iteration) = at;
        if iteration >= self.config.densify.before {
            return;
        }
        if let Some(gradient) = leaves.probe.grad_remove(gradients) {
            let rows = values(&gradient);
            self.statistics.observe(
                rows.as_chunks::<2>().0,
                visible.iter().copied(),
                camera.width,
                camera.height,
            );
        }
    }

    /// Densification and opacity reset, where they are due (§2.7); says which groups were replaced.
    fn adapt_density(&mut self, iteration: usize) -> Skip {
        let config = &self.config.densify;
        let mut skip = Skip::default();
        if iteration >= config.before {
            return skip;
        }
        if iteration > config.after && iteration.is_multiple_of(config.interval) {
            let _span = tracing::trace_span!("densify").entered();
            let plan = self.plan(iteration);
            self.params.densify(&plan, &mut stream(self.seed, "split", iteration as u64));
            self.statistics = DensifyStatistics::new(self.params.len());
            self.graph = None;
            skip.gaussians = true;
        }
        let white = self.background == [1.0; 3];
        let due =
            config.opacity_reset_interval > 0 && iteration.is_multiple_of(config.opacity_reset_interval);
        if due || (white && iteration == config.white_reset_at) {
            self.params.cap_opacity(RESET_OPACITY);
            skip.opacity = true;
        }
        skip
    }

    fn plan(&self, iteration: usize) -> DensifyPlan {
        let max_scales: Vec<f32> =
            self.params.shapes().log_scales.iter().map(|s| s[0].max(s[1]).max(s[2]).exp()).collect();
        let opacities: Vec<f32> =
            self.params.raw_opacities().iter().map(|o| 1.0 / (1.0 + (-o).exp())).collect();
        let reach = self.config.densify.prune_outside * self.bounds.half_side;
        let is_outside =
            |p: &[f32; 3]| reach > 0.0 && (0..3).any(|i| (p[i] - self.bounds.center[i]).abs() > reach);
        let outside: Vec<bool> = self.params.shapes().means.iter().map(is_outside).collect();
        let attributes = Attributes {
            max_scales: &max_scales,
            opacities: &opacities,
            extent: self.extent,
            outside: &outside,
        };
        DensifyPlan::new(&self.config.densify, &self.statistics, attributes, iteration)
    }

    /// The model as it is now.
    #[must_use]
    pub fn model(&self) -> Box<dyn SourceModel> {
        self.motion.model(self.params.cloud(), self.params.network())
    }

    /// Writes the whole state into a checkpoint.
    pub fn snapshot(&self, file: &mut TensorFile) {
        self.params.insert_into(file);
        let n = self.params.len();
        file.insert("densify.gradient_sum", &[n], &self.statistics.gradient_sum);
        file.insert("densify.count", &[n], &self.statistics.count);
        if let Some(graph) = &self.graph {
            file.insert_indices("rigidity.neighbors", &[n, graph.row], &graph.indices);
        }
        let round = self.order.round();
        for (key, value) in [
            ("iteration", self.iteration as u64),
            ("round", round.number),
            ("used", round.used as u64),
            ("began", round.began as u64),
        ] {
            file.set_metadata(key, value.to_string());
        }
    }

    /// Goes on from a checkpoint of the same dataset, configuration and seed.
    ///
    /// # Errors
    /// If the dataset has no training frames or a part of the state is absent, not finite or of another
    /// shape.
    pub fn restore(
        dataset: &'a Dataset,
        config: &SourceConfig,
        seed: u64,
        file: &TensorFile,
    ) -> Result<Self, TrainError> {
        let mut trainer = Self::new(dataset, config, seed)?;
        trainer.params =
            SourceParams::read_from(file, config.sh_degree, trainer.motion.len(), &trainer.device)?;
        let n = trainer.params.len();
        let per_gaussian = |name: &str| {
            let (shape, values) = file.values(name)?;
            if shape == [n] {
                Ok(values.to_vec())
            } else {
                Err(file.field(name, &format!("shape [{n}]"), format!("{shape:?}")))
            }
        };
        trainer.statistics = DensifyStatistics {
            gradient_sum: per_gaussian("densify.gradient_sum")?,
            count: per_gaussian("densify.count")?,
        };
        trainer.iteration = file.metadata_json("iteration")?;
        let round = Round {
            number: file.metadata_json("round")?,
            used: file.metadata_json("used")?,
            began: file.metadata_json("began")?,
        };
        trainer.order.restore(round, &trainer.config);
        trainer.graph = read_graph(file, n)?;
        Ok(trainer)
    }
}

fn read_graph(file: &TensorFile, n: usize) -> Result<Option<NeighborGraph>, TensorFileError> {
    const NAME: &str = "rigidity.neighbors";
    if !file.names().any(|name| name == NAME) {
        return Ok(None);
    }
    let (shape, indices) = file.indices(NAME)?;
    if shape.len() != 2 || shape[0] != n || indices.iter().any(|&i| i as usize >= n) {
        return Err(file.field(NAME, &format!("[{n}, k] indices below {n}"), format!("shape {shape:?}")));
    }
    Ok(Some(NeighborGraph { indices: indices.to_vec(), row: shape[1] }))
}

fn psnr_of(image: &[[f32; 3]], target: &Image) -> f32 {
    let target = target.pixels.as_flattened();
    let squared: f64 =
        image.as_flattened().iter().zip(target).map(|(a, b)| f64::from(a.clamp(0.0, 1.0) - b).powi(2)).sum();
    (-10.0 * (squared / target.len().max(1) as f64).max(1e-10).log10()) as f32
}
