//! Names of compute devices: the one place that knows which backends a build has.

#[cfg(feature = "cuda")]
mod cuda;
mod failure;
#[cfg(feature = "gpu")]
mod wgpu;

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

pub use burn::tensor::Device;
pub use failure::failure;

/// A device as a user names it: `auto`, `cpu`, `wgpu` or `wgpu:N`, `cuda` or `cuda:N`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DeviceName {
    /// The first GPU of a build that has kernels for one, where the machine has one; else the processor.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// A device that Vulkan, Metal or DX12 reaches, by its place in [`devices`]; without a number the first.
    Wgpu(Option<usize>),
    /// A device that CUDA's driver offers, by its place among those of [`devices`]; without a number the
    /// first.
    Cuda(Option<usize>),
}

/// A device that a build can compute on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceEntry {
    /// Its name on the command line.
    pub name: String,
    /// What it is, in its driver's words.
    pub description: String,
}

/// Why there is no such device.
#[derive(Debug, Error)]
pub enum DeviceError {
    /// No device has this name.
    #[error("device: expected auto, cpu, wgpu, wgpu:N, cuda or cuda:N, found {0}")]
    Name(String),
    /// The build has no devices of this kind.
    #[error(
        "{0}: this build has no such devices; build with `cargo build --release --features {feature}`",
        feature = .0.feature()
    )]
    Feature(DeviceName),
    /// No driver offers a device.
    #[error("{0}: no driver of {drivers} offers a device on this machine", drivers = .0.drivers())]
    Absent(DeviceName),
    /// The number is that of no device.
    #[error("{name}: there {}, see `lagrangegs info --devices`", count(*.name, *.found))]
    Index {
        /// The device asked for.
        name: DeviceName,
        /// How many there are.
        found: usize,
    },
    /// A driver refuses.
    #[error("{name}: the driver can't open the device: {reason}")]
    Driver {
        /// The device asked for.
        name: DeviceName,
        /// The driver's reason.
        reason: String,
    },
}

fn count(name: DeviceName, devices: usize) -> String {
    if devices == 1 {
        format!("is one device, {}:0", name.kind())
    } else {
        format!("are {devices} devices, from 0")
    }
}

impl fmt::Display for DeviceName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wgpu(Some(index)) | Self::Cuda(Some(index)) => write!(f, "{}:{index}", self.kind()),
            _ => write!(f, "{}", self.kind()),
        }
    }
}

impl FromStr for DeviceName {
    type Err = DeviceError;

    fn from_str(text: &str) -> Result<Self, DeviceError> {
        let (kind, index) = match text.split_once(':') {
            Some((kind, index)) => (kind, Some(index.parse::<usize>())),
            None => (text, None),
        };
        match (kind, index.transpose()) {
            ("auto", Ok(None)) => Ok(Self::Auto),
            ("cpu", Ok(None)) => Ok(Self::Cpu),
            ("wgpu", Ok(index)) => Ok(Self::Wgpu(index)),
            ("cuda", Ok(index)) => Ok(Self::Cuda(index)),
            _ => Err(DeviceError::Name(text.to_owned())),
        }
    }
}

impl DeviceName {
    /// The name without a number.
    fn kind(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Cpu => "cpu",
            Self::Wgpu(_) => "wgpu",
            Self::Cuda(_) => "cuda",
        }
    }

    /// The feature of a build that has such devices.
    fn feature(self) -> &'static str {
        if matches!(self, Self::Cuda(_)) { "cuda" } else { "gpu" }
    }

    /// The drivers that offer such devices.
    fn drivers(self) -> &'static str {
        if matches!(self, Self::Cuda(_)) { "CUDA" } else { "Vulkan, Metal or DX12" }
    }

    /// The device that is meant, by name: asks drivers what `auto` is.
    #[must_use]
    pub fn resolved(self) -> Self {
        if self == Self::Auto { first_gpu().unwrap_or(Self::Cpu) } else { self }
    }

    /// The device, without autodiff.
    ///
    /// # Errors
    /// If this build or this machine has no such device, or its driver refuses to open it.
    pub fn open(self) -> Result<Device, DeviceError> {
        match self.resolved() {
            Self::Auto | Self::Cpu => Ok(Device::flex()),
            #[cfg(feature = "gpu")]
            Self::Wgpu(index) => wgpu::open(self, index.unwrap_or(0)),
            #[cfg(feature = "cuda")]
            Self::Cuda(index) => cuda::open(self, index.unwrap_or(0)),
            #[allow(unreachable_patterns, reason = "a build with all kinds of devices")]
            Self::Wgpu(_) | Self::Cuda(_) => Err(DeviceError::Feature(self)),
        }
    }

    /// The device, without autodiff, where it is known to be there.
    ///
    /// # Panics
    /// Where [`Self::open`] fails.
    #[must_use]
    pub fn device(self) -> Device {
        self.open().unwrap_or_else(|error| panic!("{error}"))
    }
}

