//! Devices reached through CubeCL (feature `gpu`): one backend for the GPUs of every vendor.
//!
//! An operation that has no kernel for them declares itself [`OnProcessor`]: its tensors are read back, the
//! CPU's kernel runs, and the results are uploaded. The log says so once for each operation, since every call
//! costs two transfers and a wait for the device.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use burn::backend::ops::{FloatTensorOps, IntTensorOps};
use burn::backend::tensor::FloatTensor;
use burn::backend::{DispatchDevice, Flex, TensorMetadata, WgpuDeviceKind};
use burn::tensor::{DType, Device, DeviceType, Shape, TensorData};
use burn_cubecl::cubecl::client::Client;
use burn_cubecl::cubecl::{self, CubeCount, CubeDim};
use burn_cubecl::ops::numeric::{empty_device_contiguous_dtype, zeros_client};
pub use burn_cubecl::{CubeBackend, CubeDevice, tensor::CubeTensor};

use crate::{Call, Kernel};

/// An operation that devices of CubeCL leave to the processor.
pub trait OnProcessor: Call {
    /// The operation's name in the log.
    const OPERATION: &'static str;
}

impl<C: OnProcessor, const N: usize> Kernel<C, N> for CubeBackend
where
    Flex: Kernel<C, N>,
{
    /// The device, and what the CPU's forward pass kept.
    type Kept = (CubeDevice, <Flex as Kernel<C, N>>::Kept);

    fn forward(call: &C, inputs: [FloatTensor<Self>; N]) -> FloatTensor<Self> {
        say_once(C::OPERATION);
        let device = device_of(&inputs);
        upload(&<Flex as Kernel<C, N>>::forward(call, inputs.map(read_back)), &device)
    }

    fn forward_kept(call: &C, inputs: [FloatTensor<Self>; N]) -> (FloatTensor<Self>, Self::Kept) {
        say_once(C::OPERATION);
        let device = device_of(&inputs);
        let (output, kept) = <Flex as Kernel<C, N>>::forward_kept(call, inputs.map(read_back));
        (upload(&output, &device), (device, kept))
    }

    fn vjp(call: &C, (device, kept): Self::Kept, v_output: FloatTensor<Self>) -> [FloatTensor<Self>; N] {
        <Flex as Kernel<C, N>>::vjp(call, kept, read_back(v_output)).map(|v| upload(&v, &device))
    }
}

fn device_of<const N: usize>(inputs: &[CubeTensor; N]) -> CubeDevice {
    inputs.first().map(|input| input.device.clone()).unwrap_or_default()
}

/// A tensor's values on the processor; waits for the device.
///
/// # Panics
/// If the device is lost.
#[must_use]
pub fn read_back(tensor: FloatTensor<CubeBackend>) -> FloatTensor<Flex> {
    Flex::float_from_data(burn_cubecl::ops::into_data_sync(tensor), &Default::default())
}

/// Values of the processor on a device.
#[must_use]
pub fn upload(tensor: &FloatTensor<Flex>, device: &CubeDevice) -> FloatTensor<CubeBackend> {
    let shape = tensor.shape();
    let values = crate::flex::floats(&tensor.to_contiguous()).to_vec();
    CubeBackend::float_from_data(TensorData::new(values, shape), device)
}

/// A contiguous tensor on the device of another, with any values.
#[must_use]
pub fn empty(like: &CubeTensor, shape: impl Into<Shape>, dtype: DType) -> CubeTensor {
    empty_device_contiguous_dtype(like.client.clone(), like.device.clone(), shape.into(), dtype)
}

/// A contiguous tensor of zeros on the device of another.
#[must_use]
pub fn zeros(like: &CubeTensor, shape: impl Into<Shape>, dtype: DType) -> CubeTensor {
    zeros_client(like.client.clone(), like.device.clone(), shape.into(), dtype)
}

/// The tensor, copied if its elements do not lie one after the other.
#[must_use]
pub fn contiguous(tensor: CubeTensor) -> CubeTensor {
    burn_cubecl::kernel::into_contiguous(tensor)
}

/// Cubes and their size for so many units, each of which has to check that it is one of them.
#[must_use]
pub fn units(client: &Client, count: usize) -> (CubeCount, CubeDim) {
    let dim = CubeDim::new(client, count);
    (cubecl::calculate_cube_count_elemwise(client, count, dim), dim)
}

/// So many cubes or a few more, each of which has to check that it is one of them.
#[must_use]
pub fn cubes(client: &Client, count: usize) -> CubeCount {
    cubecl::calculate_cube_count_elemwise(client, count, CubeDim::new_1d(1))
}

/// The last of some unsigned integers; waits for the device.
///
/// # Panics
/// If there is none, or the device is lost.
#[must_use]
pub fn last_value(tensor: CubeTensor) -> u32 {
    let n = tensor.shape().num_elements();
    let last = CubeBackend::int_slice(tensor, &[(n - 1..n).into()]);
    burn_cubecl::ops::into_data_sync(last).try_to_vec::<u32>().expect("unsigned integers")[0]
}

/// Whether a device is one of CubeCL.
#[must_use]
pub fn is_cube(device: &Device) -> bool {
    matches!(device.clone().without_autodiff().as_dispatch(), DispatchDevice::Cube(_))
}

/// Whether a device is a driver that computes on the processor.
#[must_use]
pub fn is_software(device: &Device) -> bool {
    match device.as_dispatch() {
        DispatchDevice::Cube(CubeDevice::Wgpu(device)) => device.kind == WgpuDeviceKind::Cpu,
        _ => false,
    }
}

/// Says once in a process that an operation runs on the processor.
pub fn say_once(operation: &'static str) {
    static SAID: Mutex<BTreeSet<&str>> = Mutex::new(BTreeSet::new());
    if SAID.lock().unwrap_or_else(PoisonError::into_inner).insert(operation) {
        tracing::warn!("{operation}: no kernel for this device yet; runs on the processor");
    }
}

/// The first device of this machine, for tests. Where there is none a test says so and passes, unless
/// `LAGRANGEGS_GPU=required` is set.
///
/// # Panics
/// If there is none and one is required.
#[must_use]
pub fn device_for_tests() -> Option<Device> {
    let device = Device::enumerate(DeviceType::Wgpu).into_iter().next();
    let required = std::env::var("LAGRANGEGS_GPU").is_ok_and(|value| value == "required");
    assert!(device.is_some() || !required, "no driver of Vulkan, Metal or DX12 offers a device");
    if device.is_none() {
        println!("skipped: no driver of Vulkan, Metal or DX12 offers a device");
    }
    device
}
