//! Names of compute devices: the one place that knows which backends a build has.

pub use burn::tensor::Device;

/// A device as a user names it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DeviceName {
    /// The fastest that this build has.
    #[default]
    Auto,
    /// The processor.
    Cpu,
}

impl DeviceName {
    /// All names.
    pub const ALL: [Self; 2] = [Self::Auto, Self::Cpu];

    /// The device's name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Cpu => "cpu",
        }
    }

    /// The device, without autodiff. Both names mean the processor until a build has something faster.
    #[must_use]
    pub fn device(self) -> Device {
        match self {
            Self::Auto | Self::Cpu => Device::flex(),
        }
    }
}
