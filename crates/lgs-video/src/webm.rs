//! A track as a WebM file (RFC 8794 for its elements, RFC 9559 for their meaning): its index first, a cluster
//! for each key frame, times in milliseconds.

use crate::track::{Sample, Track};

/// Identifiers of elements, with their length markers.
mod id {
    pub(super) const EBML: u32 = 0x1A45_DFA3;
    pub(super) const EBML_VERSION: u32 = 0x4286;
    pub(super) const EBML_READ_VERSION: u32 = 0x42F7;
    pub(super) const EBML_MAX_ID_LENGTH: u32 = 0x42F2;
    pub(super) const EBML_MAX_SIZE_LENGTH: u32 = 0x42F3;
    pub(super) const DOC_TYPE: u32 = 0x4282;
    pub(super) const DOC_TYPE_VERSION: u32 = 0x4287;
    pub(super) const DOC_TYPE_READ_VERSION: u32 = 0x4285;
    pub(super) const SEGMENT: u32 = 0x1853_8067;
    pub(super) const INFO: u32 = 0x1549_A966;
    pub(super) const TIMESTAMP_SCALE: u32 = 0x002A_D7B1;
    pub(super) const DURATION: u32 = 0x4489;
    pub(super) const MUXING_APP: u32 = 0x4D80;
    pub(super) const WRITING_APP: u32 = 0x5741;
    pub(super) const TRACKS: u32 = 0x1654_AE6B;
    pub(super) const TRACK_ENTRY: u32 = 0xAE;
    pub(super) const TRACK_NUMBER: u32 = 0xD7;
    pub(super) const TRACK_UID: u32 = 0x73C5;
    pub(super) const TRACK_TYPE: u32 = 0x83;
    pub(super) const DEFAULT_DURATION: u32 = 0x0023_E383;
    pub(super) const CODEC_ID: u32 = 0x86;
    pub(super) const CODEC_PRIVATE: u32 = 0x63A2;
    pub(super) const VIDEO: u32 = 0xE0;
    pub(super) const PIXEL_WIDTH: u32 = 0xB0;
    pub(super) const PIXEL_HEIGHT: u32 = 0xBA;
    pub(super) const CUES: u32 = 0x1C53_BB6B;
    pub(super) const CUE_POINT: u32 = 0xBB;
    pub(super) const CUE_TIME: u32 = 0xB3;
    pub(super) const CUE_TRACK_POSITIONS: u32 = 0xB7;
    pub(super) const CUE_TRACK: u32 = 0xF7;
    pub(super) const CUE_CLUSTER_POSITION: u32 = 0xF1;
    pub(super) const CLUSTER: u32 = 0x1F43_B675;
    pub(super) const TIMESTAMP: u32 = 0xE7;
    pub(super) const SIMPLE_BLOCK: u32 = 0xA3;
}

const PROGRAM: &[u8] = b"LagrangeGS";
const NANOSECONDS: u64 = 1_000_000_000;

/// The bytes of the file.
pub(crate) fn webm(track: &Track) -> Vec<u8> {
    let clusters = clusters(track);
    let head = [info(track), tracks(track)].concat();
    // Positions count from the segment's first byte; the index has the same length whatever it says.
    let first = head.len() + cues(&clusters, 0).len();
    let body = clusters.iter().flat_map(|(_, bytes)| bytes).copied().collect();
    let segment = element(id::SEGMENT, &[head, cues(&clusters, first), body].concat());
    [header(), segment].concat()
}

fn header() -> Vec<u8> {
    master(
        id::EBML,
        &[
            number(id::EBML_VERSION, 1),
            number(id::EBML_READ_VERSION, 1),
            number(id::EBML_MAX_ID_LENGTH, 4),
            number(id::EBML_MAX_SIZE_LENGTH, 8),
            element(id::DOC_TYPE, b"webm"),
            number(id::DOC_TYPE_VERSION, 4),
            number(id::DOC_TYPE_READ_VERSION, 2),
        ],
    )
}

