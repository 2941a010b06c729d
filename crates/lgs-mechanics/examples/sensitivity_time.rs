//! Time of one trajectory with all sensitivities, as a fit asks for it.
//!
//! `cargo run --release --example sensitivity_time -p lgs-mechanics`

use lgs_mechanics::coordinates::{Coordinates, Port, State};
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Edit, Law, MechanicsError, System};
use std::time::Instant;

fn main() -> Result<(), MechanicsError> {
    let times: Vec<f64> = (0..61).map(|i| 0.0125 * f64::from(i)).collect();
    let start = State { x: vec![0.5, -0.2, 0.3], v: vec![1.0, 0.4, -0.7] };
    for (name, values) in [
        ("uniform-field", &[0.0, 0.1, -9.0][..]),
        ("spring-full", &[9.0, 0.5, -0.3, 7.0, 0.2, 11.0, 0.1, 0.2, -0.1]),
        ("linear-drag", &[0.3]),
        ("central-power", &[1.0, -2.0, 0.0, 0.0, 0.0]),
        ("quartic-axis", &[6.0, -14.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0]),
        ("polynomial-four", &[0.1; 34]),
    ] {
        let law =
            Law::new(Coordinates::Point, vec![Term::named(name, Port::Whole)?], values.to_vec(), 0.0125)?;
        let begun = Instant::now();
        for _ in 0..100 {
            System::new(&law, Edit::NONE).sensitivities(&start, &times)?;
        }
        println!("{name}: {:.3} ms with {} columns", begun.elapsed().as_secs_f64() * 10.0, 6 + values.len());
    }
    Ok(())
}
