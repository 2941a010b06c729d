//! Edits of datasets as edits of the dynamics.

use lgs_data::edit::MotionEdit;
use lgs_dynamics::Edit;

/// An edit of a dataset as one of the dynamics.
pub(crate) fn scales(edit: MotionEdit) -> Edit {
    Edit {
        velocity_scale: edit.velocity_scale as f32,
        potential_scale: edit.potential_scale as f32,
        force_scale: edit.force_scale as f32,
    }
}
