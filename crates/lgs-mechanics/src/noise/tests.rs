use super::{SampleTimes, SmoothPath};
use crate::testing::normal;
use lgs_core::stream;

/// Smooth motions with correlated noise of a level and ρ.
fn tracks(level: f64, correlation: f64, seed: u64) -> (Vec<f64>, Vec<Vec<f64>>) {
    let mut stream = stream(seed, "noise tests", 0);
    let mut error = [0.0; 3];
    error.iter_mut().for_each(|e| *e = normal(&mut stream));
    let times: Vec<f64> = (0..61).map(|k| f64::from(k) / 60.0).collect();
    let sample = |t: &f64| {
        let path = [(3.0 * t).sin(), t * t - t, 0.5 * (5.0 * t).cos()];
        let fresh = (1.0 - correlation * correlation).sqrt();
        error.iter_mut().for_each(|e| *e = correlation * *e + fresh * normal(&mut stream));
        path.iter().zip(&error).map(|(x, e)| x + level * e).collect()
    };
    let x = times.iter().map(sample).collect();
    (times, x)
}

#[test]
fn level_and_correlation_are_found_on_average() {
    for correlation in [0.0, 0.75] {
        let estimates: Vec<_> = (0..20)
            .flat_map(|seed| {
                let (times, x) = tracks(0.002, correlation, seed);
                SmoothPath::fit(&times, &x).noise().to_vec()
            })
            .collect();
        let mean =
            |f: &dyn Fn(&super::Noise) -> f64| estimates.iter().map(f).sum::<f64>() / estimates.len() as f64;
        let level = mean(&|n| n.deviation * n.deviation).sqrt();
        assert!((level / 0.002 - 1.0).abs() < 0.25, "{level} at {correlation}");
        let found = mean(&|n| n.correlation);
        assert!((found - correlation).abs() < 0.1, "{found} for {correlation}");
    }
}

#[test]
fn noise_scales_with_the_track() {
    let (times, x) = tracks(0.002, 0.75, 3);
    let moved: Vec<Vec<f64>> = x.iter().map(|x| x.iter().map(|x| 100.0 * x + 50.0).collect()).collect();
    let [near, far] = [x, moved].map(|x| SmoothPath::fit(&times, &x));
    for (near, far) in near.noise().iter().zip(far.noise()) {
        assert!((far.deviation / near.deviation - 100.0).abs() < 1e-6);
        assert!((far.correlation - near.correlation).abs() < 1e-12);
    }
}

#[test]
fn samples_that_are_badly_known_neither_bend_the_path_nor_raise_the_noise() {
    let (times, exact) = tracks(0.0, 0.0, 7);
    let (_, mut x) = tracks(0.002, 0.0, 7);
    let deviations: Vec<f64> = (0..times.len()).map(|k| if k % 5 == 4 { 10.0 } else { 1.0 }).collect();
    for ((x, exact), deviation) in x.iter_mut().zip(&exact).zip(&deviations) {
        x.iter_mut().zip(exact).for_each(|(x, exact)| *x = exact + deviation * (*x - exact));
    }
    let error = |path: &SmoothPath| {
        let miss = |(&time, exact): (&f64, &Vec<f64>)| {
            path.at(time)[0].iter().zip(exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
        };
        (times.iter().zip(&exact).map(miss).sum::<f64>() / times.len() as f64).sqrt()
    };
    let alike = SmoothPath::fit(&times, &x);
    let weighed = SmoothPath::fit(SampleTimes { times: &times, deviations: &deviations }, &x);
    assert!(error(&weighed) < 0.5 * error(&alike), "{} {}", error(&weighed), error(&alike));
    assert!(weighed.noise().iter().all(|noise| (noise.deviation / 0.002 - 1.0).abs() < 0.25));
}
