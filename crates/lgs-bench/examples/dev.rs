#[path = "../benches/speed/particles.rs"]
#[allow(dead_code)]
mod particles;
use lgs_dynamics::*;
use particles::*;
use std::time::Instant;
fn best<T>(n: usize, mut f: impl FnMut() -> T) -> f64 {
    (0..n)
        .map(|_| {
            let t = Instant::now();
            std::hint::black_box(f());
            t.elapsed().as_secs_f64()
        })
        .fold(f64::MAX, f64::min)
}
fn main() {
    let mode = std::env::args().nth(1).unwrap_or_default();
    let n: usize = 1024;
    let steps = 75;
    let system = system();
    let start = State::at_start(points(n, 1.0, 1), points(n, 1.0, 2));
    let spec = RolloutSpec::new(0.01, steps);
    let work = operations(&system.config) * (n * steps) as f64;
    let reps = if mode == "prof" { 40 } else { 15 };
    let mut s = [0.0; 2];
    if mode != "b" {
        s[0] = best(reps, || rollout(&system, &start, &spec));
        println!("forward  {:.1} GF/s", work / s[0] * 1e-9);
    }
    let tr = rollout(&system, &start, &spec);
    let cot = cotangents(n, steps + 1);
    s[1] = best(reps, || rollout_vjp(&system, &spec, &tr, &cot));
    println!("backward {:.1} GF/s executed (x3)", 3.0 * work / s[1] * 1e-9);
    println!("f+b      {:.1} GF/s counted", 3.0 * work / (s[0] + s[1]) * 1e-9);
}
