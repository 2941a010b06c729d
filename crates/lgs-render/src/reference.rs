//! The rasterizer, SSIM and the photometric loss in plain tensor operations: slow, dense, obvious. Tests hold
//! the fast kernels against it, and automatic differentiation gives its gradients.
//!
//! Every Gaussian is evaluated at every pixel (`[n, pixels]` tensors). What is decided without a gradient —
//! culling, depth order, which pairs reach 1/255, where blending stops — is a mask of constants, as in the
//! fast kernel.

mod loss;
mod pose;

pub use loss::{photometric_loss, ssim};

use crate::projected::{ALPHA_MAX, ALPHA_MIN, LEAST_ENERGY, TRANSMITTANCE_STOP};
use crate::sh::{C1, C2, C3};
use crate::tensor::{SplatTensors, ViewSpec};
use crate::view::blur_of;
use burn::tensor::{Device, Int, Tensor, TensorData, activation};
use lgs_core::{Camera, PixelFilter, SH_C0};
use pose::Pose;

/// Image `[H, W, 3]` and transmittance `[H, W]`; the inputs and semantics of [`crate::tensor::rasterize`].
///
/// # Panics
/// If no Gaussian is in front of the camera: tensors without rows are left to the fast kernel.
#[must_use]
pub fn rasterize(splats: &SplatTensors, view: ViewSpec) -> (Tensor<3>, Tensor<2>) {
    let ViewSpec { background, active_degree, .. } = view;
    let camera = view.camera.seeing_moved(motion_of(splats));
    let device = splats.means.device();
    let (height, width) = (camera.height as usize, camera.width as usize);
    let order = front_to_back(&splats.means, &camera);
    assert!(!order.is_empty(), "no Gaussian in front of the camera");
    let order = Tensor::<1, Int>::from_data(TensorData::new(order.clone(), [order.len()]), &device);
    let image_plane = project(splats, &camera, &order, active_degree);

    let alpha = image_plane.alpha(width, height);
    let transmittance_after = cumulative_product(&alpha.clone().neg().add_scalar(1.0));
    let kept = transmittance_after.clone().detach().greater_equal_elem(TRANSMITTANCE_STOP).float();
    // What comes after the stop has a smaller product still, so one mask removes both.
    let alpha = alpha * kept;
    let after = cumulative_product(&alpha.clone().neg().add_scalar(1.0));
    let n = after.dims()[0];
    let pixels = width * height;
    let before =
        Tensor::cat(vec![Tensor::ones([1, pixels], &device), after.clone().slice([0..n - 1, 0..pixels])], 0);
    let weight = alpha * before;
    let last = after.slice([n - 1..n, 0..pixels]);
    let background = row([background], &device);
    let image = weight.transpose().matmul(image_plane.color) + last.clone().transpose().matmul(background);
    (image.reshape([height, width, 3]), last.reshape([height, width]))
}

/// The motion under which Gaussians are seen.
fn motion_of(splats: &SplatTensors) -> [f32; 6] {
    let motion = splats.pose.clone().into_data().try_to_vec::<f32>().expect("f32 numbers");
    motion.try_into().expect("six numbers of a motion")
}

/// Gaussians on the image plane, columns `[n, 1]`.
struct ImagePlane {
    pixel: [Tensor<2>; 2],
    /// `[Σ_xx, Σ_xy, Σ_yy]`.
    covariance: [Tensor<2>; 3],
    opacity: Tensor<2>,
    /// `[n, 3]`
    color: Tensor<2>,
}

impl ImagePlane {
    /// Alpha of every Gaussian at every pixel `[n, pixels]`, zero below 1/255.
    fn alpha(&self, width: usize, height: usize) -> Tensor<2> {
        let device = self.opacity.device();
        let centres = |of: fn(usize, usize) -> usize| -> Tensor<2> {
            let values: Vec<f32> = (0..width * height).map(|i| of(i, width) as f32 + 0.5).collect();
            Tensor::from_data(TensorData::new(values, [1, width * height]), &device)
        };
        let dx = centres(|i, width| i % width) - self.pixel[0].clone();
        let dy = centres(|i, width| i / width) - self.pixel[1].clone();
        let [a, b, c] = self.covariance.clone();
        let determinant = a.clone() * c.clone() - b.clone() * b.clone();
        let quadratic =
            dx.clone() * dx.clone() * c - dx * dy.clone() * b.mul_scalar(2.0) + dy.clone() * dy * a;
        let power = (quadratic / determinant).mul_scalar(-0.5);
        let raw = power.clone().exp() * self.opacity.clone();
        let seen = raw.clone().detach().greater_equal_elem(ALPHA_MIN).float()
            * power.detach().lower_equal_elem(0.0).float();
        raw.clamp_max(ALPHA_MAX) * seen
    }
}