fn info(track: &Track) -> Vec<u8> {
    let duration = 1e3 * track.samples.len() as f64 / f64::from(track.spec.frames_per_second);
    master(
        id::INFO,
        &[
            number(id::TIMESTAMP_SCALE, NANOSECONDS / 1000),
            element(id::DURATION, &duration.to_be_bytes()),
            element(id::MUXING_APP, PROGRAM),
            element(id::WRITING_APP, PROGRAM),
        ],
    )
}

fn tracks(track: &Track) -> Vec<u8> {
    const VIDEO_TRACK: u64 = 1;
    let size = [
        number(id::PIXEL_WIDTH, track.spec.width.into()),
        number(id::PIXEL_HEIGHT, track.spec.height.into()),
    ];
    let entry = [
        number(id::TRACK_NUMBER, 1),
        number(id::TRACK_UID, 1),
        number(id::TRACK_TYPE, VIDEO_TRACK),
        number(id::DEFAULT_DURATION, NANOSECONDS / u64::from(track.spec.frames_per_second)),
        element(id::CODEC_ID, b"V_AV1"),
        element(id::CODEC_PRIVATE, &track.configuration),
        master(id::VIDEO, &size),
    ];
    master(id::TRACKS, &[master(id::TRACK_ENTRY, &entry)])
}

/// Clusters with their times.
fn clusters(track: &Track) -> Vec<(u64, Vec<u8>)> {
    let time = |frame: usize| {
        let rate = u64::from(track.spec.frames_per_second);
        (1000 * frame as u64 + rate / 2) / rate
    };
    let keys = (0..track.samples.len()).filter(|&frame| frame == 0 || track.samples[frame].is_key);
    let starts: Vec<usize> = keys.chain([track.samples.len()]).collect();
    let cluster = |span: &[usize]| {
        let begin = time(span[0]);
        let blocks = (span[0]..span[1]).map(|frame| block(time(frame) - begin, &track.samples[frame]));
        let parts: Vec<Vec<u8>> = [number(id::TIMESTAMP, begin)].into_iter().chain(blocks).collect();
        (begin, master(id::CLUSTER, &parts))
    };
    starts.windows(2).map(cluster).collect()
}

/// A frame of track 1, by its time from the start of its cluster in milliseconds.
fn block(offset: u64, sample: &Sample) -> Vec<u8> {
    const TRACK: u8 = 0x81;
    const KEY: u8 = 0x80;
    let [high, low] = (offset as i16).to_be_bytes();
    let head = [TRACK, high, low, if sample.is_key { KEY } else { 0 }];
    element(id::SIMPLE_BLOCK, &[&head, sample.data.as_slice()].concat())
}

/// The index: where each cluster begins, the first of them at `first`.
fn cues(clusters: &[(u64, Vec<u8>)], first: usize) -> Vec<u8> {
    let mut position = first as u64;
    let mut points = Vec::new();
    for (time, bytes) in clusters {
        let place = [number(id::CUE_TRACK, 1), number(id::CUE_CLUSTER_POSITION, position)];
        let point = [number(id::CUE_TIME, *time), master(id::CUE_TRACK_POSITIONS, &place)];
        points.push(master(id::CUE_POINT, &point));
        position += bytes.len() as u64;
    }
    master(id::CUES, &points)
}

fn master(id: u32, children: &[Vec<u8>]) -> Vec<u8> {
    element(id, &children.concat())
}

/// A number of eight bytes, so that its value changes no length.
fn number(id: u32, value: u64) -> Vec<u8> {
    element(id, &value.to_be_bytes())
}

/// An element: its identifier without leading zeros, its length in eight bytes, and what it holds.
fn element(id: u32, content: &[u8]) -> Vec<u8> {
    const EIGHT_BYTES: u64 = 1 << 56;
    let name = id.to_be_bytes();
    let skipped = name.iter().take_while(|byte| **byte == 0).count();
    let length = (EIGHT_BYTES | content.len() as u64).to_be_bytes();
    [&name[skipped..], &length, content].concat()
}
