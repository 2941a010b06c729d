//! A viewer of Lagrangian scenes: a web server that renders with the project's own renderer, and a page that
//! steers it with mouse, touch and keys.
//!
//! The page opens a WebSocket and sends requests as JSON (`protocol`); pictures come back as JPEG or PNG. One
//! thread draws (`worker`); of every pane the newest request alone waits (`desk`), pages take turns, and a
//! slow connection delays nobody else. Rollouts are kept per edit within a bound of memory and grow by a few
//! steps at a time (`motions`), so that no request waits for a whole rollout: the picture follows the motion
//! as it is rolled out.
//!
//! What is on view is a finished run, or one that is trained while it is looked at (`exhibit`).
//!
//! Invariants: a picture of quality `exact` has the very pixels that rendering the same view writes; nothing
//! on disk is served, the page's files are part of the program; off loopback addresses every request needs a
//! token.

mod colors;
mod curve;
mod desk;
mod draw;
mod error;
mod exhibit;
mod guard;
mod motions;
mod page;
mod protocol;
mod server;
mod shared;
mod slice;
mod socket;
mod subject;
mod thresholds;
mod worker;

pub use colors::object_color;
pub use curve::StepSheet;
pub use error::ViewError;
pub use exhibit::Exhibit;
pub use server::{Options, Server, Stopper};
pub use subject::{Subject, TruthImage};
