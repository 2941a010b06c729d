//! The deformation network as a Burn operation, differentiable by its parameters.

use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind, unary};
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Dispatch, Flex, backend_extension};
use burn::tensor::{Tensor, TensorData};

use super::config::DeformationConfig;
use super::network::{self, DELTAS, InputFrame};

/// What a call needs beside tensors.
#[derive(Clone, Debug)]
pub struct DeltaSpec {
    /// Sizes.
    pub config: DeformationConfig,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// The frame's time.
    pub time: f32,
}

/// Backends that can run the network forwards.
#[backend_extension(Autodiff, Flex)]
pub trait DeformationOps: Backend {
    /// Deltas `[n, DELTAS]` from parameters `[P]` and positions `[n, 3]`; positions are constants.
    fn deltas(params: FloatTensor<Self>, positions: FloatTensor<Self>, spec: DeltaSpec) -> FloatTensor<Self>;
}

/// Backends that can run it backwards; apart from [`DeformationOps`], as only the inner backend of an autodiff one is asked.
pub trait DeformationVjp: Backend {
    /// The gradient by the parameters, `[P]`.
    fn deltas_vjp(
        params: FloatTensor<Self>,
        positions: FloatTensor<Self>,
        v_deltas: FloatTensor<Self>,
        spec: DeltaSpec,
    ) -> FloatTensor<Self>;
}

impl DeformationOps for Flex {
    fn deltas(params: FloatTensor<Self>, positions: FloatTensor<Self>, spec: DeltaSpec) -> FloatTensor<Self> {
        let (params, positions) = (params.to_contiguous(), positions.to_contiguous());
        let points = positions.storage::<f32>().as_chunks::<3>().0;
        let deltas = network::deltas(&spec.config, spec.frame, params.storage(), points, spec.time);
        Self::float_from_data(TensorData::new(deltas, [points.len(), DELTAS]), &Default::default())
    }
}

impl DeformationVjp for Flex {
    fn deltas_vjp(
        params: FloatTensor<Self>,
        positions: FloatTensor<Self>,
        v_deltas: FloatTensor<Self>,
        spec: DeltaSpec,
    ) -> FloatTensor<Self> {
        let (params, positions, v_deltas) = (params.to_contiguous(), positions.to_contiguous(), v_deltas.to_contiguous());
        let points = positions.storage::<f32>().as_chunks::<3>().0;
        let v_params = network::deltas_vjp(&spec.config, spec.frame, params.storage(), points, spec.time, v_deltas.storage());
        let len = v_params.len();
        Self::float_from_data(TensorData::new(v_params, [len]), &Default::default())
    }
}

#[derive(Debug)]
struct Deltas;

impl<B: DeformationVjp> Backward<B, 1> for Deltas {
    type State = (FloatTensor<B>, FloatTensor<B>, DeltaSpec);

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _checkpointer: &mut Checkpointer) {
        let (params, positions, spec) = ops.state;
        unary::<B, _>(ops.parents, ops.node, grads, |v_deltas| B::deltas_vjp(params, positions, v_deltas, spec));
    }
}

impl<B: DeformationOps + DeformationVjp, C: CheckpointStrategy> DeformationOps for Autodiff<B, C> {
    fn deltas(params: FloatTensor<Self>, positions: FloatTensor<Self>, spec: DeltaSpec) -> FloatTensor<Self> {
        let node = params.node();
        let (params, positions) = (params.into_primitive(), positions.into_primitive());
        let out = B::deltas(params.clone(), positions.clone(), spec.clone());
        match Deltas.prepare::<C>([node]).compute_bound().stateful() {
            OpsKind::Tracked(prep) => prep.finish((params, positions, spec), out),
            OpsKind::UnTracked(prep) => prep.finish(out),
        }
    }
}