/// Indices in front of the near plane, nearest first, ties by index.
fn front_to_back(means: &Tensor<2>, camera: &Camera) -> Vec<i64> {
    let values = means.clone().into_data().try_to_vec::<f32>().expect("f32 means");
    let depth: Vec<f32> =
        values.as_chunks::<3>().0.iter().map(|&mean| camera.pixel_from_world(mean).1).collect();
    let mut order: Vec<i64> = (0..depth.len() as i64).filter(|&i| depth[i as usize] > camera.near).collect();
    order.sort_by(|&a, &b| depth[a as usize].total_cmp(&depth[b as usize]));
    order
}

fn row<const R: usize, const C: usize>(values: [[f32; C]; R], device: &Device) -> Tensor<2> {
    Tensor::from_data(TensorData::new(values.as_flattened().to_vec(), [R, C]), device)
}

fn columns<const N: usize>(tensor: &Tensor<2>) -> [Tensor<2>; N] {
    let rows = tensor.dims()[0];
    std::array::from_fn(|i| tensor.clone().slice([0..rows, i..i + 1]))
}

fn project(
    splats: &SplatTensors,
    camera: &Camera,
    order: &Tensor<1, Int>,
    active_degree: usize,
) -> ImagePlane {
    let pose = Pose::new(camera, &(splats.pose.clone() - splats.pose.clone().detach()));
    let means = splats.means.clone().select(0, order.clone());
    let world = columns::<3>(&means);
    let camera_means = pose.camera_means(&world);
    let rows = image_axes(splats, (camera, &pose), order, &camera_means);
    let [x, y, z] = camera_means;
    let inner = |a: &[Tensor<2>; 3], b: &[Tensor<2>; 3]| {
        (0..3).map(|j| a[j].clone() * b[j].clone()).reduce(|s, t| s + t).expect("three terms")
    };
    let [probe_x, probe_y] = columns::<2>(&splats.means2d_probe.clone().select(0, order.clone()));
    let n = order.dims()[0];
    let opacity = activation::sigmoid(splats.raw_opacities.clone().select(0, order.clone())).reshape([n, 1]);
    let blur = blur_of(camera.filter);
    let covariance = [
        inner(&rows[0], &rows[0]).add_scalar(blur),
        inner(&rows[0], &rows[1]),
        inner(&rows[1], &rows[1]).add_scalar(blur),
    ];
    let opacity = match camera.filter {
        PixelFilter::Dilation => opacity,
        PixelFilter::Mip => opacity * kept_energy(&rows, &covariance),
    };
    ImagePlane {
        pixel: [
            (x / z.clone()).mul_scalar(camera.fx).add_scalar(camera.cx) + probe_x,
            (y / z).mul_scalar(camera.fy).add_scalar(camera.cy) + probe_y,
        ],
        covariance,
        opacity,
        color: color(&world, &pose, splats.sh.clone().select(0, order.clone()), active_degree),
    }
}

/// The factor of opacities under the Mip filter `[n, 1]`, given `M = J W R S` and the filtered covariances.
fn kept_energy([m0, m1]: &[[Tensor<2>; 3]; 2], [a, b, c]: &[Tensor<2>; 3]) -> Tensor<2> {
    let minor = |i: usize, j: usize| m0[i].clone() * m1[j].clone() - m0[j].clone() * m1[i].clone();
    let area = [minor(1, 2), minor(2, 0), minor(0, 1)].into_iter().map(|m| m.clone() * m);
    let area = area.reduce(|sum, square| sum + square).expect("three minors");
    let determinant = a.clone() * c.clone() - b.clone() * b.clone();
    (area / determinant).clamp_min(LEAST_ENERGY).sqrt()
}

/// The rows of `J W R S`, entries `[n, 1]`, of Gaussians with means in camera axes.
fn image_axes(
    splats: &SplatTensors,
    (camera, pose): (&Camera, &Pose),
    order: &Tensor<1, Int>,
    [x, y, z]: &[Tensor<2>; 3],
) -> [[Tensor<2>; 3]; 2] {
    let rotation = &pose.rotation;
    let scales = columns::<3>(&splats.log_scales.clone().select(0, order.clone()).exp());
    let turned = rotation_columns(&splats.rotations.clone().select(0, order.clone()));
    let limit = [camera.width as f32 / (2.0 * camera.fx), camera.height as f32 / (2.0 * camera.fy)]
        .map(|tangent| 1.3 * tangent);
    std::array::from_fn(|i| {
        let (focal, coordinate) = ([camera.fx, camera.fy][i], [x, y][i]);
        let tangent = (coordinate.clone() / z.clone()).clamp(-limit[i], limit[i]);
        // Row i of J W R S; `world[k]` is component k of row i of J W.
        let world: [Tensor<2>; 3] = std::array::from_fn(|k| {
            ((rotation[i][k].clone() - tangent.clone() * rotation[2][k].clone()) / z.clone())
                .mul_scalar(focal)
        });
        std::array::from_fn(|j| {
            let along = world[0].clone() * turned[0][j].clone()
                + world[1].clone() * turned[1][j].clone()
                + world[2].clone() * turned[2][j].clone();
            along * scales[j].clone()
        })
    })
}

