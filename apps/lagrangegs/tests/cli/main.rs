//! The program as a user runs it: arguments in, exit code, stdout and stderr out.

mod bad_input;
mod bad_laws;
mod bench;
mod damaged;
mod datasets;
mod evaluations;
mod films;
mod foreign;
mod imported;
mod interrupts;
mod program;
mod recordings;
mod resumes;
mod runs;
mod scenes;
mod training;
mod usage;
mod videos;
mod weights;
