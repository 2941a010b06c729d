//! Numbers of the three processors that write C3D files.

use super::super::error::TracksProblem;

/// Who wrote the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Processor {
    Intel,
    Dec,
    Sgi,
}

impl Processor {
    /// The processor that the fourth byte of the parameter section stands for.
    pub(super) fn of(code: u8) -> Option<Self> {
        match code {
            84 => Some(Self::Intel),
            85 => Some(Self::Dec),
            86 => Some(Self::Sgi),
            _ => None,
        }
    }
}

/// The bytes of a file as numbers of a processor; `part` of each call says in an error what was to be read.
pub(super) struct Words<'a> {
    bytes: &'a [u8],
    processor: Processor,
}

impl<'a> Words<'a> {
    pub(super) fn new(bytes: &'a [u8], processor: Processor) -> Self {
        Self { bytes, processor }
    }

    pub(super) fn len(&self) -> usize {
        self.bytes.len()
    }

    pub(super) fn slice(&self, at: usize, length: usize, part: &str) -> Result<&'a [u8], TracksProblem> {
        let ends = || TracksProblem::Ends {
            part: part.to_owned(),
            expected: (at as u64).saturating_add(length as u64),
            found: self.bytes.len() as u64,
        };
        self.bytes.get(at..).and_then(|rest| rest.get(..length)).ok_or_else(ends)
    }

    pub(super) fn byte(&self, at: usize, part: &str) -> Result<u8, TracksProblem> {
        Ok(self.slice(at, 1, part)?[0])
    }

    pub(super) fn integer(&self, at: usize, part: &str) -> Result<u16, TracksProblem> {
        let bytes = self.slice(at, 2, part)?;
        Ok(self.integer_of([bytes[0], bytes[1]]))
    }

    pub(super) fn float(&self, at: usize, part: &str) -> Result<f32, TracksProblem> {
        let bytes = self.slice(at, 4, part)?;
        Ok(self.float_of([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    pub(super) fn integer_of(&self, bytes: [u8; 2]) -> u16 {
        match self.processor {
            Processor::Sgi => u16::from_be_bytes(bytes),
            _ => u16::from_le_bytes(bytes),
        }
    }

    pub(super) fn float_of(&self, bytes: [u8; 4]) -> f32 {
        let [a, b, c, d] = bytes;
        match self.processor {
            Processor::Intel => f32::from_le_bytes(bytes),
            Processor::Sgi => f32::from_be_bytes(bytes),
            // A VAX float has the halves of an IEEE float the other way round and an exponent larger by 2.
            Processor::Dec => f32::from_be_bytes([b, a, d, c]) / 4.0,
        }
    }
}
