//! `--device`: where training and evaluation compute, and what becomes of a device's failure.

use std::panic::{self, AssertUnwindSafe};
use std::sync::{Mutex, PoisonError};

use anyhow::{Result, anyhow};
use lgs_eval::table::aligned;
use lgs_train::device::{Device, DeviceEntry, DeviceName, devices, failure, largest_buffer};
use serde_json::json;

use super::output;

/// The flag `--device`.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct DeviceArgs {
    /// Where to compute: auto, cpu, wgpu[:N] or cuda[:N], as `info --devices` lists them
    #[arg(long, default_value_t = DeviceName::Auto, value_name = "NAME")]
    device: DeviceName,
}

impl DeviceArgs {
    /// The device that the flag names.
    pub(super) fn open(self) -> Result<Device> {
        Ok(self.device.open()?)
    }

    /// Does what needs the device. A device other than the processor can be lost, or out of memory, at any
    /// step, which its library answers with a panic: this becomes an error.
    pub(super) fn run<T>(self, work: impl FnOnce(&Device) -> Result<T>) -> Result<T> {
        let name = self.device.resolved();
        let device = name.open()?;
        match name {
            DeviceName::Auto | DeviceName::Cpu => work(&device),
            DeviceName::Wgpu(_) | DeviceName::Cuda(_) => {
                tracing::info!(
                    "computing on {name}; laws, their fits to images and images of scores stay on the \
                     processor"
                );
                caught((name, largest_buffer(&device)), || work(&device))
            }
        }
    }
}

/// Prints the devices that [`DeviceArgs`] can name.
pub(super) fn list(json: bool) -> Result<()> {
    let devices = devices();
    if json {
        let entry = |d: &DeviceEntry| json!({ "name": d.name, "description": d.description });
        return output::print_json(&devices.iter().map(entry).collect::<Vec<_>>());
    }
    let rows: Vec<Vec<String>> = devices.into_iter().map(|d| vec![d.name, d.description]).collect();
    output::print(&aligned(&rows, &[false, false]))
}

/// Does some work on a device, whose largest buffer has so many bytes; its panic becomes an error.
fn caught<T>((name, largest): (DeviceName, Option<u64>), work: impl FnOnce() -> Result<T>) -> Result<T> {
    static LAST: Mutex<Option<String>> = Mutex::new(None);
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|info| {
        *LAST.lock().unwrap_or_else(PoisonError::into_inner) = Some(info.to_string());
    }));
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    panic::set_hook(hook);
    done.unwrap_or_else(|_| {
        let what = LAST.lock().unwrap_or_else(PoisonError::into_inner).take().unwrap_or_default();
        Err(anyhow!(
            "{name}: {}; checkpoints are as they were, and --resume goes on from the last, with \
             --device cpu too",
            failure(&what, largest)
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_of_a_device_is_an_error_that_says_how_to_go_on() {
        let failed: Result<()> = caught((DeviceName::Wgpu(Some(1)), None), || panic!("device lost"));
        let text = failed.expect_err("failed").to_string();
        assert!(text.starts_with("wgpu:1: ") && text.contains("--resume") && !text.contains('\n'), "{text}");
        assert!(text.contains("device lost"), "{text}");
        assert_eq!(caught((DeviceName::Wgpu(None), None), || Ok(3)).expect("done"), 3);
    }
}
