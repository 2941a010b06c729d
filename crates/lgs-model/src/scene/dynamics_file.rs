//! The dynamics of one object in a scene's file, under the object's prefix.

use lgs_dynamics::{Supports, System, SystemConfig};
use lgs_mechanics::Law;
use lgs_mechanics::coordinates::State;

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
        Dynamics::Generalised(GeneralisedDynamics { law, start, known }) => {
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
    if law.coordinates.bodies() != 1 {
        return Err(file.field(&name, "coordinates of one body", law.coordinates.name().to_owned()));
    }
    let name = format!("{prefix}.start");
    let start: State = file.metadata_json(&name)?;
    let checked = law.coordinates.check_state(&start);
    checked.map_err(|e| file.field(&name, "a state of the law's coordinates", e.to_string()))?;
    let known = file.metadata_json(&format!("{prefix}.known"))?;
    Ok(Dynamics::Generalised(GeneralisedDynamics { law, start, known }))
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

fn read_supports(file: &TensorFile, name: &str, members: usize) -> Result<Option<Supports>, TensorFileError> {
    if !file.names().any(|n| n == name) {
        return Ok(None);
    }
    let (shape, indices) = file.indices(name)?;
    if shape.len() != 2 || shape[0] != members || shape[1] == 0 {
        return Err(file.field(name, &format!("shape [{members}, k]"), format!("{shape:?}")));
    }
    let supports = Supports::from_rows(indices.to_vec(), shape[1]);
    supports.map(Some).map_err(|e| file.field(name, &format!("indices below {members}"), e.to_string()))
}

pub(super) fn json<T: serde::Serialize>(value: &T) -> String {
    // These are plain structs of numbers, strings and enums: serialisation cannot fail.
    serde_json::to_string(value).unwrap_or_default()
}
