//! Features and their distance.
//!
//! One image after another passes a layer, so memory is that of one layer's features per image. Convolutions
//! are Burn's on the CPU, whose tiles have a fixed size; distances are summed in order: the same bits for any
//! number of threads.

use burn::tensor::activation::relu;
use burn::tensor::module::{conv2d, max_pool2d};
use burn::tensor::ops::{ConvOptions, MaxPoolOptions};
use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::Image;
use lgs_model::TensorFileError;

use super::input_range::InputRange;
use super::store::Weights;
use super::trunk::{Convolution, POOL_STRIDE, Step, Trunk};

/// Mean of photographs' channels in [−1, 1], as LPIPS has it.
const SHIFT: [f32; 3] = [-0.030, -0.088, -0.188];
/// Deviation of photographs' channels in [−1, 1], as LPIPS has it.
const SCALE: [f32; 3] = [0.458, 0.448, 0.450];

/// Added to the length of a feature vector before dividing by it, as LPIPS has it.
const LENGTH_FLOOR: f32 = 1e-10;

/// An LPIPS network.
#[derive(Clone, Debug)]
pub struct Lpips {
    trunk: Trunk,
    /// Weight and bias of every convolution, in order.
    convolutions: Vec<(Convolution, Tensor<4>, Tensor<1>)>,
    /// Weight of every channel, by comparison.
    linear: Vec<Vec<f32>>,
}

impl Lpips {
    /// The network of a trunk's two files, on a device.
    ///
    /// # Errors
    /// If a tensor is absent or of another shape.
    pub fn new(
        trunk: Trunk,
        convolutions: &Weights,
        linear: &Weights,
        device: &Device,
    ) -> Result<Self, TensorFileError> {
        let tensor = |name: String, shape: &[usize]| {
            let values = convolutions.values(&name, shape)?.to_vec();
            Ok::<_, TensorFileError>(TensorData::new(values, shape.to_vec()))
        };
        let load = |c: Convolution| {
            let weight =
                tensor(format!("features.{}.weight", c.index), &[c.outputs, c.inputs, c.kernel, c.kernel])?;
            let bias = tensor(format!("features.{}.bias", c.index), &[c.outputs])?;
            Ok((c, Tensor::from_data(weight, device), Tensor::from_data(bias, device)))
        };
        let channels = trunk.compared_channels().into_iter().enumerate();
        let weight = |(i, n): (usize, usize)| {
            linear.values(&format!("lin{i}.model.1.weight"), &[1, n, 1, 1]).map(<[f32]>::to_vec)
        };
        Ok(Self {
            trunk,
            convolutions: trunk.convolutions().map(load).collect::<Result<_, TensorFileError>>()?,
            linear: channels.map(weight).collect::<Result<_, TensorFileError>>()?,
        })
    }

    /// LPIPS of every prediction against the truth; nothing if the images are too small for the network.
    ///
    /// # Panics
    /// If the images differ in size.
    #[must_use]
    pub fn distances(&self, predictions: &[&Image], truth: &Image, range: InputRange) -> Option<Vec<f64>> {
        assert!(
            predictions.iter().all(|p| (p.width, p.height) == (truth.width, truth.height)),
            "image sizes"
        );
        if !self.trunk.accepts(truth.width, truth.height) {
            return None;
        }
        let images = std::iter::once(truth).chain(predictions.iter().copied());
        let device = self.convolutions.first()?.1.device();
        let mut features: Vec<Tensor<4>> = images.map(|image| input(image, range, &device)).collect();
        let mut sums = vec![0.0; predictions.len()];
        let (mut convolutions, mut linear) = (self.convolutions.iter(), self.linear.iter());
        for step in &self.trunk.steps() {
            match step {
                Step::Convolve(_) => {
                    let layer = convolutions.next()?;
                    features = features.into_iter().map(|x| convolved(x, layer)).collect();
                }
                Step::Pool { kernel } => {
                    features = features.into_iter().map(|x| pooled(x, *kernel)).collect()
                }
                Step::Compare => {
                    let weights = linear.next()?;
                    let truth = unit_vectors(&features[0]);
                    let distance = |x: &Tensor<4>| weighted_distance(&unit_vectors(x), &truth, weights);
                    sums.iter_mut().zip(&features[1..]).for_each(|(sum, x)| *sum += distance(x));
                }
            }
        }
        Some(sums)
    }
}

/// An image as the network's first layer takes it, `[1, 3, h, w]`.
fn input(image: &Image, range: InputRange, device: &Device) -> Tensor<4> {
    let channel = |c: usize| {
        image.pixels.iter().map(move |p| {
            let value = match range {
                InputRange::Symmetric => 2.0 * p[c] - 1.0,
                InputRange::Unnormalised => p[c],
            };
            (value - SHIFT[c]) / SCALE[c]
        })
    };
    let values: Vec<f32> = (0..3).flat_map(channel).collect();
    let shape = [1, 3, image.height as usize, image.width as usize];
    Tensor::from_data(TensorData::new(values, shape), device)
}

fn convolved(x: Tensor<4>, (c, weight, bias): &(Convolution, Tensor<4>, Tensor<1>)) -> Tensor<4> {
    let options = ConvOptions::new([c.stride; 2], [c.padding; 2], [1; 2], 1);
    relu(conv2d(x, weight.clone(), Some(bias.clone()), options))
}

fn pooled(x: Tensor<4>, kernel: usize) -> Tensor<4> {
    max_pool2d(x, MaxPoolOptions { stride: [POOL_STRIDE; 2], ..MaxPoolOptions::new([kernel; 2]) })
}

