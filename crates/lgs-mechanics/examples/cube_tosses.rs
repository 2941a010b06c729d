//! Real tosses of a cube, from the first third of each: gravity, centre at the first impact, rest.
//!
//! `cargo run --release -p lgs-mechanics --example cube_tosses -- DIRECTORY`, where the directory holds files
//! `toss_N.poses.safetensors` with `times` [T] in seconds, `center` [T, 3] in metres and `quaternion` [T, 4]
//! in the order w, x, y, z; the table is the plane z = 0.
#![allow(clippy::unwrap_used, reason = "an example")]

use lgs_mechanics::collisions::{Bounced, fit};
use lgs_mechanics::contact::{Contact, Origin, Plane};
use lgs_mechanics::coordinates::{Coordinates, Inertia, InertiaForm, Port, State};
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Candidate, MechanicsError};
use safetensors::SafeTensors;
use std::path::Path;

/// Half width of the cube, metres.
const HALF: f64 = 0.0524;
/// Gravity as the data measures it (their own scale), metres per second².
const GRAVITY: f64 = 9.64;

/// Times and configurations (quaternion, centre).
fn read(path: &Path) -> (Vec<f64>, Vec<Vec<f64>>) {
    let bytes = std::fs::read(path).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let values = |name: &str| -> Vec<f64> {
        let tensor = file.tensor(name).unwrap();
        tensor.data().chunks_exact(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect()
    };
    let (center, quaternion) = (values("center"), values("quaternion"));
    let rows = quaternion.chunks(4).zip(center.chunks(3)).map(|(q, c)| [q, c].concat());
    (values("times"), rows.collect())
}

fn cube() -> (Candidate, Contact) {
    let inertia = Inertia { form: InertiaForm::Prior, ..Inertia::ball(2.0 / 3.0 * HALF * HALF) };
    let gravity = Term::named("uniform-field", Port::Center).unwrap();
    let sign = |bit: usize| if bit == 0 { -HALF } else { HALF };
    let contact = Contact {
        plane: Plane { normal: [0.0, 0.0, 1.0], offset: 0.0 },
        points: (0..8).map(|k| [sign(k & 1), sign(k & 2), sign(k & 4)]).collect(),
        radius: 0.0,
        restitution: 0.0,
        friction: 0.0,
        // The measured centre wanders by about a millimetre at rest.
        resting_speed: Contact::resting_speed(GRAVITY, 0.001),
        walls: Vec::new(),
        deviations: [0.0; 2],
        origin: Origin::Given,
    };
    (Candidate::new(Coordinates::Rigid(inertia), vec![gravity]).unwrap(), contact)
}

fn distance(a: &State, x: &[f64]) -> f64 {
    (4..7).map(|i| (a.x[i] - x[i]).powi(2)).sum::<f64>().sqrt()
}

/// One line of the table. The touch is the error of the centre at the sample nearest to the first
/// impact of the fitted motion; the band at the end also holds the rotation.
fn row(name: &str, times: &[f64], x: &[Vec<f64>]) -> Result<(), MechanicsError> {
    let (candidate, contact) = cube();
    let seen = times.len() / 3;
    let found: Bounced = fit(&candidate, &times[..seen], &x[..seen], &contact)?;
    let gravity = -found.law.parameters[2];
    let until = times[times.len() - 1];
    let states = found.states(times)?;
    let rest = found.states(&[until + 1.0])?.swap_remove(0);
    let later = found.radius(&[until], 0)?[0];
    let touch = found.law.impacts.first().map_or(until, |impact| times[0] + impact.time);
    let nearest = |a: &usize, b: &usize| (times[*a] - touch).abs().total_cmp(&(times[*b] - touch).abs());
    let touch = (0..times.len()).min_by(nearest).unwrap_or(0);
    let contact = found.law.contact.as_ref().unwrap();
    print!("{name:10} {gravity:6.3} ({:+5.1} %)", 100.0 * (gravity / GRAVITY - 1.0));
    print!(" {:5.1} mm  {:+5.2} mm", 1e3 * distance(&states[touch], &x[touch]), 1e3 * (rest.x[6] - HALF));
    let [restitution, friction] = found.deviations;
    print!("  {:.2} ± {restitution:.2}  {:.2} ± {friction:.2}", contact.restitution, contact.friction);
    let last = times.len() - 1;
    let end = 1e3 * distance(&states[last], &x[last]);
    println!("  {:5.1} mm  {end:5.0} of {:4.0} mm", 1e3 * found.error, 1e3 * later);
    Ok(())
}

fn main() {
    let Some(directory) = std::env::args().nth(1) else {
        eprintln!("usage: cube_tosses DIRECTORY");
        return;
    };
    let mut files: Vec<_> =
        std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.to_string_lossy().ends_with(".poses.safetensors"));
    files.sort();
    println!(
        "toss       g, m/s²          touch     rest      restitution  friction    fit       end, of band"
    );
    for path in files {
        let (times, x) = read(&path);
        let name = path.file_name().unwrap().to_string_lossy().replace(".poses.safetensors", "");
        if let Err(error) = row(&name, &times, &x) {
            println!("{name:10} {error}");
        }
    }
}
