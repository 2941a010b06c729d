//! The dynamics of one object in a scene's file, under the object's prefix.

use std::sync::Arc;

use lgs_dynamics::{Supports, System, SystemConfig};
use lgs_mechanics::Law;
use lgs_mechanics::bands::Known;
use lgs_mechanics::coordinates::{Bodies, State};

use super::dynamics::{Dynamics, GeneralisedDynamics, ParticleDynamics};
use crate::tensor_file::{TensorFile, TensorFileError};

/// Largest network accepted from a file: far above any use, far below what would exhaust memory.
const MAX_HIDDEN: usize = 4096;
/// Most hidden layers accepted from a file.
const MAX_HIDDEN_LAYERS: usize = 16;

/// Adds the dynamics of an object of `members` particles.
pub(super) fn insert_dynamics(file: &mut TensorFile, prefix: &str, dynamics: &Dynamics, members: usize) {
    match dynamics {
        Dynamics::Particles(particles) => insert_particles(file, prefix, particles, members),
        Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known }) => {
            if bodies.count() > 1 {
                file.set_metadata(&format!("{prefix}.bodies"), json(bodies));
            }
            file.set_metadata(&format!("{prefix}.known"), json(known));
            file.set_metadata(&format!("{prefix}.law"), json(law));
            file.set_metadata(&format!("{prefix}.start"), json(start));
        }
    }
}

fn insert_particles(file: &mut TensorFile, prefix: &str, particles: &ParticleDynamics, members: usize) {
    let ParticleDynamics { system, supports, velocity_policy } = particles;
    file.set_metadata(&format!("{prefix}.system"), json(&system.config));
    file.set_metadata(&format!("{prefix}.velocity_policy"), json(velocity_policy));
    for entry in system.layout() {
        file.insert(format!("{prefix}.{}", entry.name), &entry.shape, &system.params[entry.range.clone()]);
    }
    if let Some(supports) = supports {
        file.insert_indices(format!("{prefix}.supports"), &[members, supports.k()], supports.indices());
    }
}

/// Reads what [`insert_dynamics`] wrote.
pub(super) fn read_dynamics(
    file: &TensorFile,
    prefix: &str,
    members: usize,
) -> Result<Dynamics, TensorFileError> {
    let name = format!("{prefix}.law");
    if file.metadata(&name).is_err() {
        return read_particles(file, prefix, members).map(Dynamics::Particles);
    }
    let law: Law = file.metadata_json(&name)?;
    let bodies = read_bodies(file, prefix, &law, members)?;
    let name = format!("{prefix}.start");
    let start: State = file.metadata_json(&name)?;
    let checked = law.coordinates.check_state(&start);
    checked.map_err(|e| file.field(&name, "a state of the law's coordinates", e.to_string()))?;
    let known = read_known(file, &format!("{prefix}.known"), &law)?;
    Ok(Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known }))
}

fn read_known(file: &TensorFile, name: &str, law: &Law) -> Result<Known, TensorFileError> {
    let known: Known = file.metadata_json(name)?;
    let checked = known.posterior.iter().try_for_each(|laws| laws.check(law.coordinates.bodies()));
    checked.map_err(|e| file.field(name, "drawn laws that move the law's bodies", e.to_string()))?;
    Ok(known)
}

/// Which particles belong to which body of a law's coordinates; files tell it where there are several.
fn read_bodies(
    file: &TensorFile,
    prefix: &str,
    law: &Law,
    members: usize,
) -> Result<Bodies, TensorFileError> {
    let expected = law.coordinates.bodies();
    if expected == 1 {
        return Ok(Bodies::default());
    }
    let name = format!("{prefix}.bodies");
    let bodies: Bodies = file.metadata_json(&name)?;
    if bodies.count() != expected || !bodies.fit(members) {
        let expected = format!(
            "the first rows of {} later ranges, ascending within {members}, and each range of one body",
            expected - 1
        );
        return Err(file.field(&name, &expected, json(&bodies)));
    }
    Ok(bodies)
}