/// Deltas `[n, DELTAS]` of `positions` `[n, 3]`, differentiable by `params` `[P]`; no gradient reaches the positions.
#[must_use]
pub fn deltas(params: Tensor<1>, positions: Tensor<2>, spec: DeltaSpec) -> Tensor<2> {
    let out = <Dispatch as DeformationOps>::deltas(params.into_dispatch(), positions.into_dispatch(), spec);
    Tensor::from_dispatch(out)
}

#[cfg(test)]
mod tests {
    use super::super::network::Deformation;
    use super::super::{HeadInit, reference};
    use super::*;
    use burn::tensor::Device;
    use lgs_core::testing::{assert_gradient_close, assert_values_close};

    fn points(n: usize) -> Vec<[f32; 3]> {
        (0..n).map(|i| [(i as f32 * 0.37).sin(), (i as f32 * 0.11).cos(), (i as f32 * 0.23).sin() * 0.5]).collect()
    }

    fn compare(config: DeformationConfig, n: usize) {
        let frame = InputFrame { center: [0.1, -0.2, 0.3], scale: 1.3 };
        let net = Deformation::init(config.clone(), frame, 5);
        let device = Device::flex().autodiff();
        let positions = points(n);
        let flat = TensorData::new(positions.as_flattened().to_vec(), [n, 3]);
        let weights: Vec<f32> = (0..n * DELTAS).map(|i| ((i * 29 % 17) as f32 - 8.0) * 0.1).collect();
        let weights = Tensor::<2>::from_data(TensorData::new(weights, [n, DELTAS]), &device);
        let run = |fused: bool| {
            let params = Tensor::<1>::from_floats(net.params.as_slice(), &device).require_grad();
            let spec = DeltaSpec { config: config.clone(), frame, time: 0.4 };
            let out = if fused {
                deltas(params.clone(), Tensor::from_data(flat.clone(), &device), spec)
            } else {
                reference::deltas(&config, frame, &params, &positions, 0.4)
            };
            let gradients = (out.clone() * weights.clone()).sum().backward();
            let gradient = params.grad(&gradients).expect("gradient");
            (out.into_data().try_to_vec::<f32>().expect("f32"), gradient.into_data().try_to_vec::<f32>().expect("f32"))
        };
        let ((out, gradient), (expected, expected_gradient)) = (run(true), run(false));
        assert_values_close("deltas", &out, &expected, 1e-5, 1e-5);
        assert_gradient_close("parameters", &gradient, &expected_gradient);
    }

    #[test]
    fn the_fused_network_agrees_with_its_twin() {
        let quick = DeformationConfig { head_init: HeadInit::Uniform, ..DeformationConfig::quick() };
        compare(quick.clone(), 1);
        compare(quick.clone(), 700);
        compare(DeformationConfig { time_features: 0, skip_layer: 9, depth: 2, anchored: false, ..quick.clone() }, 300);
        compare(DeformationConfig { depth: 6, width: 24, skip_layer: 4, ..quick }, 5000);
        compare(DeformationConfig { width: 64, ..DeformationConfig::paper() }, 300);
    }

    #[test]
    fn the_gradient_is_the_same_for_any_number_of_threads() {
        let config = DeformationConfig::quick();
        let net = Deformation::init(config.clone(), InputFrame::IDENTITY, 5);
        let positions = points(3000);
        let weights: Vec<f32> = (0..3000 * DELTAS).map(|i| ((i * 29 % 17) as f32 - 8.0) * 0.1).collect();
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
            pool.install(|| network::deltas_vjp(&config, net.frame, &net.params, &positions, 0.3, &weights))
        };
        let one = run(1);
        assert!(one.iter().any(|v| *v != 0.0));
        assert_eq!(one, run(2));
        assert_eq!(one, run(5));
    }

    #[test]
    fn no_gaussians_give_no_deltas_and_a_zero_gradient() {
        let config = DeformationConfig::quick();
        let net = Deformation::init(config.clone(), InputFrame::IDENTITY, 5);
        assert!(net.deltas(&[], 0.5).is_empty());
        assert!(network::deltas_vjp(&config, net.frame, &net.params, &[], 0.5, &[]).iter().all(|v| *v == 0.0));
    }
}
