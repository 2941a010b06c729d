//! Results depend neither on the number of threads nor on arrays of an earlier call.

#[path = "common/random_scene.rs"]
mod random_scene;

use lgs_render::{ImageCotangents, PhotometricVjp, Rasterized, RasterizedVjp, Splats, photometric_vjp};
use random_scene::{BACKGROUND, camera, cotangents, draw, gradients, random_cloud};

#[test]
fn one_thread_and_many_give_the_same_bits() {
    let (cloud, camera) = (random_cloud(900, 5), camera(150, 90));
    let target = vec![[0.4, 0.3, 0.6]; camera.pixels()];
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let drawn = draw(&cloud, &camera);
            let v = gradients(&cloud, &camera, &drawn);
            let loss = photometric_vjp(&drawn.image, &target, [150, 90], 0.2);
            (drawn.image, drawn.transmittance, drawn.radii, v, loss)
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

#[test]
fn arrays_of_an_earlier_call_do_not_change_a_result() {
    let (mut drawn, mut pulled, mut loss) =
        (Rasterized::default(), RasterizedVjp::default(), PhotometricVjp::default());
    for (count, width, height) in [(900, 150, 90), (30, 40, 170), (400, 97, 33)] {
        let (cloud, camera) = (random_cloud(count, 6), camera(width, height));
        let (v_image, v_transmittance) = cotangents(&camera);
        let anew = draw(&cloud, &camera);
        drawn.update(&Splats::from(&cloud), &camera, BACKGROUND);
        let v = ImageCotangents { image: &v_image, transmittance: &v_transmittance };
        pulled.update(&Splats::from(&cloud), &camera, &drawn, v);
        assert!(drawn.image == anew.image && drawn.transmittance == anew.transmittance);
        assert!(drawn.radii == anew.radii && drawn.means2d == anew.means2d);
        assert!(pulled.gradients == gradients(&cloud, &camera, &anew));

        let target = vec![[0.4, 0.3, 0.6]; camera.pixels()];
        let size = [width as usize, height as usize];
        let value = loss.update(&drawn.image, &target, size, 0.2);
        assert!((value, loss.gradient.clone()) == photometric_vjp(&anew.image, &target, size, 0.2));
    }
}

#[test]
fn the_photometric_loss_and_its_gradient_have_the_same_bits_with_any_number_of_threads() {
    let (width, height) = (37, 331);
    let image = |phase: usize| -> Vec<[f32; 3]> {
        (0..width * height)
            .map(|i| [0, 1, 2].map(|c| ((i * 31 + i / width + 7 * c + phase * i) % 97) as f32 / 97.0))
            .collect()
    };
    let (rendered, target) = (image(0), image(5));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let (loss, gradient) = pool.install(|| photometric_vjp(&rendered, &target, [width, height], 0.2));
        (loss.to_bits(), gradient.as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>())
    };
    let one = run(1);
    for threads in [2, 3, 5, 16] {
        assert_eq!(run(threads), one, "{threads} threads");
    }
}
