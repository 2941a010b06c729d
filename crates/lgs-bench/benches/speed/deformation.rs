//! The deformation network of DefGS, 8 layers of 256 units, at one time: forward, and forward with the
//! gradient of every parameter.

use crate::dynamics::share;
use crate::particles::points;
use burn::tensor::{Device, Tensor, TensorData};
use lgs_bench::machine::Machine;
use lgs_bench::table::{Row, section};
use lgs_bench::{Beside, Panels, median_secs};
use lgs_model::source::reference::{self, ReferenceInput};
use lgs_model::source::{DELTAS, Deformation, DeformationConfig, InputFrame, NetworkInput, PoseNetwork};

/// Gaussians of a scene in training, early and late.
const COUNTS: [usize; 2] = [4000, 20_000];

const TIME: f32 = 0.4;

pub(crate) fn run(machine: &Machine) {
    let network = Deformation::init(DeformationConfig::paper(), InputFrame::IDENTITY, 1);
    section(&format!(
        "deformation network ({} layers of {} units)",
        network.config.depth, network.config.width
    ));
    let [forward, both] = operations(&network.config);
    for count in COUNTS {
        let case = Case::new(&network, count);
        let name = |what: &str| format!("{count} Gaussians, {what}");
        let measured = Beside::measure::<Panels, _>(machine.cores, || DeformationConfig::poses(case.input()));
        share(&name("forward"), measured, forward * count as f64, None).print();
        let measured = Beside::measure::<Panels, _>(machine.cores, || case.both());
        share(&name("forward + backward"), measured, both * count as f64, None).print();
        let reference = median_secs(5, || case.reference());
        Row::timed(name("forward + backward in tensor operations"), reference)
            .with_ratio(format!("{:.2} × the fused time", reference / measured.secs))
            .print();
    }
}

/// Gaussians, and cotangents of their poses.
struct Case<'a> {
    network: &'a Deformation,
    means: Vec<[f32; 3]>,
    rotations: Vec<[f32; 4]>,
    v_poses: Vec<[f32; DELTAS]>,
}

impl<'a> Case<'a> {
    fn new(network: &'a Deformation, count: usize) -> Self {
        let rotations = points(count, 1.0, 2).into_iter().map(|[x, y, z]| [2.0, x, y, z]).collect();
        Self { network, means: points(count, 1.0, 1), rotations, v_poses: vec![[1.0; DELTAS]; count] }
    }

    fn input(&self) -> NetworkInput<'_, DeformationConfig> {
        self.network.input(&self.means, &self.rotations, TIME)
    }

    fn both(&self) -> Vec<f32> {
        let (poses, kept) = DeformationConfig::poses_kept(self.input());
        std::hint::black_box(poses);
        DeformationConfig::vjp(self.input(), &kept, &self.v_poses).params
    }

    /// The same by Burn's operations and its gradient.
    fn reference(&self) {
        let device = Device::flex().autodiff();
        let (params, n) = (&self.network.params, self.means.len());
        let params =
            Tensor::<1>::from_data(TensorData::new(params.clone(), [params.len()]), &device).require_grad();
        let means =
            Tensor::<2>::from_data(TensorData::new(self.means.as_flattened().to_vec(), [n, 3]), &device);
        let rotations =
            Tensor::<2>::from_data(TensorData::new(self.rotations.as_flattened().to_vec(), [n, 4]), &device);
        let (config, frame) = (&self.network.config, self.network.frame);
        let poses = reference::deform(ReferenceInput { config, frame, params, means, rotations, time: TIME });
        std::hint::black_box(poses.sum().backward());
    }
}

/// Multiplications and additions of the matrix products for one Gaussian: forward, and forward + backward.
/// The columns of the time, which are the same for all Gaussians, are not counted, and the encoded position,
/// which is a constant, has no gradient.
fn operations(config: &DeformationConfig) -> [f64; 2] {
    let layout = config.layout().mlp;
    let readers = (0..layout.hidden.len()).filter(|&i| layout.reads_inputs(i)).count();
    let all: usize = layout.linears().map(|l| l.inputs * l.outputs).sum();
    let forward = 2.0 * (all - readers * config.time_width() * config.width) as f64;
    let constant = 2.0 * (readers * config.position_width() * config.width) as f64;
    [forward, 3.0 * forward - constant]
}
