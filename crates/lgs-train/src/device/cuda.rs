//! Devices that CUDA's driver offers.

use std::panic::{AssertUnwindSafe, catch_unwind};

use burn::tensor::{Device, DeviceType};

use super::{DeviceEntry, DeviceError, DeviceName, failure};

/// The devices of this machine; none without a driver.
fn list() -> Vec<Device> {
    Device::enumerate(DeviceType::Cuda).into_vec()
}

/// Whether there is one.
pub(super) fn has_gpu() -> bool {
    !list().is_empty()
}

/// The devices of this machine in their driver's words; opens each.
pub(super) fn entries() -> Vec<DeviceEntry> {
    let describe = |(index, device): (usize, &Device)| {
        let name = DeviceName::Cuda(Some(index));
        let description = described(name, device).unwrap_or_else(|error| error.to_string());
        DeviceEntry { name: name.to_string(), description }
    };
    list().iter().enumerate().map(describe).collect()
}

/// What a device is; opens it, which its library answers with a panic where the driver refuses.
fn described(name: DeviceName, device: &Device) -> Result<String, DeviceError> {
    let identity = catch_unwind(AssertUnwindSafe(|| device.identity())).map_err(|cause| {
        let words = cause.downcast_ref::<String>().map(String::as_str);
        let words = words.or_else(|| cause.downcast_ref::<&str>().copied()).unwrap_or_default();
        DeviceError::Driver { name, reason: failure(words, None) }
    })?;
    Ok(identity.map_or_else(|| "unknown".to_owned(), |identity| identity.name))
}

/// Opens the device with a number in the list.
pub(super) fn open(name: DeviceName, index: usize) -> Result<Device, DeviceError> {
    let devices = list();
    let found = devices.len();
    let Some(device) = devices.into_iter().nth(index) else {
        return Err(if found == 0 { DeviceError::Absent(name) } else { DeviceError::Index { name, found } });
    };
    described(name, &device).map(|_| device)
}
