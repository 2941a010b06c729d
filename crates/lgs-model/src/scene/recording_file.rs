//! A recording in a scene's file, under the object's prefix.

use super::continuation::PartDynamics;
use super::dynamics::Dynamics;
use super::dynamics_file::{insert_dynamics, json, read_dynamics};
use super::recording::Recording;
use crate::tensor_file::{TensorFile, TensorFileError};

/// Names of the laws of the beginning and the end in a file.
const PARTS: [&str; 2] = ["first", "last"];

/// Adds a recording.
pub(super) fn insert_recording(file: &mut TensorFile, prefix: &str, recording: &Recording) {
    let (samples, n) = (recording.times().len(), recording.start().len());
    let (positions, rotations) = (recording.positions().concat(), recording.rotations().concat());
    file.insert(format!("{prefix}.times"), &[samples, 1], recording.times());
    file.insert(format!("{prefix}.positions"), &[samples * n, 3], positions.as_flattened());
    file.insert(format!("{prefix}.rotations"), &[samples * n, 4], rotations.as_flattened());
    file.set_metadata(&format!("{prefix}.continuation"), json(&recording.continuation()));
    file.set_metadata(&format!("{prefix}.deforms"), json(&recording.deforms()));
    file.set_metadata(&format!("{prefix}.handled"), json(&recording.is_handled()));
    for (part, name) in recording.parts().iter().zip(PARTS) {
        let Some(part) = part else { continue };
        file.set_metadata(&format!("{prefix}.{name}.times"), json(&part.times));
        let dynamics = Dynamics::Generalised(part.dynamics.clone());
        insert_dynamics(file, &format!("{prefix}.{name}"), &dynamics, n);
    }
}

/// Reads what [`insert_recording`] wrote for `n` particles; nothing if there is none.
pub(super) fn read_recording(
    file: &TensorFile,
    prefix: &str,
    n: usize,
) -> Result<Option<Recording>, TensorFileError> {
    let name = format!("{prefix}.times");
    if !file.names().any(|known| known == name) {
        return Ok(None);
    }
    let times: Vec<f32> = file.rows::<1>(&name)?.into_iter().map(|[time]| time).collect();
    let positions = samples(file, &format!("{prefix}.positions"), (times.len(), n))?;
    let rotations = samples(file, &format!("{prefix}.rotations"), (times.len(), n))?;
    let (found, end) = (times.len(), times.last().copied().map_or(0.0, f64::from));
    let continuation = said(file, &format!("{prefix}.continuation"))?;
    let deforms = said(file, &format!("{prefix}.deforms"))?;
    let is_handled = said(file, &format!("{prefix}.handled"))?;
    let [first, last] = PARTS.map(|name| read_part(file, &format!("{prefix}.{name}"), (n, end)));
    let parts = [first?, last?];
    let recording = Recording::new(times, positions, rotations);
    let whole = |recording: Recording| {
        let recording = recording.continued_by(continuation).with_parts(parts);
        Some(recording.of_deforming(deforms).of_handled(is_handled))
    };
    recording
        .map(whole)
        .ok_or_else(|| file.field(&name, "two or more times that ascend from 0", found.to_string()))
}

/// What a file says under a name; the default where it says nothing, as files of earlier versions do.
fn said<T: Default + serde::de::DeserializeOwned>(
    file: &TensorFile,
    name: &str,
) -> Result<T, TensorFileError> {
    if file.metadata(name).is_ok() { file.metadata_json(name) } else { Ok(T::default()) }
}

/// The law of a part of a recording that ends at a time; nothing if there is none.
fn read_part(
    file: &TensorFile,
    prefix: &str,
    (n, end): (usize, f64),
) -> Result<Option<PartDynamics>, TensorFileError> {
    let name = format!("{prefix}.times");
    if file.metadata(&name).is_err() {
        return Ok(None);
    }
    let times: [f64; 2] = file.metadata_json(&name)?;
    // Times of samples are of single precision, and those of a law of double.
    if !(0.0 <= times[0] && times[0] < times[1] && times[1] <= end + f64::from(f32::EPSILON)) {
        let expected = format!("two times of the recording, 0 to {end}, ascending");
        return Err(file.field(&name, &expected, format!("{times:?}")));
    }
    match read_dynamics(file, prefix, n)? {
        Dynamics::Generalised(dynamics) => Ok(Some(PartDynamics { times, dynamics })),
        Dynamics::Particles(_) => {
            Err(file.field(&format!("{prefix}.law"), "a law in generalised coordinates", "none".to_owned()))
        }
    }
}