/// The GPU that is tried first: CUDA's, then others; none of software.
fn first_gpu() -> Option<DeviceName> {
    #[cfg(feature = "cuda")]
    if cuda::has_gpu() {
        return Some(DeviceName::Cuda(Some(0)));
    }
    #[cfg(feature = "gpu")]
    if wgpu::has_gpu() {
        return Some(DeviceName::Wgpu(Some(0)));
    }
    None
}

/// Whether a device has kernels of its own, which are not those of the processor.
#[cfg(feature = "gpu")]
pub(crate) fn has_kernels(device: &Device) -> bool {
    lgs_tensor::cube::is_cube(device)
}

/// Whether a device has kernels of its own: not in this build.
#[cfg(not(feature = "gpu"))]
pub(crate) fn has_kernels(_device: &Device) -> bool {
    false
}

/// Bytes of the largest buffer of a device with kernels of its own.
#[must_use]
#[cfg(feature = "gpu")]
pub fn largest_buffer(device: &Device) -> Option<u64> {
    lgs_tensor::cube::largest_buffer(device)
}

/// Bytes of the largest buffer of a device with kernels of its own: none in this build.
#[must_use]
#[cfg(not(feature = "gpu"))]
pub fn largest_buffer(_device: &Device) -> Option<u64> {
    None
}

/// The devices that this build has on this machine; asks every driver.
#[must_use]
pub fn devices() -> Vec<DeviceEntry> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let description = format!("the processor, {threads} threads");
    #[allow(unused_mut, reason = "builds without GPUs add nothing")]
    let mut devices = vec![DeviceEntry { name: DeviceName::Cpu.to_string(), description }];
    #[cfg(feature = "cuda")]
    devices.extend(cuda::entries());
    #[cfg(feature = "gpu")]
    devices.extend(wgpu::entries());
    devices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_written() {
        for name in ["auto", "cpu", "wgpu", "wgpu:0", "wgpu:12", "cuda", "cuda:3"] {
            assert_eq!(name.parse::<DeviceName>().expect("a name").to_string(), name);
        }
        for wrong in ["", "tpu", "wgpu:", "wgpu:x", "wgpu:-1", "wgpu0", "cuda:", "cpu:0", "auto:1"] {
            let error = wrong.parse::<DeviceName>().expect_err("no name").to_string();
            assert!(error.contains("cuda:N") && error.ends_with(wrong), "{error}");
        }
    }

    #[test]
    fn the_processor_is_always_there() {
        assert!(DeviceName::Auto.open().is_ok());
        assert_eq!(devices()[0].name, "cpu");
    }

    #[test]
    fn auto_is_a_device_of_the_list_and_never_software() {
        let name = DeviceName::Auto.resolved().to_string();
        let found = devices().into_iter().find(|device| device.name == name).expect("a device");
        assert!(!found.description.ends_with("software"), "{found:?}");
        assert_eq!(DeviceName::Wgpu(None).resolved(), DeviceName::Wgpu(None));
    }

    #[test]
    #[cfg(not(feature = "gpu"))]
    fn a_build_without_gpus_says_how_to_get_one() {
        let error = DeviceName::Wgpu(Some(1)).open().expect_err("no device").to_string();
        assert!(error.starts_with("wgpu:1") && error.contains("--features gpu"), "{error}");
    }

    #[test]
    #[cfg(not(feature = "cuda"))]
    fn a_build_without_cuda_says_how_to_get_one() {
        let error = DeviceName::Cuda(None).open().expect_err("no device").to_string();
        assert!(error.starts_with("cuda: ") && error.contains("--features cuda"), "{error}");
    }

    #[test]
    #[cfg(feature = "gpu")]
    fn a_number_out_of_range_says_how_many_there_are() {
        let error = DeviceName::Wgpu(Some(999)).open().expect_err("no device").to_string();
        assert!(error.starts_with("wgpu:999: "), "{error}");
    }
}
