//! Trust in the frames of a sweep: warnings, flags in the list of frames, and a mark in the corner.

use anyhow::Result;
use clap::ValueEnum;
use lgs_core::Image;
use lgs_dynamics::Edit;
use lgs_eval::laws::{Shown, Trust};
use lgs_report::mark_untrusted;
use serde_json::{Map, Value, json};

use super::failure::BadUsage;
use super::laws::laws_of;
use super::progress::say;
use super::run::Run;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ModelName {
    /// The Lagrangian scene
    Lagrangian,
    /// The source model that it was distilled from
    Source,
}

impl ModelName {
    /// The model in words.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Lagrangian => "Lagrangian scene",
            Self::Source => "source model",
        }
    }

    /// What stands over its frames, under an edit, where others stand beside them.
    pub(super) fn label(self, edit: Edit) -> &'static str {
        match self {
            Self::Source => "source",
            Self::Lagrangian if edit == Edit::default() => "Lagrangian",
            Self::Lagrangian => "edited",
        }
    }

    /// Refuses an edit of a model that has no physics.
    pub(super) fn check_edit(self, edit: Edit) -> Result<()> {
        if self == Self::Source && edit != Edit::default() {
            let text = "the source model has no physics to scale; leave out the scales or `--model source`";
            return Err(BadUsage(text.to_owned()).into());
        }
        Ok(())
    }
}

/// Where frames of times beyond trust are marked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Mark {
    /// A small red triangle in the upper right corner
    #[default]
    Corner,
    /// Not in the frame; the list of frames says it all the same
    None,
}

impl Mark {
    /// Marks a frame unless all is trusted at its time.
    pub(super) fn apply(self, trust: &Trust, time: f32, frame: &mut Image) {
        if self == Self::Corner && !trust.untrusted_at(time).is_empty() {
            mark_untrusted(frame);
        }
    }
}

/// Trust in one of a run's models under an edit.
pub(super) fn trust_in(run: &Run, model: ModelName, edit: Edit) -> Result<Trust> {
    let window = f64::from(run.scene.motion.time_window);
    Ok(match model {
        ModelName::Lagrangian => {
            let laws = laws_of(run)?;
            let law = |index: usize| laws.get(index).and_then(Option::as_ref);
            let shown = Shown::of_scene(&run.scene, edit).into_iter().enumerate();
            Trust::of_objects(shown.map(|(index, shown)| (law(index), shown)), window)
        }
        ModelName::Source => Trust::Source([0.0, window]),
    })
}

/// Says which objects are not trusted at which of the times.
pub(super) fn warn_of(trust: &Trust, times: &[f32]) {
    trust.warnings(times).iter().for_each(|warning| say(&format!("warning: {warning}")));
}

/// The entry of a file in the list of frames: its time, whether all is trusted at it, and if not the numbers
/// of the objects that are not.
pub(super) fn listed(file: &str, time: f32, trust: &Trust) -> Value {
    let untrusted = trust.untrusted_at(time);
    let mut entry = Map::new();
    entry.insert("file".to_owned(), json!(file));
    entry.insert("time".to_owned(), json!(time));
    entry.insert("trusted".to_owned(), json!(untrusted.is_empty()));
    if matches!(trust, Trust::Objects(_)) && !untrusted.is_empty() {
        entry.insert("untrusted_objects".to_owned(), json!(untrusted));
    }
    Value::Object(entry)
}
