//! Seeded random streams, one per purpose and step, so that no generator state has to be carried or saved.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The generator behind every stream.
pub type Stream = ChaCha8Rng;

/// The stream of a purpose at a step of a run: the same three arguments give the same numbers on every
/// machine.
///
/// Because a stream depends on nothing else, a resumed run draws what an uninterrupted one would have drawn.
#[must_use]
pub fn stream(seed: u64, purpose: &str, step: u64) -> Stream {
    // FNV-1a: a fixed, documented hash, unlike the standard library's.
    let purpose = purpose
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&purpose.to_le_bytes());
    key[16..24].copy_from_slice(&step.to_le_bytes());
    ChaCha8Rng::from_seed(key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::rand_core::Rng;

    #[test]
    fn streams_differ_by_purpose_and_step_and_repeat() {
        let draw = |purpose, step| stream(7, purpose, step).next_u64();
        assert_eq!(draw("camera", 3), draw("camera", 3));
        assert_ne!(draw("camera", 3), draw("camera", 4));
        assert_ne!(draw("camera", 3), draw("split", 3));
    }
}
