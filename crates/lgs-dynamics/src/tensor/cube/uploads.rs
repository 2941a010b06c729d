//! Supports on a device.

use std::sync::Arc;

use lgs_tensor::cube::latest::Latest;
use lgs_tensor::cube::{CubeDevice, CubeTensor, numbers};

use crate::supports::Supports;

/// Most owners of a member that one unit sums over.
const STRETCH: u32 = 32;

/// Supports on a device.
#[derive(Clone, Debug)]
pub(super) struct Uploaded {
    /// `[n, k]`.
    pub(super) members: CubeTensor,
    /// Members of a support.
    pub(super) k: u32,
    /// Owners of every particle, one particle's after the other's.
    pub(super) owners: CubeTensor,
    /// Stretches of owners `[stretches, 3]`: their member, begin and end.
    pub(super) stretches: CubeTensor,
    /// Number of stretches.
    pub(super) count: usize,
    /// `[n + 1]`: where each member's stretches begin.
    pub(super) begins: CubeTensor,
}

/// Supports on the device of a tensor. Those of the last call stay there: one step of training rolls an
/// object several times.
pub(super) fn uploaded(supports: &Arc<Supports>, like: &CubeTensor) -> Uploaded {
    static LATEST: Latest<Supports, Uploaded> = Latest::none();
    LATEST.of(supports, (&like.device, supports.particles()), || upload_supports(supports, &like.device))
}

fn upload_supports(supports: &Supports, device: &CubeDevice) -> Uploaded {
    let (stretches, begins) = stretches(supports.owners_start());
    let count = stretches.len() / 3;
    Uploaded {
        members: numbers(supports.indices().to_vec(), device),
        k: supports.k() as u32,
        owners: numbers(supports.all_owners().to_vec(), device),
        stretches: numbers(stretches, device),
        count,
        begins: numbers(begins, device),
    }
}

/// Stretches of owners, given where each particle's owners start, and where each particle's stretches begin.
fn stretches(owners_start: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let (mut stretches, mut begins) = (Vec::new(), vec![0]);
    for (member, ends) in owners_start.windows(2).enumerate() {
        for begin in (ends[0]..ends[1]).step_by(STRETCH as usize) {
            stretches.extend([member as u32, begin, (begin + STRETCH).min(ends[1])]);
        }
        begins.push(stretches.len() as u32 / 3);
    }
    (stretches, begins)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_cover_every_owner_once() {
        let (stretches, begins) = stretches(&[0, 2, 2, 40]);
        assert_eq!(stretches, [0, 0, 2, 2, 2, 34, 2, 34, 40]);
        assert_eq!(begins, [0, 1, 1, 3]);
    }
}
