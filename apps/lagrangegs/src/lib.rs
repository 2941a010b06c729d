//! LagrangeGS: dynamic Gaussian scenes from multi-view images whose motion is a Lagrangian system.
//!
//! This package is the command line ([`cli`]) and one name for all library crates. What a command does lies
//! in those crates; here are only flags, progress bars, messages and file names.
//!
//! ```no_run
//! use lagrangegs::lgs_dynamics::{Edit, Reversal};
//! use lagrangegs::lgs_model::{Motion, load_scene};
//! let scene = load_scene("runs/fan/lagrangian.safetensors".as_ref())?;
//! let slow = Edit { potential_scale: 0.25, ..Edit::default() };
//! let cloud = scene.cloud_at(&Motion::new(&scene, slow, Reversal::Exact).state_at(1.5), 1.5);
//! println!("{} Gaussians at t = 1.5", cloud.len());
//! # Ok::<(), lagrangegs::lgs_model::SceneError>(())
//! ```

pub mod cli;

pub use {
    lgs_core, lgs_data, lgs_distill, lgs_dynamics, lgs_eval, lgs_mechanics, lgs_model, lgs_render,
    lgs_report, lgs_suite, lgs_train,
};