fn read_particles(
    file: &TensorFile,
    prefix: &str,
    members: usize,
) -> Result<ParticleDynamics, TensorFileError> {
    let config: SystemConfig = file.metadata_json(&format!("{prefix}.system"))?;
    if !(1..=MAX_HIDDEN).contains(&config.hidden) || !(1..=MAX_HIDDEN_LAYERS).contains(&config.hidden_layers)
    {
        return Err(file.field(&format!("{prefix}.system"), "sane network sizes", format!("{config:?}")));
    }
    let mut system = System { config, params: vec![0.0; config.parameters()] };
    for entry in system.layout() {
        let name = format!("{prefix}.{}", entry.name);
        let (shape, values) = file.values(&name)?;
        if shape != entry.shape {
            return Err(file.field(&name, &format!("shape {:?}", entry.shape), format!("{shape:?}")));
        }
        system.params[entry.range].copy_from_slice(values);
    }
    let supports = read_supports(file, &format!("{prefix}.supports"), members)?;
    let velocity_policy = file.metadata_json(&format!("{prefix}.velocity_policy"))?;
    Ok(ParticleDynamics { system, supports, velocity_policy })
}

fn read_supports(
    file: &TensorFile,
    name: &str,
    members: usize,
) -> Result<Option<Arc<Supports>>, TensorFileError> {
    if !file.names().any(|n| n == name) {
        return Ok(None);
    }
    let (shape, indices) = file.indices(name)?;
    if shape.len() != 2 || shape[0] != members || shape[1] == 0 {
        return Err(file.field(name, &format!("shape [{members}, k]"), format!("{shape:?}")));
    }
    let supports = Supports::from_rows(indices.to_vec(), shape[1]);
    supports
        .map(|supports| Some(Arc::new(supports)))
        .map_err(|e| file.field(name, &format!("indices below {members}"), e.to_string()))
}

pub(super) fn json<T: serde::Serialize>(value: &T) -> String {
    // These are plain structs of numbers, strings and enums: serialisation cannot fail.
    serde_json::to_string(value).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_mechanics::bands::Known;
    use lgs_mechanics::coordinates::{Coordinates, Port};
    use lgs_mechanics::terms::Term;

    fn on_a_spring(bodies: Bodies) -> Dynamics {
        let terms = vec![Term::named("spring-length", Port::Between).expect("a term")];
        let parameters = vec![1.5, 0.0, 0.0, 0.0, 20.0, 0.5];
        let law = Law::new(Coordinates::Pair, terms, parameters, 0.01).expect("a law");
        let start = State { x: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0], v: vec![0.0; 6] };
        Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known: Known::default() })
    }

    #[test]
    fn a_law_of_two_bodies_keeps_which_particle_belongs_to_which() {
        let places = [[0.0, 1.0, 0.0], [0.0, 0.0, 2.0]];
        for order in [[0, 1], [1, 0]] {
            let mut file = TensorFile::new("test");
            let bodies = Bodies::of_sizes(&[3, 2]).taken_in_order(&order);
            insert_dynamics(&mut file, "object.0", &on_a_spring(bodies), 5);
            let read = read_dynamics(&file, "object.0", 5).expect("dynamics");
            let Dynamics::Generalised(read) = read else { panic!("{read:?}") };
            let points = [[0.0; 3]; 5];
            let mut state = read.start.clone();
            state.x = vec![0.0, 1.0, 0.0, 1.0, 0.0, 2.0];
            let moved = read.placed(&points, &state).q;
            assert!(moved[..3].iter().all(|q| *q == places[order[0]]), "{moved:?}");
            assert!(moved[3..].iter().all(|q| *q == places[order[1]]), "{moved:?}");
        }
    }

    #[test]
    fn bodies_without_particles_are_refused() {
        let of_sizes = [(&[3, 2][..], 3), (&[0, 5], 5), (&[5], 5), (&[2, 2, 1], 5)];
        let of_sizes = of_sizes.map(|(sizes, members)| (Bodies::of_sizes(sizes), members));
        let taken_twice = (Bodies::of_sizes(&[3, 2]).taken_in_order(&[1, 1]), 5);
        for (bodies, members) in of_sizes.into_iter().chain([taken_twice]) {
            let mut file = TensorFile::new("test");
            insert_dynamics(&mut file, "object.0", &on_a_spring(bodies), members);
            let error = read_dynamics(&file, "object.0", members).expect_err("no body is empty").to_string();
            assert!(error.contains("object.0.bodies"), "{error}");
        }
    }
}
