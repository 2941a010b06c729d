//! Rasterizer and photometric loss on devices of CubeCL.
//!
//! A kernel's parameters are its buffers, of which a device may offer a stage no more than eight.
#![allow(
    clippy::assign_op_pattern,
    clippy::manual_div_ceil,
    clippy::manual_memcpy,
    clippy::needless_range_loop,
    reason = "kernels are written in the part of the language that CubeCL translates"
)]

mod blend;
mod blend_vjp;
mod chain;
mod color_vjp;
mod extent;
mod frame;
mod group;
mod harmonics;
mod lists;
mod loss;
mod pack;
mod pose;
mod project;
mod pull_back;
mod raster;
mod room;
mod scan;
mod sort;
mod ssim;

pub(super) use room::settle;
