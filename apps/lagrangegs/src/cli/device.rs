//! `--device`: where training and evaluation compute.

use clap::ValueEnum;
use lgs_train::device::{Device, DeviceName};

/// The flag `--device`.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct DeviceArgs {
    /// Where to compute
    #[arg(long, value_enum, default_value_t = Name::Auto)]
    device: Name,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Name {
    /// The fastest that this build has
    Auto,
    /// The processor
    Cpu,
}

impl DeviceArgs {
    /// The device that the flag names.
    pub(super) fn device(self) -> Device {
        let name = match self.device {
            Name::Auto => DeviceName::Auto,
            Name::Cpu => DeviceName::Cpu,
        };
        name.device()
    }
}
