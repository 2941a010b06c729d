//! How the samples of a video stand for colours (H.264, Annex E): matrix, range and places of chroma samples.

use rust_h264::nal::SpsInfo;

use super::error::DecodeError;
use crate::thresholds::{HD_LINES, MOST_MACROBLOCKS, MOST_REFERENCES};

/// Weights of red and blue in luma.
type Weights = [f32; 2];

const BT_601: Weights = [0.299, 0.114];
const BT_709: Weights = [0.2126, 0.0722];
const BT_2020: Weights = [0.2627, 0.0593];
const FCC: Weights = [0.30, 0.11];
const SMPTE_240: Weights = [0.212, 0.087];

/// How samples stand for colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    /// Weights of red and blue in luma.
    pub(super) weights: Weights,
    /// Whether values use all levels.
    pub(super) is_full: bool,
    /// By how many quarters of a chroma sample the first one lies right of, and below, the first pixel.
    pub(super) shift: [usize; 2],
}

impl Look {
    /// The look of the frames after a sequence parameter set, which has to be one that can be decoded.
    pub(super) fn of(info: &SpsInfo) -> Result<Self, DecodeError> {
        let macroblocks = u64::from(info.coded_width / 16) * u64::from(info.coded_height / 16);
        let [width, height] = [info.width, info.height];
        if macroblocks > MOST_MACROBLOCKS.into() || info.reference_frames > MOST_REFERENCES {
            let references = info.reference_frames;
            return Err(DecodeError::Unsupported(format!(
                "frames of {width} × {height} pixels and {references} references, more than any level allows"
            )));
        }
        let weights = match info.matrix {
            1 => BT_709,
            4 => FCC,
            5 | 6 => BT_601,
            7 => SMPTE_240,
            9 => BT_2020,
            2 if height >= HD_LINES => BT_709,
            2 => BT_601,
            other => return Err(DecodeError::Unsupported(format!("colours by matrix {other}"))),
        };
        // Table E-6 and figure E-1: left or centred; in the middle of two lines, on the upper, on the lower.
        let shift = match info.chroma_location {
            1 => [1, 1],
            2 => [0, 0],
            3 => [1, 0],
            4 => [0, 2],
            5 => [1, 2],
            _ => [0, 1],
        };
        Ok(Self { weights, is_full: info.full_range, shift })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A video that says nothing of its colours.
    pub(in crate::read) fn info() -> SpsInfo {
        SpsInfo {
            width: 4,
            height: 2,
            coded_width: 16,
            coded_height: 16,
            profile: 100,
            chroma_format: 1,
            bit_depth_luma: 8,
            bit_depth_chroma: 8,
            reference_frames: 4,
            progressive: true,
            full_range: false,
            primaries: 2,
            transfer: 2,
            matrix: 2,
            chroma_location: 0,
            max_reorder_frames: None,
        }
    }

    #[test]
    fn what_no_level_allows_is_refused_before_it_is_decoded() {
        let refused = |info| Look::of(&info).unwrap_err().to_string();
        let wide = SpsInfo { coded_width: 16384, coded_height: 16384, ..info() };
        assert!(refused(wide).contains("more than any level allows"));
        assert!(refused(SpsInfo { reference_frames: 17, ..info() }).contains("17 references"));
        assert!(refused(SpsInfo { matrix: 0, ..info() }).contains("matrix 0"));
    }
}
