//! Devices reached through CubeCL (feature `gpu`): one backend for the GPUs of every vendor.

pub mod latest;
pub mod product;
pub mod quaternions;
pub mod sums;
pub mod vectors;

use burn::backend::ops::IntTensorOps;
use burn::backend::{DispatchDevice, TensorMetadata, WgpuDeviceKind};
use burn::tensor::{DType, Device, DeviceType, Shape, Tensor, TensorData};
use burn_cubecl::cubecl::client::Client;

use burn_cubecl::cubecl::prelude::BufferArg;
use burn_cubecl::cubecl::{self, CubeCount, CubeDim, MemoryScope};
use burn_cubecl::ops::numeric::{empty_device_contiguous_dtype, zeros_client};
pub use burn_cubecl::{CubeBackend, CubeDevice, tensor::CubeTensor};

/// Unsigned numbers on a device; one at least, as a buffer has.
#[must_use]
pub fn numbers(mut numbers: Vec<u32>, device: &CubeDevice) -> CubeTensor {
    numbers.resize(numbers.len().max(1), 0);
    let shape = [numbers.len()];
    CubeBackend::int_from_data(TensorData::new(numbers, shape), device)
}

/// A contiguous tensor on the device of another, with any values.
///
/// # Panics
/// If it is larger than a buffer of the device can be.
#[must_use]
pub fn empty(like: &CubeTensor, shape: impl Into<Shape>, dtype: DType) -> CubeTensor {
    let shape = fitting(like, shape.into(), dtype);
    empty_device_contiguous_dtype(like.client.clone(), like.device.clone(), shape, dtype)
}

/// A contiguous tensor of zeros on the device of another.
///
/// # Panics
/// If it is larger than a buffer of the device can be.
#[must_use]
pub fn zeros(like: &CubeTensor, shape: impl Into<Shape>, dtype: DType) -> CubeTensor {
    let shape = fitting(like, shape.into(), dtype);
    zeros_client(like.client.clone(), like.device.clone(), shape, dtype)
}

/// A shape that fits into a buffer of the device. The library would notice one that doesn't when its values
/// are read, and not say its size.
fn fitting(like: &CubeTensor, shape: Shape, dtype: DType) -> Shape {
    let bytes = (shape.num_elements() * dtype.size()) as u64;
    let most = like.client.properties().memory.max_page_size;
    assert!(bytes <= most, "can't allocate buffer of size: {bytes}; the device's largest has {most}");
    shape
}

/// Bytes of the largest buffer of a device; nothing for the processor.
#[must_use]
pub fn largest_buffer(device: &Device) -> Option<u64> {
    is_cube(device).then(|| {
        let one = Tensor::<1>::zeros([1], &device.clone().without_autodiff());
        product::primitive(one).client.properties().memory.max_page_size
    })
}

/// Bytes of a device's memory that are set aside for tensors, in use or not: they grow only where memory is
/// asked of the driver. What launches keep their scalars in is not counted.
///
/// # Panics
/// If the device is none of CubeCL.
#[must_use]
pub fn reserved_bytes(device: &Device) -> u64 {
    let one = Tensor::<1>::zeros([1], &device.clone().without_autodiff());
    let report = product::primitive(one).client.memory_report(MemoryScope::Device);
    report.streams.iter().map(|stream| stream.pools.usage().bytes_reserved).sum()
}

/// The tensor, copied if its elements do not lie one after the other.
#[must_use]
pub fn contiguous(tensor: CubeTensor) -> CubeTensor {
    burn_cubecl::kernel::into_contiguous(tensor)
}

/// Tensors as arguments of a kernel.
#[must_use]
pub fn arguments<const N: usize>(tensors: [&CubeTensor; N]) -> [BufferArg; N] {
    tensors.map(|tensor| tensor.clone().into_buffer_arg())
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

/// The first device of this machine, for tests. Where there is none a test says so and passes, unless
/// `LAGRANGEGS_GPU=required` is set; `LAGRANGEGS_GPU=cuda` asks for one of CUDA.
///
/// # Panics
/// If there is none and one is required.
#[must_use]
pub fn device_for_tests() -> Option<Device> {
    let asked = std::env::var("LAGRANGEGS_GPU").unwrap_or_default();
    if asked == "cuda" {
        let device = first_of_cuda();
        assert!(device.is_some(), "no driver of CUDA offers a device, or the build has no feature `cuda`");
        return device;
    }
    let device = Device::enumerate(DeviceType::Wgpu).into_iter().next();
    assert!(device.is_some() || asked != "required", "no driver of Vulkan, Metal or DX12 offers a device");
    if device.is_none() {
        println!("skipped: no driver of Vulkan, Metal or DX12 offers a device");
    }
    device
}

#[cfg(feature = "cuda")]
fn first_of_cuda() -> Option<Device> {
    Device::enumerate(DeviceType::Cuda).into_iter().next()
}

#[cfg(not(feature = "cuda"))]
fn first_of_cuda() -> Option<Device> {
    None
}