/// The rows of each sample.
fn samples<const D: usize>(
    file: &TensorFile,
    name: &str,
    (samples, n): (usize, usize),
) -> Result<Vec<Vec<[f32; D]>>, TensorFileError> {
    let rows = file.rows::<D>(name)?;
    if n == 0 || rows.len() != samples * n {
        return Err(file.field(name, &format!("{samples} × {n} rows"), rows.len().to_string()));
    }
    Ok(rows.chunks_exact(n).map(<[[f32; D]]>::to_vec).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_dynamics::Edit;
    use lgs_mechanics::Law;
    use lgs_mechanics::bands::Known;
    use lgs_mechanics::coordinates::{Bodies, Coordinates, Port, State};
    use lgs_mechanics::terms::Term;

    use crate::scene::GeneralisedDynamics;
    use crate::scene::continuation::Continuation;

    /// A particle that is held until t = 0.5 and falls from then on, recorded until t = 1.
    fn let_go() -> Recording {
        let times: Vec<f32> = (0..=20).map(|i| i as f32 / 20.0).collect();
        let at = |time: &f32| vec![[0.0, 0.0, -(time - 0.5).max(0.0).powi(2)]];
        let positions = times.iter().map(at).collect();
        let rotations = vec![vec![[1.0, 0.0, 0.0, 0.0]]; times.len()];
        let field = vec![Term::named("uniform-field", Port::Whole).expect("a term")];
        let law = Law::new(Coordinates::Point, field, vec![0.0, 0.0, -2.0], 0.01).expect("a law");
        let start = State { x: vec![0.0; 3], v: vec![0.0; 3] };
        let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known: Known::default() };
        let recording = Recording::new(times, positions, rotations).expect("a recording");
        let last = Some(PartDynamics { times: [0.5, 1.0], dynamics });
        recording
            .continued_by(Continuation::Rest)
            .with_parts([None, last])
            .of_deforming(true)
            .of_handled(true)
    }

    #[test]
    fn the_law_of_its_end_carries_a_recording_on_and_is_what_an_edit_changes() {
        let (recording, points) = (let_go(), [[0.0; 3]]);
        let height =
            |states: Vec<lgs_dynamics::State>| -> Vec<f32> { states.iter().map(|s| s.q[0][2]).collect() };
        let later = height(recording.carried_on(&points, &[1.5, 2.0]).expect("carried on"));
        assert!((later[0] + 1.0).abs() < 1e-3 && (later[1] + 2.25).abs() < 1e-3, "{later:?}");
        let earlier = height(recording.carried_on(&points, &[-0.5]).expect("carried on"));
        assert_eq!(earlier, [0.0], "no law of the beginning: at rest");
        let half = Edit { potential_scale: 0.5, ..Edit::default() };
        let edited = height(recording.edited(&points, half, &[0.25, 0.5, 1.5]).expect("an edit"));
        assert!(edited[..2] == [0.0, 0.0] && (edited[2] + 0.5).abs() < 1e-3, "{edited:?}");
    }

    #[test]
    fn a_file_keeps_the_laws_of_parts_and_refuses_times_outside() {
        let mut file = TensorFile::new("test");
        insert_recording(&mut file, "object.0.recording", &let_go());
        let read = read_recording(&file, "object.0.recording", 1).expect("a file");
        assert_eq!(read, Some(let_go()));
        file.set_metadata("object.0.recording.last.times", "[0.5, 1.5]".to_owned());
        let error = read_recording(&file, "object.0.recording", 1).expect_err("outside").to_string();
        assert!(error.contains("recording.last.times") && error.contains("1.5"), "{error}");
    }
}
