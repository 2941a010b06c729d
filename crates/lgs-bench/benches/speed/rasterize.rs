//! The rasterizer: a scene as training leaves it, its growth at fixed coverage, and what a second core
//! brings.

use crate::growth::{COUNTS, per_gaussian, print, times};
use crate::second_core::compare;
use crate::trained_scene::{camera, in_no_order, trained_scene};
use lgs_bench::machine::Machine;
use lgs_bench::table::{Row, percent, section};
use lgs_bench::{Beside, REPEATS, Tile, medians_in_turns};
use lgs_core::{Camera, GaussianCloud};
use lgs_render::{
    AffineMotion, ImageCotangents, ImageTangent, Rasterized, RasterizedVjp, SplatGradients, Splats,
    rasterize, rasterize_jvp, rasterize_vjp,
};
use std::sync::Mutex;

const GAUSSIANS: usize = 50_000;
const BACKGROUND: [f32; 3] = [1.0; 3];
/// One of so many Gaussians belongs to a body that moves.
const PART_OF_BODY: usize = 10;

/// A scene, its camera, cotangents of the image, and the arrays of the results, which are kept from call to
/// call.
struct Case {
    cloud: GaussianCloud,
    camera: Camera,
    v_image: Vec<[f32; 3]>,
    v_transmittance: Vec<f32>,
    kept: Mutex<(Rasterized, RasterizedVjp)>,
    /// The same, without the gradient by the camera's pose.
    kept_without_pose: Mutex<(Rasterized, RasterizedVjp)>,
}

impl Case {
    fn new(count: usize, cloud: GaussianCloud) -> Self {
        let camera = camera(count);
        let pixels = camera.pixels();
        let v_image =
            (0..pixels).map(|i| [0, 1, 2].map(|c| ((7 * i + c) % 11) as f32 / 11.0 - 0.4)).collect();
        Self {
            cloud,
            camera,
            v_image,
            v_transmittance: vec![0.1; pixels],
            kept: Mutex::default(),
            kept_without_pose: Mutex::new((Rasterized::default(), RasterizedVjp::without_pose())),
        }
    }

    fn cotangents(&self) -> ImageCotangents<'_> {
        ImageCotangents { image: &self.v_image, transmittance: &self.v_transmittance }
    }

    fn forward(&self) {
        let (drawn, _) = &mut *self.kept.lock().expect("no panic before");
        drawn.update(&Splats::from(&self.cloud), &self.camera, BACKGROUND);
    }

    fn both(&self) {
        self.forward();
        let (drawn, pulled) = &mut *self.kept.lock().expect("no panic before");
        pulled.update(&Splats::from(&self.cloud), &self.camera, drawn, self.cotangents());
    }

    fn both_without_pose(&self) {
        let (drawn, pulled) = &mut *self.kept_without_pose.lock().expect("no panic before");
        drawn.update(&Splats::from(&self.cloud), &self.camera, BACKGROUND);
        pulled.update(&Splats::from(&self.cloud), &self.camera, drawn, self.cotangents());
    }

    /// Forward and backward with results in arrays of their own.
    fn both_anew(&self) -> SplatGradients {
        let splats = Splats::from(&self.cloud);
        let drawn = rasterize(&splats, &self.camera, BACKGROUND);
        rasterize_vjp(&splats, &self.camera, &drawn, self.cotangents())
    }
}

/// What the gradient by the camera's pose costs.
fn print_pose(case: &Case) {
    let [without, with] = medians_in_turns(REPEATS, [&mut || case.both_without_pose(), &mut || case.both()]);
    Row::timed("the same without the gradient by the pose", without)
        .with_ratio(format!("{:.3} × with it", without / with))
        .print();
}

/// What the changes of the image by six motions of a body cost.
fn print_motions(case: &Case) {
    let splats = Splats::from(&case.cloud);
    let drawn = rasterize(&splats, &case.camera, BACKGROUND);
    let still = AffineMotion { center: [0.0; 3], shift: [0.0; 3], linear: [[0.0; 3]; 3] };
    let motions: [AffineMotion; 6] = std::array::from_fn(|i| match i % 3 {
        axis if i < 3 => {
            AffineMotion { shift: std::array::from_fn(|a| f32::from(u8::from(a == axis))), ..still }
        }
        axis => {
            let mut linear = [[0.0; 3]; 3];
            (linear[(axis + 1) % 3][axis], linear[axis][(axis + 1) % 3]) = (1.0, -1.0);
            AffineMotion { linear, ..still }
        }
    });
    let members = 0..GAUSSIANS / PART_OF_BODY;
    let changes =
        || -> Vec<ImageTangent> { rasterize_jvp(&splats, &case.camera, &drawn, (members.clone(), &motions)) };
    let [forward, changes] = medians_in_turns(REPEATS, [&mut || case.forward(), &mut || drop(changes())]);
    Row::timed("changes by six motions of a tenth of them", changes)
        .with_ratio(format!("{:.2} × forward, central differences 12 ×", changes / forward))
        .print();
}

pub(crate) fn run(machine: &Machine) {
    let case = Case::new(GAUSSIANS, trained_scene(GAUSSIANS));
    section(&format!(
        "rasterize ({GAUSSIANS} Gaussians, {0}×{0} pixels, spherical harmonics of degree 3)",
        case.camera.width
    ));
    let drawn = rasterize(&Splats::from(&case.cloud), &case.camera, BACKGROUND);
    let (listed, evaluated) = (drawn.listed_pairs() as f64, drawn.evaluated_pairs() as f64);
    let Beside { secs: forward, rate } = Beside::measure::<Tile, _>(machine.cores, || case.forward());
    let share = |pairs: f64| pairs / forward / rate;
    // The floor of the scene: every pair of the tile lists at the machine's rate.
    Row::timed("rasterize, forward", forward)
        .with_rate(format!("{:.2} G pairs/s", listed / forward * 1e-9))
        .with_ratio(format!("{} of the pair rate", percent(share(listed))))
        .asked("≥ 40 %", share(listed) >= 0.4)
        .print();
    let reached = percent(evaluated / listed);
    Row::figure("the same in the pairs that it evaluates", format!("{reached} of the pairs"))
        .with_ratio(format!("{} of the pair rate", percent(share(evaluated))))
        .print();
    let [forward, both] = medians_in_turns(REPEATS, [&mut || case.forward(), &mut || case.both()]);
    let ratio = both / forward;
    Row::timed("rasterize, forward + backward", both)
        .with_ratio(format!("{ratio:.2} × forward"))
        .asked("≤ 4 ×", ratio <= 4.0)
        .print();
    print_pose(&case);
    print_motions(&case);
    compare("rasterize, forward", 1.6, || case.forward());
    compare("rasterize, forward + backward", 1.6, || case.both());
    print_growth();
}

/// What a Gaussian takes, from few to many.
fn print_growth() {
    section("growth of rasterize (5 k, 50 k, 500 k Gaussians, pixels in proportion)");
    let cases = COUNTS.map(|count| Case::new(count, trained_scene(count)));
    print("rasterize, forward", per_gaussian(cases.each_ref().map(|case| || case.forward())));
    print("rasterize, forward + backward", per_gaussian(cases.each_ref().map(|case| || case.both())));
    let unordered = COUNTS.map(|count| Case::new(count, in_no_order(count)));
    let secs = per_gaussian(unordered.each_ref().map(|case| || case.both()));
    Row::figure("the same, Gaussians in no order", times(secs)).print();
    let anew = per_gaussian(cases.each_ref().map(|case| || drop(case.both_anew())));
    Row::figure("the same, every array allocated anew", times(anew)).print();
}
