//! The program as a user runs it: arguments in, exit code, stdout and stderr out.

mod bad_input;
mod bad_laws;
mod bench;
mod datasets;
mod films;
mod foreign;
mod imported;
mod program;
mod recordings;
mod runs;
mod scenes;
mod training;
mod usage;
mod videos;
mod weights;