/// Entries of the rotation matrices of raw quaternions, columns `[n, 1]`.
fn rotation_columns(raw: &Tensor<2>) -> [[Tensor<2>; 3]; 3] {
    let norm = (raw.clone() * raw.clone()).sum_dim(1).sqrt();
    let [w, x, y, z] = columns::<4>(&(raw.clone() / norm));
    let twice = |a: &Tensor<2>, b: &Tensor<2>| (a.clone() * b.clone()).mul_scalar(2.0);
    let diagonal = |a: &Tensor<2>, b: &Tensor<2>| (twice(a, a) + twice(b, b)).neg().add_scalar(1.0);
    [
        [diagonal(&y, &z), twice(&x, &y) - twice(&w, &z), twice(&x, &z) + twice(&w, &y)],
        [twice(&x, &y) + twice(&w, &z), diagonal(&x, &z), twice(&y, &z) - twice(&w, &x)],
        [twice(&x, &z) - twice(&w, &y), twice(&y, &z) + twice(&w, &x), diagonal(&x, &y)],
    ]
}

/// Colours `[n, 3]`.
fn color(means: &[Tensor<2>; 3], pose: &Pose, sh: Tensor<3>, degree: usize) -> Tensor<2> {
    let offset = [0, 1, 2].map(|i| means[i].clone() - pose.center[i].clone());
    let offset = Tensor::cat(offset.to_vec(), 1);
    let length = (offset.clone() * offset.clone()).sum_dim(1).sqrt();
    let [x, y, z] = columns::<3>(&(offset / length));
    let [n, _, _] = sh.dims();
    let basis = Tensor::cat(basis_of_tensors(&x, &y, &z, degree), 1);
    let count = basis.dims()[1];
    let terms = basis.reshape([n, count, 1]) * sh.slice([0..n, 0..count, 0..3]);
    terms.sum_dim(1).reshape([n, 3]).add_scalar(0.5).clamp_min(0.0)
}

/// The basis functions up to a degree, columns `[n, 1]`.
fn basis_of_tensors(x: &Tensor<2>, y: &Tensor<2>, z: &Tensor<2>, degree: usize) -> Vec<Tensor<2>> {
    let product = |a: &Tensor<2>, b: &Tensor<2>| a.clone() * b.clone();
    let (xx, yy, zz) = (product(x, x), product(y, y), product(z, z));
    let sum = |a: f32, b: f32, c: f32| {
        xx.clone().mul_scalar(a) + yy.clone().mul_scalar(b) + zz.clone().mul_scalar(c)
    };
    let mut basis = vec![x.clone().mul_scalar(0.0).add_scalar(SH_C0)];
    if degree >= 1 {
        basis.extend([y.clone().mul_scalar(-C1), z.clone().mul_scalar(C1), x.clone().mul_scalar(-C1)]);
    }
    if degree >= 2 {
        let forms = [product(x, y), product(y, z), sum(-1.0, -1.0, 2.0), product(x, z), sum(1.0, -1.0, 0.0)];
        basis.extend(forms.into_iter().zip(C2).map(|(form, c)| form.mul_scalar(c)));
    }
    if degree >= 3 {
        let forms = [
            y.clone() * sum(3.0, -1.0, 0.0),
            product(x, y) * z.clone(),
            y.clone() * sum(-1.0, -1.0, 4.0),
            z.clone() * sum(-3.0, -3.0, 2.0),
            x.clone() * sum(-1.0, -1.0, 4.0),
            z.clone() * sum(1.0, -1.0, 0.0),
            x.clone() * sum(1.0, -3.0, 0.0),
        ];
        basis.extend(forms.into_iter().zip(C3).map(|(form, c)| form.mul_scalar(c)));
    }
    basis
}

/// Running product along the first axis, by products of slices so that it differentiates exactly where
/// factors are small.
fn cumulative_product(factors: &Tensor<2>) -> Tensor<2> {
    let [n, pixels] = factors.dims();
    let mut rows = Vec::with_capacity(n);
    let mut product: Option<Tensor<2>> = None;
    for i in 0..n {
        let factor = factors.clone().slice([i..i + 1, 0..pixels]);
        let next = product.map_or_else(|| factor.clone(), |before| before * factor.clone());
        rows.push(next.clone());
        product = Some(next);
    }
    Tensor::cat(rows, 0)
}
