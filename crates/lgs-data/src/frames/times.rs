//! The times of frames in a folder.

use std::path::Path;

use serde_json::Value;

use super::error::{FramesError, FramesProblem};
use crate::files::read_bytes;
use crate::names::{last_number, time_of_number};

/// Pairs every frame with its time; `names` are those of all frames in their order.
pub(super) fn of_folder(folder: &Path, names: Vec<String>) -> Result<Vec<(String, f32)>, FramesError> {
    let list = |file: &str| Some(folder.join(file)).filter(|path| path.exists());
    if names.is_empty() {
        return Err(FramesError::new(folder, FramesProblem::NoFrames));
    }
    if let Some(path) = list("frames.json") {
        return manifest(&json(&path)?).map_err(|problem| FramesError::new(&path, problem));
    }
    if let Some(path) = list("times.json") {
        return from_json(&json(&path)?, names).map_err(|problem| FramesError::new(&path, problem));
    }
    if let Some(path) = list("times.txt") {
        let text = String::from_utf8_lossy(&read_bytes(&path)?).into_owned();
        return from_lines(&text, names).map_err(|problem| FramesError::new(&path, problem));
    }
    if let Some(times) = from_numbers(&names) {
        return Ok(names.into_iter().zip(times).collect());
    }
    let timed = |name: String| match time_in_name(&name) {
        Some(time) => Ok((name, time)),
        None => Err(FramesError::new(folder, FramesProblem::NoTime(name))),
    };
    names.into_iter().map(timed).collect()
}

/// Times of frames that are numbered and no more (`frame0001.ply`, `point_cloud_12.ply`): the recording spans
/// [0, 1), and a number left out is a frame left out.
fn from_numbers(names: &[String]) -> Option<Vec<f32>> {
    if names.iter().any(|name| time_in_name(name).is_some()) {
        return None;
    }
    let parts: Vec<(&str, u64, &str)> = names.iter().map(|name| last_number(name)).collect::<Option<_>>()?;
    let (before, first, after) = *parts.first()?;
    let last = parts.last()?.1;
    let is_one_series = parts.iter().all(|part| (part.0, part.2) == (before, after));
    let time = |part: &(&str, u64, &str)| time_of_number(part.1, first, last) as f32;
    is_one_series.then(|| parts.iter().map(time).collect())
}

fn json(path: &Path) -> Result<Value, FramesError> {
    serde_json::from_slice(&read_bytes(path)?)
        .map_err(|e| FramesError::new(path, FramesProblem::Malformed(e.to_string())))
}

/// The list that `lagrangegs export` writes.
fn manifest(list: &Value) -> Result<Vec<(String, f32)>, FramesProblem> {
    let malformed =
        || FramesProblem::Malformed("expected {\"frames\": [{\"file\": …, \"time\": …}]}".to_owned());
    let frames = list["frames"].as_array().ok_or_else(malformed)?;
    let frame = |frame: &Value| {
        // A path out of the folder is no frame of it.
        let name = frame["file"]
            .as_str()
            .filter(|name| Path::new(name).components().count() == 1)
            .ok_or_else(malformed)?;
        Ok((name.to_owned(), number(&frame["time"]).ok_or_else(|| FramesProblem::NoTime(name.to_owned()))?))
    };
    frames.iter().map(frame).collect()
}

fn from_json(times: &Value, names: Vec<String>) -> Result<Vec<(String, f32)>, FramesProblem> {
    match times {
        Value::Array(times) => {
            let missing = |i: usize| {
                FramesProblem::Malformed(format!("expected a number at index {i}, found {}", times[i]))
            };
            let times = times.iter().enumerate().map(|(i, time)| number(time).ok_or_else(|| missing(i)));
            paired(names, times.collect::<Result<Vec<f32>, _>>()?)
        }
        Value::Object(times) => {
            let timed = |name: String| match times.get(&name).and_then(number) {
                Some(time) => Ok((name, time)),
                None => Err(FramesProblem::NoTime(name)),
            };
            names.into_iter().map(timed).collect()
        }
        other => Err(FramesProblem::Malformed(format!("expected an array or an object, found {other}"))),
    }
}

fn from_lines(text: &str, names: Vec<String>) -> Result<Vec<(String, f32)>, FramesProblem> {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let time = |line: &str| {
        finite(line).ok_or_else(|| FramesProblem::Malformed(format!("expected a number, found `{line}`")))
    };
    paired(names, lines.map(time).collect::<Result<Vec<f32>, _>>()?)
}

fn paired(names: Vec<String>, times: Vec<f32>) -> Result<Vec<(String, f32)>, FramesProblem> {
    if names.len() != times.len() {
        return Err(FramesProblem::Times { expected: names.len(), found: times.len() });
    }
    Ok(names.into_iter().zip(times).collect())
}

fn number(value: &Value) -> Option<f32> {
    value.as_f64().map(|v| v as f32).filter(|v| v.is_finite())
}

fn finite(text: &str) -> Option<f32> {
    // `parse` also takes `nan` and `infinity`.
    text.parse::<f32>().ok().filter(|v| v.is_finite())
}

/// A number after a `t` that is no letter of a word, or one with a decimal point after the last underscore.
fn time_in_name(name: &str) -> Option<f32> {
    let stem = Path::new(name).file_stem()?.to_str()?;
    let after_t = stem
        .rfind('t')
        .filter(|&at| !stem[..at].ends_with(char::is_alphabetic))
        .and_then(|at| finite(&stem[at + 1..]));
    let decimal = || stem.rsplit('_').next().filter(|part| part.contains('.')).and_then(finite);
    after_t.or_else(decimal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_stand_at_the_end_of_names() {
        for (name, time) in [
            ("0003_t+0.0300.ply", Some(0.03)),
            ("0000_t-0.7500.ply", Some(-0.75)),
            ("t12.ply", Some(12.0)),
            ("ball_0.25.ply", Some(0.25)),
            ("shot12.ply", None),
            ("frame_0012.ply", None),
            ("tnan.ply", None),
            ("part.ply", None),
        ] {
            assert_eq!(time_in_name(name), time, "{name}");
        }
    }
}
