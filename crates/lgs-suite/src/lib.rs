//! Suites: scenes × methods × variants × seeds, the runs that these are, and the tables that the runs make.
//!
//! [`Suite`] is a checked suite file, [`Plan`] its cells in a stable order with their configurations, folders
//! and states, and [`Results`] what finished cells have left in their `metrics.json`; [`tables`] aggregates
//! them and [`table_text`] writes them as Markdown, CSV, LaTeX and JSON. Running a cell is the caller's: it
//! is an ordinary training run and an ordinary evaluation.
//!
//! Means are taken over scenes first, then over seeds, and only over complete sets: a figure that one scene
//! lacks is not averaged over the others. What is missing is `n/a`; no figure is made up.

mod bundled;
mod error;
mod field;
mod field_table;
mod figures;
mod law_tables;
mod methods;
mod part_tables;
mod plan;
mod published;
mod results;
mod rows;
mod scenes;
mod state;
mod suite;
mod suite_check;
mod suite_file;
mod system_tables;
mod table;
pub mod table_text;
pub mod tables;
mod thresholds;
mod variants;

pub use bundled::{BundledSuite, bundled_suites};
pub use error::SuiteError;
pub use field::{Field, Quoted};
pub use figures::Model;
pub use methods::{Method, methods};
pub use plan::{Cell, Plan};
pub use published::Published;
pub use results::{Results, Summary};
pub use scenes::{Folders, Scenes};
pub use state::CellState;
pub use suite::Suite;
pub use tables::{Entry, Format, Row, Table, all_tables};
pub use variants::{Variant, VariantTable, known_variants};
