//! Rasterizer and photometric loss: forward and forward + backward at a small and a middle size.
//! `cargo bench -p lgs-render`

use divan::{Bencher, black_box};
use lgs_core::{Camera, GaussianCloud, stream};
use lgs_render::{Rasterized, Splats, photometric_vjp, rasterize, rasterize_vjp};
use rand::RngExt;

fn main() {
    divan::main();
}

/// Edge of the image in pixels and number of Gaussians.
const CASES: [(u32, usize); 2] = [(160, 3000), (400, 20_000)];

/// A ball of randomly turned Gaussians about as large as their spacing, of which half are nearly opaque.
fn scene((size, count): (u32, usize)) -> (GaussianCloud, Camera) {
    let mut rng = stream(1, "bench", 0);
    let mut uniform = |low: f32, high: f32| rng.random_range(low..high);
    let scale = (1.6 / (count as f32).cbrt()).ln() - 0.7;
    let mut cloud = GaussianCloud { sh_degree: 3, ..GaussianCloud::default() };
    while cloud.len() < count {
        let mean: [f32; 3] = std::array::from_fn(|_| uniform(-1.0, 1.0));
        if mean.iter().map(|c| c * c).sum::<f32>() > 1.0 {
            continue;
        }
        cloud.means.push(mean);
        cloud.rotations.push(std::array::from_fn(|_| uniform(-1.0, 1.0)));
        cloud.log_scales.push(std::array::from_fn(|_| scale + uniform(-0.8, 0.4)));
        cloud.raw_opacities.push(uniform(-3.0, 4.0));
        cloud.sh.extend((0..48).map(|k| uniform(-0.5, 0.5) / (1.0 + (k / 3) as f32)));
    }
    (cloud, Camera::look_at([0.3, -3.2, 1.1], [0.0; 3], 0.7, size, size))
}

fn draw(cloud: &GaussianCloud, camera: &Camera) -> Rasterized {
    rasterize(&Splats::from(cloud), camera, [1.0; 3])
}

#[divan::bench(args = CASES, sample_count = 30)]
fn forward(bencher: Bencher, case: (u32, usize)) {
    let (cloud, camera) = scene(case);
    bencher.bench_local(|| draw(black_box(&cloud), &camera));
}

#[divan::bench(args = CASES, sample_count = 30)]
fn forward_and_backward(bencher: Bencher, case: (u32, usize)) {
    let (cloud, camera) = scene(case);
    let (v_image, v_transmittance) = (vec![[0.3, -0.2, 0.1]; camera.pixels()], vec![0.1; camera.pixels()]);
    bencher.bench_local(|| {
        let drawn = draw(black_box(&cloud), &camera);
        rasterize_vjp(&Splats::from(&cloud), &camera, [1.0; 3], &drawn, &v_image, &v_transmittance)
    });
}

#[divan::bench(args = [160_usize, 400, 800], sample_count = 30)]
fn photometric_forward_and_backward(bencher: Bencher, size: usize) {
    let image = |phase: usize| (0..size * size).map(|i| [0, 1, 2].map(|c| ((i * 31 + c + phase) % 97) as f32 / 97.0)).collect::<Vec<_>>();
    let (a, b) = (image(0), image(5));
    bencher.bench_local(|| photometric_vjp(black_box(&a), &b, size, size, 0.2));
}
