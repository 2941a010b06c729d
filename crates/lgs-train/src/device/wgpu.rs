//! Devices that Vulkan, Metal or DX12 reaches.

use std::sync::{Mutex, PoisonError};

use burn::backend::{CubeDevice, DispatchDevice, WgpuDeviceKind};
use burn::tensor::{Device, DeviceKind, DeviceType};

use super::{DeviceEntry, DeviceError, DeviceName};

/// Kind and number of a device, as its driver lists it.
pub(super) fn kind(device: &Device) -> Option<WgpuDeviceKind> {
    match device.as_dispatch() {
        DispatchDevice::Cube(CubeDevice::Wgpu(device)) => Some(device.kind.clone()),
        _ => None,
    }
}

/// The devices of this machine, those that are software last.
fn list() -> Vec<Device> {
    let mut devices = Device::enumerate(DeviceType::Wgpu).into_vec();
    devices.sort_by_key(|device| kind(device) == Some(WgpuDeviceKind::Cpu));
    devices
}

/// Whether the first of the list is a GPU.
pub(super) fn has_gpu() -> bool {
    use WgpuDeviceKind::{DiscreteGpu, IntegratedGpu, VirtualGpu};
    let first = list().first().and_then(kind);
    first.is_some_and(|kind| matches!(kind, DiscreteGpu(_) | IntegratedGpu(_) | VirtualGpu(_)))
}

/// The devices of this machine in their drivers' words; opens each.
pub(super) fn entries() -> Vec<DeviceEntry> {
    let describe = |(index, device): (usize, &Device)| {
        let name = DeviceName::Wgpu(Some(index));
        let description = match open(name, index) {
            Ok(device) => described(&device),
            Err(error) => error.to_string(),
        };
        let software = if kind(device) == Some(WgpuDeviceKind::Cpu) { ", software" } else { "" };
        DeviceEntry { name: name.to_string(), description: format!("{description}{software}") }
    };
    list().iter().enumerate().map(describe).collect()
}

fn described(device: &Device) -> String {
    device.identity().map_or_else(|| "unknown".to_owned(), |identity| identity.name)
}

/// Opens the device with a number in the list.
pub(super) fn open(name: DeviceName, index: usize) -> Result<Device, DeviceError> {
    // A device is opened once in a process.
    static OPENED: Mutex<Vec<Device>> = Mutex::new(Vec::new());
    let devices = list();
    let found = devices.len();
    let Some(device) = devices.into_iter().nth(index) else {
        return Err(if found == 0 { DeviceError::Absent(name) } else { DeviceError::Index { name, found } });
    };
    let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
    if !opened.contains(&device) {
        initialise(&device).map_err(|reason| DeviceError::Driver { name, reason })?;
        opened.push(device.clone());
    }
    Ok(device)
}

/// Asks the driver for a device; one whose kind has no selector is opened when it is first used.
fn initialise(device: &Device) -> Result<(), String> {
    let kind = match kind(device) {
        Some(WgpuDeviceKind::DiscreteGpu(index)) => DeviceKind::DiscreteGpu(index),
        Some(WgpuDeviceKind::IntegratedGpu(index)) => DeviceKind::IntegratedGpu(index),
        Some(WgpuDeviceKind::VirtualGpu(index)) => DeviceKind::VirtualGpu(index),
        Some(WgpuDeviceKind::Cpu) => DeviceKind::Cpu,
        _ => return Ok(()),
    };
    Device::wgpu_options().device_kind(kind).init().map(drop).map_err(|error| error.to_string())
}
