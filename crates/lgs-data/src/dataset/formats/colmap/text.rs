//! COLMAP's text files: entries in lines, `#` before comments.

use super::model::{ColmapCamera, ColmapImage};
use crate::dataset::error::Problem;
use crate::ply::Points;

/// A line that is no comment, with its number from 1.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..).zip(text.lines()).filter(|(_, line)| !line.trim_start().starts_with('#'))
}

fn wrong(line: usize, expected: &str, found: &str) -> Problem {
    Problem::Malformed(format!("line {line}: expected {expected}, found `{found}`"))
}

fn number<T: std::str::FromStr>(line: usize, word: Option<&str>) -> Result<T, Problem> {
    let word = word.unwrap_or_default();
    word.parse().map_err(|_| wrong(line, "a number", word))
}

fn floats<'a, const N: usize>(
    line: usize,
    words: &mut impl Iterator<Item = &'a str>,
) -> Result<[f64; N], Problem> {
    let mut floats = [0.0; N];
    for slot in &mut floats {
        *slot = number(line, words.next())?;
    }
    Ok(floats)
}

/// `ID MODEL WIDTH HEIGHT PARAMETERS…`
pub(super) fn cameras(text: &str) -> Result<Vec<ColmapCamera>, Problem> {
    let camera = |(line, text): (usize, &str)| {
        let mut words = text.split_whitespace();
        let id = number(line, words.next())?;
        let model = words.next().ok_or_else(|| wrong(line, "a camera model", ""))?;
        let size = floats::<2>(line, &mut words)?;
        let parameters = words.map(|w| number(line, Some(w))).collect::<Result<Vec<f64>, _>>()?;
        ColmapCamera::new(id, model, size, &parameters)
    };
    lines(text).filter(|(_, line)| !line.trim().is_empty()).map(camera).collect()
}

/// Two lines each: `ID QW QX QY QZ TX TY TZ CAMERA NAME`, then its keypoints.
pub(super) fn images(text: &str) -> Result<Vec<ColmapImage>, Problem> {
    let mut images = Vec::new();
    let mut lines = lines(text);
    while let Some((line, text)) = lines.next() {
        if text.trim().is_empty() {
            continue;
        }
        let mut words = text.split_whitespace();
        number::<u64>(line, words.next())?;
        let rotation = floats(line, &mut words)?;
        let translation = floats(line, &mut words)?;
        let camera_id = number(line, words.next())?;
        let name = words.collect::<Vec<_>>().join(" ");
        if name.is_empty() {
            return Err(wrong(line, "an image's name at the end", text));
        }
        images.push(ColmapImage { rotation, translation, camera_id, name });
        // An image without keypoints has an empty line, which may be missing at the end.
        lines.next();
    }
    Ok(images)
}

/// `ID X Y Z R G B ERROR TRACK…`
pub(super) fn points(text: &str) -> Result<Points, Problem> {
    let mut points = Points::default();
    for (line, text) in lines(text).filter(|(_, line)| !line.trim().is_empty()) {
        let mut words = text.split_whitespace();
        number::<u64>(line, words.next())?;
        let position: [f64; 3] = floats(line, &mut words)?;
        let colour: [f64; 3] = floats(line, &mut words)?;
        check_point(points.positions.len(), position)?;
        points.positions.push(position.map(|v| v as f32));
        points.colors.push(colour.map(|c| (c / 255.0).clamp(0.0, 1.0) as f32));
    }
    Ok(points)
}

/// Refuses a point that is nowhere.
pub(super) fn check_point(entry: usize, position: [f64; 3]) -> Result<(), Problem> {
    if position.iter().all(|v| (*v as f32).is_finite()) {
        return Ok(());
    }
    let found = format!("{position:?}");
    let expected = "finite".to_owned();
    Err(Problem::Part { part: format!("point {entry}"), field: "position", expected, found })
}
