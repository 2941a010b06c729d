//! Lagrangian mechanics in generalised coordinates.
//!
//! A [`Law`] is a system of [`coordinates`], a list of [`terms`] (energies and generalised forces) and the
//! values of their parameters:
//!
//! ```text
//! L(x, ẋ) = ½ ẋ·M(x) ẋ − U(x),      d/dt ∂L/∂ẋ − ∂L/∂x = Q(x, ẋ)
//! ```
//!
//! A [`System`] follows it from a start, forward and backward in time and under an [`Edit`], with exact
//! derivatives of every state by the start and by all parameters. It is one mechanism for fitting laws to
//! tracks, for rendering a scene at any time, and for fitting laws to images.
//!
//! ```
//! use lgs_mechanics::coordinates::{Coordinates, Port, State};
//! use lgs_mechanics::terms::Term;
//! use lgs_mechanics::{Edit, Law, System};
//!
//! // A stone thrown under gravity.
//! let gravity = Term::named("uniform-field", Port::Whole)?;
//! let law = Law::new(Coordinates::Point, vec![gravity], vec![0.0, 0.0, -9.81], 0.01)?;
//! let start = State { x: vec![0.0, 0.0, 1.0], v: vec![2.0, 0.0, 3.0] };
//! let states = System::new(&law, Edit::NONE).states(&start, &[0.5, -0.1])?;
//! assert!((states[0].x[2] - (1.0 + 1.5 - 0.5 * 9.81 * 0.25)).abs() < 1e-12);
//! # Ok::<(), lgs_mechanics::MechanicsError>(())
//! ```
//!
//! [`explain::explain`] finds law and start from observed configurations, with their noise, rivals, bands and
//! a verdict:
//!
//! ```
//! use lgs_mechanics::bands::Verdict;
//! use lgs_mechanics::choose::candidates;
//! use lgs_mechanics::coordinates::{Coordinates, Hinge};
//! use lgs_mechanics::explain::{Options, explain};
//!
//! // Angles of a wheel that slows down, known to about a milliradian.
//! let hinge = Coordinates::Hinge(Hinge { axis: [0.0, 1.0, 0.0], pivot: [0.0, 0.0, 1.0] });
//! let times: Vec<f64> = (0..50).map(|k| f64::from(k) / 49.0).collect();
//! let error = |t: f64| 0.001 * (2654.0 * t).sin();
//! let angles: Vec<Vec<f64>> = times.iter().map(|&t| vec![5.0 * (1.0 - (-t).exp()) + error(t)]).collect();
//! let found = explain(&candidates(&hinge), &times, &angles, &Options::default())?;
//! assert_eq!(found.law().terms[0].kind.name(), "linear-drag");
//! assert_eq!(found.verdict, Verdict::Explained);
//! let forecast = found.start_at(1.5)?.x[0];
//! assert!((forecast - 5.0 * (1.0 - f64::exp(-1.5))).abs() < 0.01 && found.radius(&[1.5])[0] < 0.05);
//! # Ok::<(), lgs_mechanics::MechanicsError>(())
//! ```
//!
//! Time reaches no energy and no force. The crate reads no files, starts no
//! threads; all numbers are `f64`.
#![forbid(unsafe_code)]

pub mod bands;
mod candidate;
pub mod choose;
pub mod collisions;
pub mod contact;
pub mod coordinates;
mod edit;
mod error;
pub mod explain;
pub mod fit;
mod integrate;
mod law;
mod law_file;
pub mod mutual_contact;
pub mod noise;
mod parameter;
mod step;
mod system;
pub mod terms;
#[cfg(test)]
mod testing;
mod thresholds;

pub use candidate::{Candidate, FreeParameter};
pub use edit::Edit;
pub use error::MechanicsError;
pub use integrate::Design;
pub use law::Law;
pub use system::{Sensitivity, System};
pub use thresholds::{FAILS, FORECAST_ERROR, TRUSTED_FRACTION};
