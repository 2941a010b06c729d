//! How many entries the lists of an image have room for.
//!
//! Buffers are made before the device has counted what an image needs, so that no step waits for it. The
//! first images of a size are counted on the spot; later ones get half as much again as the greatest need so
//! far, which the device notes and [`settle`] reads every so many steps. An image that needs more than there
//! is room for is drawn without its farthest Gaussians and has no gradient; the next call of [`settle`] says
//! so and makes more room.

use std::sync::{Mutex, MutexGuard, PoisonError};

use burn::backend::DispatchDevice;
use burn::tensor::{DType, Device};
use lgs_tensor::cube::{CubeDevice, CubeTensor, last_value, zeros};

use super::frame::Sizes;

/// Images of a size that are counted on the spot.
const COUNTED: usize = 32;
/// Images after which the greatest need is read where nobody calls [`settle`].
const UNSETTLED: usize = 256;
/// Entries by whose multiples room grows.
const STEP: usize = 1024;

/// The room for the lists of one image.
#[derive(Clone)]
pub(super) struct Room {
    /// Entries that fit.
    pub(super) entries: usize,
    /// `[1]`: where the device notes the greatest need.
    pub(super) greatest: CubeTensor,
}

/// What is known of the images of a number of tiles on a device.
struct Known {
    device: CubeDevice,
    tiles: usize,
    gaussians: usize,
    /// The room that there is.
    room: Room,
    /// Images counted on the spot, and images since the greatest need was read.
    counted: usize,
    unread: usize,
}

impl Known {
    fn new(like: &CubeTensor, tiles: usize) -> Self {
        let room = Room { entries: 0, greatest: zeros(like, [1], DType::U32) };
        Self { device: like.device.clone(), tiles, gaussians: 1, room, counted: 0, unread: 0 }
    }

    /// More Gaussians need room in proportion.
    fn follow(&mut self, gaussians: usize) {
        if gaussians > self.gaussians {
            self.room.entries = (self.room.entries * gaussians).div_ceil(self.gaussians);
            self.gaussians = gaussians;
        }
    }

    /// Makes room for half as much again as an image needs.
    fn grow(&mut self, need: usize) {
        let wanted = (need + need / 2).next_multiple_of(STEP);
        self.room.entries = self.room.entries.max(wanted);
    }

    /// Reads the greatest need.
    fn settle(&mut self) {
        let need = last_value(self.room.greatest.clone()) as usize;
        if need > self.room.entries {
            tracing::warn!(
                "an image needed {need} entries of tile lists where there was room for {}: it taught \
                 nothing; there is more room now",
                self.room.entries
            );
        }
        self.grow(need);
        self.unread = 0;
    }
}

fn known() -> MutexGuard<'static, Vec<Known>> {
    static KNOWN: Mutex<Vec<Known>> = Mutex::new(Vec::new());
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The room for an image whose entries begin at some places, the last of which is their number.
pub(super) fn room(places: &CubeTensor, sizes: &Sizes) -> Room {
    let mut known = known();
    let is_same = |known: &Known| known.tiles == sizes.tiles() && known.device == places.device;
    let found = known.iter().position(is_same).unwrap_or_else(|| {
        known.push(Known::new(places, sizes.tiles()));
        known.len() - 1
    });
    let known = &mut known[found];
    known.follow(sizes.gaussians);
    if known.counted < COUNTED {
        known.counted += 1;
        known.grow(last_value(places.clone()) as usize);
    } else if known.unread >= UNSETTLED {
        known.settle();
    }
    known.unread += 1;
    // No image needs more than every Gaussian in every tile.
    let entries = known.room.entries.min(sizes.gaussians * sizes.tiles()).max(1);
    Room { entries, ..known.room.clone() }
}

/// Reads the greatest need of the images drawn on a device since the last call, and makes room for it.
pub(crate) fn settle(device: &Device) {
    if let DispatchDevice::Cube(device) = device.clone().without_autodiff().as_dispatch() {
        known()
            .iter_mut()
            .filter(|known| known.unread > 0 && known.device == *device)
            .for_each(Known::settle);
    }
}
