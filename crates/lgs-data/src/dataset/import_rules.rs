//! Which frames of a set are imported, and in which splits.

use super::error::Problem;
use super::frame_spec::FrameSpec;
use std::collections::{BTreeMap, BTreeSet};

/// Splits that rules distribute anew; others stay as they are.
const POOLED: [&str; 3] = ["train", "val", "test"];

/// Rules; by default all frames are imported in the splits of the source. With a rule that names cameras or
/// counts images, the frames of `train`, `val` and `test` are all in `train` but for those that a rule puts
/// elsewhere; later rules win, in the order of the fields.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportRules {
    /// Only times of at least the first and below the second number, which become 0 and 1.
    pub times: Option<[f32; 2]>,
    /// One of so many moments, beginning with the first. Default: all.
    pub every: Option<usize>,
    /// Cameras of `val`, by name; by number, in order of appearance, where the source has no names.
    pub val_cameras: Vec<String>,
    /// Cameras of `test`.
    pub test_cameras: Vec<String>,
    /// One image of so many, beginning with the first, is in `test`.
    pub test_every: Option<usize>,
    /// Images later than this time, of the source, are in `test`, whatever their split was.
    pub test_after: Option<f32>,
}

type Splits = Vec<(String, Vec<FrameSpec>)>;

impl ImportRules {
    /// Whether the source's own choice of held-out images is given up.
    fn replaces(&self) -> bool {
        let by_camera = !(self.val_cameras.is_empty() && self.test_cameras.is_empty());
        by_camera || self.test_every.is_some()
    }
}

/// The frames that rules choose, in the splits that rules choose. Empty splits are left out, but there must
/// be one for training.
pub(super) fn assigned(mut splits: Splits, rules: &ImportRules) -> Result<Splits, Problem> {
    for (count, field) in [(rules.every, "every"), (rules.test_every, "test every")] {
        if count == Some(0) {
            return Err(Problem::Malformed(format!("`{field}` should be at least 1, found 0")));
        }
    }
    if rules.replaces() || rules.test_after.is_some() {
        splits = distributed(splits, rules)?;
    }
    let moments = moments(&splits, rules);
    let kept = |time: f32| moments.contains(&time.to_bits());
    for (_, specs) in &mut splits {
        specs.retain(|spec| kept(spec.time));
        if let Some([from, to]) = rules.times {
            specs.iter_mut().for_each(|spec| spec.time = (spec.time - from) / (to - from));
        }
    }
    splits.retain(|(_, specs)| !specs.is_empty());
    if splits.iter().any(|(name, _)| name == "train") {
        Ok(splits)
    } else {
        Err(Problem::Malformed("the rules leave no image for training".to_owned()))
    }
}

/// Bits of the times that are kept.
fn moments(splits: &Splits, rules: &ImportRules) -> BTreeSet<u32> {
    let [from, to] = rules.times.unwrap_or([f32::NEG_INFINITY, f32::INFINITY]);
    let times = splits.iter().flat_map(|(_, specs)| specs.iter().map(|spec| spec.time));
    let mut times: Vec<f32> = times.filter(|time| (from..to).contains(time)).collect();
    times.sort_by(f32::total_cmp);
    times.dedup();
    times.into_iter().step_by(rules.every.unwrap_or(1)).map(f32::to_bits).collect()
}

fn distributed(splits: Splits, rules: &ImportRules) -> Result<Splits, Problem> {
    let (pooled, mut others): (Splits, Splits) =
        splits.into_iter().partition(|(name, _)| POOLED.contains(&name.as_str()));
    let own = pooled.iter().flat_map(|(name, specs)| specs.iter().map(move |_| name.clone()));
    let own: Vec<String> = own.collect();
    let specs: Vec<FrameSpec> = pooled.into_iter().flat_map(|(_, specs)| specs).collect();
    let names = camera_names(&specs);
    let known: BTreeSet<&String> = names.iter().collect();
    let asked = rules.val_cameras.iter().chain(&rules.test_cameras);
    if let Some(unknown) = asked.into_iter().find(|name| !known.contains(name)) {
        let all = known.into_iter().cloned().collect::<Vec<_>>().join(", ");
        return Err(Problem::Malformed(format!("there is no camera `{unknown}` among {all}")));
    }
    let split = |index: usize, spec: &FrameSpec| {
        let is_late = rules.test_after.is_some_and(|limit| spec.time > limit);
        let is_nth = rules.test_every.is_some_and(|n| index.is_multiple_of(n));
        if is_late || is_nth || rules.test_cameras.contains(&names[index]) {
            "test"
        } else if rules.val_cameras.contains(&names[index]) {
            "val"
        } else if rules.replaces() {
            "train"
        } else {
            own[index].as_str()
        }
    };
    let mut found: BTreeMap<&str, Vec<FrameSpec>> = BTreeMap::new();
    for (index, spec) in specs.iter().enumerate() {
        found.entry(split(index, spec)).or_default().push(spec.clone());
    }
    let mut splits: Splits =
        POOLED.iter().filter_map(|name| Some(((*name).to_owned(), found.remove(name)?))).collect();
    splits.append(&mut others);
    Ok(splits)
}

/// The camera of every frame: its name, or the number of its pose.
fn camera_names(specs: &[FrameSpec]) -> Vec<String> {
    let mut poses: BTreeMap<[u32; 16], usize> = BTreeMap::new();
    let mut number = |spec: &FrameSpec| {
        let next = poses.len();
        *poses.entry(spec.camera_from_world.to_cols_array().map(f32::to_bits)).or_insert(next)
    };
    specs.iter().map(|spec| spec.view.clone().unwrap_or_else(|| number(spec).to_string())).collect()
}
