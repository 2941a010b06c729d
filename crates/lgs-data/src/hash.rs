//! The hash by which contents are told apart.

use crate::thresholds::SHORT_HASH;
use sha2::{Digest, Sha256};

/// SHA-256 of the bytes that are added to it, in order.
#[derive(Clone, Debug, Default)]
pub struct ContentHash(Sha256);

impl ContentHash {
    /// Adds bytes to the contents that are hashed.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// All 64 hexadecimal digits.
    #[must_use]
    pub fn hexadecimal(self) -> String {
        self.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The first 16 hexadecimal digits.
    #[must_use]
    pub fn short(self) -> String {
        let mut digits = self.hexadecimal();
        digits.truncate(SHORT_HASH);
        digits
    }

    /// The hash of some bytes.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        let mut hash = Self::default();
        hash.add(bytes);
        hash
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_sha_256_of_the_parts_in_order() {
        let mut parts = ContentHash::default();
        parts.add(b"ab");
        parts.add(b"c");
        assert_eq!(parts.clone().short(), "ba7816bf8f01cfea");
        assert_eq!(parts.hexadecimal(), ContentHash::of(b"abc").hexadecimal());
    }
}
