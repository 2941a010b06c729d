//! The video track of a file: what decodes it, how a player turns it, and where its samples are.

use mp4_atom::{Tkhd, Trex};

use super::boxes::{Description, boxes, find, value, values};
use super::error::{DecodeError, index};
use super::samples::{Sample, Samples};
use super::turn::Turn;

/// Bytes of a visual sample entry before the boxes in it (ISO/IEC 14496-12, section 12.1.3).
const VISUAL_ENTRY: usize = 78;
/// Bytes of `stsd` before its first entry: version, flags and a count.
const BEFORE_ENTRIES: usize = 8;

/// A track of H.264.
pub(super) struct Track {
    /// The content of `avcC`.
    pub(super) configuration: Vec<u8>,
    pub(super) turn: Turn,
    /// In the order in which they are decoded.
    pub(super) samples: Vec<Sample>,
}

impl Track {
    /// The first video track.
    pub(super) fn of(file: &Description) -> Result<Self, DecodeError> {
        let mut tracks = boxes(&file.index).filter(|(name, _)| name == b"trak").map(|(_, own)| own);
        let track = tracks.find(|track| is_video(track)).ok_or(DecodeError::NoVideo)?;
        let missing = |name| index(format!("has a track without `{name}`"));
        let tables = find(track, &[b"mdia", b"minf", b"stbl"]).ok_or_else(|| missing("stbl"))?;
        let description = find(tables, &[b"stsd"]).ok_or_else(|| missing("stsd"))?;
        let configuration = configuration(description)?;
        let head: Tkhd = values(track, &[b"tkhd"])?.ok_or_else(|| missing("tkhd"))?;
        let mut samples = Samples::of_tables(tables)?;
        let defaults = defaults(&file.index, head.track_id)?;
        for fragment in &file.fragments {
            samples.add_fragment(fragment, &defaults)?;
        }
        Ok(Self { configuration, turn: Turn::of(&head.matrix), samples: samples.0 })
    }
}

fn is_video(track: &[u8]) -> bool {
    // Version, flags and a field that is not used stand before the kind.
    find(track, &[b"mdia", b"hdlr"]).and_then(|handler| handler.get(8..12)) == Some(b"vide")
}

/// What the decoder has to know, if it is one for H.264.
fn configuration(description: &[u8]) -> Result<Vec<u8>, DecodeError> {
    let entries = description.get(BEFORE_ENTRIES..).unwrap_or_default();
    let (name, entry) = boxes(entries).next().ok_or_else(|| index("describes no codec"))?;
    if &name != b"avc1" && &name != b"avc3" {
        let printed = |byte: &u8| if byte.is_ascii_graphic() { char::from(*byte) } else { '?' };
        return Err(DecodeError::Codec { found: name.iter().map(printed).collect() });
    }
    let own = entry.get(VISUAL_ENTRY..).and_then(|own| find(own, &[b"avcC"]));
    own.map(<[u8]>::to_vec).ok_or_else(|| index("describes no codec"))
}

/// What samples of fragments are unless these say otherwise.
fn defaults(moov: &[u8], track_id: u32) -> Result<Trex, DecodeError> {
    let own = find(moov, &[b"mvex"]).unwrap_or_default();
    for (_, own) in boxes(own).filter(|(name, _)| name == b"trex") {
        let defaults: Trex = value(own)?;
        if defaults.track_id == track_id {
            return Ok(defaults);
        }
    }
    Ok(Trex { track_id, ..Trex::default() })
}
