//! A scene whose colours tests read from its file.

use std::path::PathBuf;

use lgs_core::{GaussianCloud, SH_C0};
use lgs_dynamics::testing::quadratic;
use lgs_dynamics::{Edit, Reversal};
use tempfile::TempDir;

use crate::testing::particles;
use crate::{LagrangianScene, Motion, load_scene, save_scene};

/// A static Gaussian and a dynamic one that rests, both of brightness 0.4.
pub(crate) fn two_gaussians() -> LagrangianScene {
    let gaussian = |x: f32| GaussianCloud::isotropic(vec![[x, 0.0, 0.0]], 0.1, [0.4; 3], 0.6);
    let resting = particles(gaussian(1.0), vec![[0.0; 3]], quadratic([0.0; 3], [0.0; 6]), None);
    LagrangianScene { static_gaussians: gaussian(0.0), ..resting }
}

/// The brightness of two Gaussians at a time, read from a scene's file.
pub(crate) fn brightness_from_file(scene: &LagrangianScene, time: f32) -> [f32; 2] {
    let (_folder, path) = saved(scene);
    let read = load_scene(&path).expect("load");
    let state = Motion::new(&read, Edit::default(), Reversal::Exact).state_at(time);
    let cloud = read.cloud_at(&state, time);
    [0, cloud.sh_stride()].map(|at| 0.5 + SH_C0 * cloud.sh[at])
}

/// What reading a scene's file says about it.
pub(crate) fn defect_of_file(scene: &LagrangianScene) -> String {
    let (_folder, path) = saved(scene);
    load_scene(&path).expect_err("a defect").to_string()
}

fn saved(scene: &LagrangianScene) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("lagrangian.safetensors");
    save_scene(scene, &path).expect("save");
    (folder, path)
}
