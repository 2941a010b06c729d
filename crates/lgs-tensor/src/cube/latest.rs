//! What was last made of a value for a device: steps of training that come with the same value again do not
//! upload it again.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::CubeDevice;

/// What was last made of a value.
#[derive(Debug)]
pub struct Latest<T, U>(Mutex<Option<Made<T, U>>>);

/// Something on a device, and the value and the number of things that it was made for.
#[derive(Debug)]
struct Made<T, U> {
    of: Weak<T>,
    count: usize,
    device: CubeDevice,
    made: U,
}

impl<T, U: Clone> Latest<T, U> {
    /// Nothing yet.
    #[must_use]
    pub const fn none() -> Self {
        Self(Mutex::new(None))
    }

    /// What is made of a value for a device and a number of things, anew where any of them is not the last
    /// call's.
    pub fn of(&self, value: &Arc<T>, (device, count): (&CubeDevice, usize), make: impl FnOnce() -> U) -> U {
        let mut latest = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = latest.as_ref().filter(|latest| {
            latest.of.as_ptr() == Arc::as_ptr(value) && latest.count == count && latest.device == *device
        });
        if let Some(found) = found {
            return found.made.clone();
        }
        let made = make();
        *latest = Some(Made { of: Arc::downgrade(value), count, device: device.clone(), made: made.clone() });
        made
    }
}
