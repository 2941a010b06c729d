//! Gaussians in the poses that a source model's motion gives them.

use burn::tensor::Tensor;
use lgs_model::source::{DEFORMED_SCALE_FLOOR, ScaleMode};

use crate::cloud_tensors::CloudTensors;

impl CloudTensors {
    /// The Gaussians in pose rows `[n, DELTAS]`, whose last numbers change scales in a mode.
    pub(super) fn posed(self, poses: Tensor<2>, mode: ScaleMode) -> Self {
        let by_scale = poses.clone().narrow(1, 7, 3);
        let log_scales = match mode {
            ScaleMode::Additive => (self.log_scales.exp() + by_scale).clamp_min(DEFORMED_SCALE_FLOOR).log(),
            ScaleMode::Exponent => self.log_scales + by_scale,
            ScaleMode::Fixed => self.log_scales,
        };
        let (means, rotations) = (poses.clone().narrow(1, 0, 3), poses.narrow(1, 3, 4));
        Self { means, rotations, log_scales, ..self }
    }
}

#[cfg(test)]
mod tests {
    use crate::adam::{AdamGroup, values};
    use crate::cloud_tensors::rows;
    use crate::device::{Device, DeviceName};
    use lgs_model::source::{
        AdvectionConfig, Canonical, Captured, DeformationConfig, HeadInit, InputFrame, Moment, MotionConfig,
        SourceKind, VelocityConfig,
    };

    /// Unturned Gaussians at scattered positions.
    fn scattered(device: &Device) -> Canonical {
        let wave = |i: usize, f: f32| (i as f32 * f).sin();
        let means: Vec<[f32; 3]> =
            (0..120).map(|i| [wave(i, 0.37), wave(i + 9, 0.11), wave(i, 0.23)]).collect();
        let rotations = vec![[1.0, 0.0, 0.0, 0.0]; means.len()];
        Canonical { means: rows(&means, device), rotations: rows(&rotations, device), features: None }
    }

    #[test]
    fn agreement_leads_the_velocity_field_to_the_deformation_and_not_the_reverse() {
        let deformation =
            DeformationConfig { head_init: HeadInit::Uniform, ..DeformationConfig::freegave_quick() };
        let (velocity, advection) = (VelocityConfig::quick(), AdvectionConfig::quick());
        let config = MotionConfig {
            deformation: &deformation,
            velocity: Some(&velocity),
            advection: Some(&advection),
            nodes: None,
        };
        let captured = Captured { frame: InputFrame::IDENTITY, time_window: 0.75, seed: 1 };
        let flow = SourceKind::Freegave.motion(&config, captured).expect("a kind that is trained");
        let device = DeviceName::Cpu.device();
        let canonical = scattered(&device);
        let params = flow.init(7);
        let mut network = AdamGroup::new(params.clone(), [params.len()], &device);
        let at = |iteration| Moment { time: 0.3, iteration, window_end: 0.75 };
        assert!(
            flow.prior(&network.leaf(), &canonical, Moment { window_end: 0.05, ..at(0) }).is_none(),
            "no room for an advection step"
        );
        let (mut first, mut last) = (0.0, 0.0);
        for iteration in 0..200 {
            let leaf = network.leaf();
            let loss = flow.prior(&leaf, &canonical, at(iteration)).expect("a weight");
            let value = values(&loss)[0];
            if iteration < 20 {
                first += value;
            } else if iteration >= 180 {
                last += value;
            }
            let mut gradients = loss.backward();
            network.step(3e-3, leaf.grad_remove(&mut gradients));
        }
        assert!(last < 0.5 * first, "{first} {last}");
        let own = deformation.layout().len;
        assert_eq!(network.values()[..own], params[..own], "the deformation is a constant");
    }
}
