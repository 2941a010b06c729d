//! Nothing above the kernels names a backend.
//!
//! One operation is given two backends: the CPU's, which keeps a vector of floats, and a second one that
//! counts its calls and forwards to the first, whose kept state is a tensor of its own. The same autodiff
//! node runs both. A walk over the sources then shows that code above the kernels names no backend, so that
//! it runs on whatever device it is given.

use burn::backend::autodiff::checkpoint::strategy::NoCheckpointing;
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, AutodiffBackend, Backend, Flex};
use burn::tensor::{Shape, TensorData};
use lgs_tensor::{Kernel, flex, fused};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The operation `y = x²`, element by element.
#[derive(Clone, Debug)]
struct Square;

lgs_tensor::calls! { Square: "square"; }

impl Kernel<Square, 1> for Flex {
    type Kept = Vec<f32>;

    fn forward_kept(_: &Square, [x]: [FloatTensor<Self>; 1]) -> (FloatTensor<Self>, Self::Kept) {
        let x = flex::floats(&x).to_vec();
        (flex::tensor(x.iter().map(|x| x * x).collect(), [x.len()]), x)
    }

    fn vjp(_: &Square, x: Self::Kept, v: FloatTensor<Self>) -> [FloatTensor<Self>; 1] {
        let values: Vec<f32> = x.iter().zip(flex::floats(&v)).map(|(x, v)| 2.0 * x * v).collect();
        let n = values.len();
        [flex::tensor(values, [n])]
    }
}

/// The second backend. Burn's decorator stands in for it, since a backend has hundreds of operations.
type Second = Autodiff<Flex>;

static FORWARD_CALLS: AtomicUsize = AtomicUsize::new(0);
static BACKWARD_CALLS: AtomicUsize = AtomicUsize::new(0);

impl Kernel<Square, 1> for Second {
    type Kept = FloatTensor<Second>;

    fn forward_kept(call: &Square, [x]: [FloatTensor<Self>; 1]) -> (FloatTensor<Self>, Self::Kept) {
        FORWARD_CALLS.fetch_add(1, Ordering::Relaxed);
        let y = <Flex as Kernel<Square, 1>>::forward(call, [Second::inner(x.clone())]);
        (Second::from_inner(y), x)
    }

    fn vjp(call: &Square, x: Self::Kept, v: FloatTensor<Self>) -> [FloatTensor<Self>; 1] {
        BACKWARD_CALLS.fetch_add(1, Ordering::Relaxed);
        let kept = flex::floats(&Second::inner(x)).to_vec();
        <Flex as Kernel<Square, 1>>::vjp(call, kept, Second::inner(v)).map(Second::from_inner)
    }
}

/// Value and gradient of `Σ x²` on a backend.
fn value_and_gradient<B: Kernel<Square, 1> + Readable>(x: &[f32]) -> (Vec<f32>, Vec<f32>) {
    let device = Default::default();
    let data = TensorData::new(x.to_vec(), Shape::new([x.len()]));
    let x = Autodiff::<B>::float_from_data(data, &device);
    let x = Autodiff::<B>::float_set_require_grad(x, true);
    let y = fused::<B, NoCheckpointing, _, 1>(Square, [x.clone()]);
    let gradients = Autodiff::<B>::backward(Autodiff::<B>::float_sum(y.clone()));
    let gradient = Autodiff::<B>::grad(&x, &gradients).expect("a gradient of the input");
    (B::values(Autodiff::<B>::inner(y)), B::values(gradient))
}

/// A backend whose tensors a test can read.
trait Readable: Backend {
    fn values(tensor: FloatTensor<Self>) -> Vec<f32>;
}

impl Readable for Flex {
    fn values(tensor: FloatTensor<Self>) -> Vec<f32> {
        flex::floats(&tensor).to_vec()
    }
}

impl Readable for Second {
    fn values(tensor: FloatTensor<Self>) -> Vec<f32> {
        Flex::values(Second::inner(tensor))
    }
}

#[test]
fn one_node_runs_the_kernels_of_every_backend() {
    let x = [1.0, -2.0, 0.5];
    let expected = (vec![1.0, 4.0, 0.25], vec![2.0, -4.0, 1.0]);
    assert_eq!(value_and_gradient::<Flex>(&x), expected);
    assert_eq!(value_and_gradient::<Second>(&x), expected);
    let calls = [&FORWARD_CALLS, &BACKWARD_CALLS].map(|count| count.load(Ordering::Relaxed));
    assert_eq!(calls, [1, 1], "the second backend's own kernels ran");
}

/// Sources that may name a backend: kernels with their tests, and the one place that turns a name into a
/// device.
const MAY_NAME: [&str; 10] = [
    "lgs-bench/benches",
    "lgs-dynamics/src/tensor",
    "lgs-dynamics/tests",
    "lgs-model/src/source",
    "lgs-model/tests",
    "lgs-render/src/tensor",
    "lgs-render/tests",
    "lgs-tensor",
    "lgs-train/src/adam/cube.rs",
    "lgs-train/src/device",
];

#[test]
fn only_kernels_and_one_parser_name_a_backend() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the folder of the crates");
    let apps = crates.with_file_name("apps");
    let mut sources = Vec::new();
    [crates, &apps].into_iter().for_each(|folder| rust_files(folder, &mut sources));
    assert!(sources.len() > 300, "{} sources", sources.len());
    let named = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).expect("a source");
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let path = path.to_string_lossy().replace('\\', "/");
        ["Flex", "flex()", "CubeBackend", "wgpu("].iter().any(|name| code.contains(name))
            && !MAY_NAME.iter().any(|part| path.contains(part))
    };
    let offenders: Vec<&PathBuf> = sources.iter().filter(|path| named(path)).collect();
    assert!(offenders.is_empty(), "sources that name a backend: {offenders:?}");
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}