/// Features `[channels][pixels]`, every pixel's vector divided by its length.
fn unit_vectors(features: &Tensor<4>) -> Vec<Vec<f32>> {
    let [_, _, height, width] = features.dims();
    // A float tensor on the CPU always converts.
    let mut values = features.to_data().try_to_vec::<f32>().unwrap_or_default();
    let mut lengths = vec![0.0_f32; height * width];
    for plane in values.chunks_exact(height * width) {
        lengths.iter_mut().zip(plane).for_each(|(sum, v)| *sum += v * v);
    }
    lengths.iter_mut().for_each(|sum| *sum = sum.sqrt() + LENGTH_FLOOR);
    for plane in values.chunks_exact_mut(height * width) {
        plane.iter_mut().zip(&lengths).for_each(|(v, length)| *v /= length);
    }
    values.chunks_exact(height * width).map(<[f32]>::to_vec).collect()
}

/// Mean over pixels of the weighted squared difference.
fn weighted_distance(a: &[Vec<f32>], b: &[Vec<f32>], weights: &[f32]) -> f64 {
    let mut sum = 0.0;
    for ((a, b), &weight) in a.iter().zip(b).zip(weights) {
        let squared: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        sum += f64::from(weight) * squared / a.len() as f64;
    }
    sum
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::store::WeightKind;
    use super::*;
    use lgs_core::testing::{pseudo_random, pseudo_random_within};

    /// The tensors of a trunk's files: weights in ±√(6 / fan-in), biases in ±0.1, linear weights in [0, 1).
    pub(in super::super) fn tensors(kind: WeightKind) -> Vec<(String, Vec<usize>, Vec<f32>)> {
        let mut tensors = Vec::new();
        for (name, shape) in kind.tensors() {
            let count = shape.iter().product();
            let index = |prefix: &str| {
                name.split('.').find_map(|part| part.strip_prefix(prefix)?.parse::<u32>().ok()).unwrap_or(0)
            };
            let values = if kind.is_linear() {
                pseudo_random(count, 100 + index("lin")).map(|v| v as f32).collect()
            } else if name.ends_with("weight") {
                pseudo_random_within(
                    (6.0 / shape[1..].iter().product::<usize>() as f64).sqrt(),
                    count,
                    2 * index("") + 1,
                )
            } else {
                pseudo_random_within(0.1, count, 2 * index("") + 2)
            };
            tensors.push((name, shape, values));
        }
        tensors
    }

    fn network(trunk: Trunk) -> Lpips {
        let [convolutions, linear] = trunk.files().map(|kind| Weights::of(kind, &tensors(kind)));
        Lpips::new(trunk, &convolutions, &linear, &Device::flex()).expect("network")
    }

    /// Two images that differ, rounded to 8 bits.
    fn images(width: u32, height: u32) -> [Image; 2] {
        let n = (width * height) as usize;
        let planes = |seed| {
            pseudo_random_within(1.0, 3 * n, seed)
                .into_iter()
                .map(|v| f64::from(v) * 0.5 + 0.5)
                .collect::<Vec<f64>>()
        };
        let (a, b) = (planes(201), planes(202));
        let image = |share: f64| {
            let value = |i: usize| (((1.0 - share) * a[i] + share * b[i]) * 255.0 + 0.5).floor() / 255.0;
            let pixels = (0..n).map(|p| std::array::from_fn(|c| value(c * n + p) as f32)).collect();
            Image { width, height, pixels }
        };
        [image(0.0), image(0.3)]
    }

    fn assert_distance(trunk: Trunk, size: [u32; 2], range: InputRange, expected: f64) {
        let [a, b] = images(size[0], size[1]);
        let found = network(trunk).distances(&[&b, &a], &a, range).expect("large enough");
        assert!(
            (found[0] / expected - 1.0).abs() < 1e-5,
            "{trunk:?} {range:?}: {found:?}, expected {expected}"
        );
        assert_eq!(found[1], 0.0, "an image has no distance to itself");
    }

    // Expected values: an implementation in numpy, float64 throughout, that shares nothing with this one but
    // the numbers of `pseudo_random`; weights and images are rounded to f32 as here. Sizes are odd so that
    // pooling drops a row.

    #[test]
    fn vgg_agrees_with_an_independent_implementation() {
        assert_distance(Trunk::Vgg, [32, 37], InputRange::Symmetric, 0.131_618_634_221_041_17);
        assert_distance(Trunk::Vgg, [32, 37], InputRange::Unnormalised, 0.033_339_867_851_098_895);
    }

    #[test]
    fn alexnet_agrees_with_an_independent_implementation() {
        assert_distance(Trunk::Alex, [64, 70], InputRange::Symmetric, 0.143_990_127_324_288_42);
        assert_distance(Trunk::Alex, [64, 70], InputRange::Unnormalised, 0.063_217_458_904_704_58);
    }

    #[test]
    fn distances_are_the_same_bits_for_any_number_of_threads_and_absent_for_tiny_images() {
        let network = network(Trunk::Alex);
        let [a, b] = images(90, 70);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
            pool.install(|| network.distances(&[&b], &a, InputRange::Symmetric)).expect("large enough")[0]
                .to_bits()
        };
        assert_eq!(run(1), run(3));
        let [a, b] = images(30, 70);
        assert!(network.distances(&[&b], &a, InputRange::Symmetric).is_none());
    }
}
