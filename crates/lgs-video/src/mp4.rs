//! A track as an MP4 file, its index first so that it plays while it loads.

use mp4_atom::{
    Av01, Av1c, Codec, Compressor, Dinf, Dref, DrefEntry, Encode, FixedPoint, FourCC, Ftyp, Hdlr, Mdat, Mdhd,
    Mdia, Minf, Moov, Mvhd, Stbl, Stco, Stsc, StscEntry, Stsd, Stss, Stsz, StszSamples, Stts, SttsEntry,
    Tkhd, Trak, Url, Visual, Vmhd,
};

use crate::error::VideoError;
use crate::thresholds::TICKS_PER_FRAME;
use crate::track::Track;

/// Resolution that players ignore, dots per inch, as the format asks for one.
const DOTS_PER_INCH: u16 = 72;

/// The bytes of the file.
pub(crate) fn mp4(track: &Track) -> Result<Vec<u8>, VideoError> {
    let mut bytes = Vec::new();
    let brands = [b"isom", b"iso6", b"av01", b"mp41"].map(FourCC::new).to_vec();
    Ftyp { major_brand: FourCC::new(b"isom"), minor_version: 0, compatible_brands: brands }
        .encode(&mut bytes)?;
    let data: Vec<u8> = track.samples.iter().flat_map(|sample| &sample.data).copied().collect();
    // The index has the same length whatever it says of where the samples begin.
    let mut index = Vec::new();
    moov(track, 0).encode(&mut index)?;
    const HEADER_OF_DATA: usize = 8;
    let first = bytes.len() + index.len() + HEADER_OF_DATA;
    moov(track, first as u32).encode(&mut bytes)?;
    Mdat { data }.encode(&mut bytes)?;
    Ok(bytes)
}

/// The index of the file, with its samples from byte `first` on.
fn moov(track: &Track, first: u32) -> Moov {
    let timescale = track.spec.frames_per_second * TICKS_PER_FRAME;
    let duration = track.samples.len() as u64 * u64::from(TICKS_PER_FRAME);
    let rate: FixedPoint<u16> = 1.into();
    let [width, height] = [track.spec.width as u16, track.spec.height as u16];
    Moov {
        mvhd: Mvhd { timescale, duration, rate, next_track_id: 2, ..Mvhd::default() },
        trak: vec![Trak {
            tkhd: Tkhd {
                track_id: 1,
                duration,
                enabled: true,
                in_movie: true,
                width: width.into(),
                height: height.into(),
                ..Tkhd::default()
            },
            mdia: Mdia {
                mdhd: Mdhd { timescale, duration, language: "und".to_owned(), ..Mdhd::default() },
                hdlr: Hdlr { handler: FourCC::new(b"vide"), name: "video".to_owned() },
                minf: Minf {
                    vmhd: Some(Vmhd::default()),
                    // The samples are in the file itself.
                    dinf: Dinf { dref: Dref { entries: vec![DrefEntry::Url(Url::default())] } },
                    stbl: samples(track, first),
                    ..Minf::default()
                },
            },
            ..Trak::default()
        }],
        ..Moov::default()
    }
}

/// Where and when the samples are: one chunk of all.
fn samples(track: &Track, first: u32) -> Stbl {
    let count = track.samples.len() as u32;
    let keys = (1..).zip(&track.samples).filter(|(_, sample)| sample.is_key).map(|(number, _)| number);
    let sizes = track.samples.iter().map(|sample| sample.data.len() as u32).collect();
    Stbl {
        stsd: Stsd { codecs: vec![Codec::from(codec(track))] },
        stts: Stts { entries: vec![SttsEntry { sample_count: count, sample_delta: TICKS_PER_FRAME }] },
        stss: Some(Stss { entries: keys.collect() }),
        stsc: Stsc {
            entries: vec![StscEntry {
                first_chunk: 1,
                samples_per_chunk: count,
                sample_description_index: 1,
            }],
        },
        stsz: Stsz { samples: StszSamples::Different { sizes } },
        stco: Some(Stco { entries: vec![first] }),
        ..Stbl::default()
    }
}

/// What decodes the samples; the fields of AV1CodecConfigurationRecord (AV1 in ISOBMFF, section 2.3.3).
fn codec(track: &Track) -> Av01 {
    let [_, profile, flags, _] = track.configuration;
    let flag = |bit: u8| flags >> bit & 1 == 1;
    Av01 {
        visual: Visual {
            data_reference_index: 1,
            width: track.spec.width as u16,
            height: track.spec.height as u16,
            horizresolution: DOTS_PER_INCH.into(),
            vertresolution: DOTS_PER_INCH.into(),
            frame_count: 1,
            compressor: Compressor::default(),
            depth: 24,
        },
        av1c: Av1c {
            seq_profile: profile >> 5,
            seq_level_idx_0: profile & 0x1f,
            seq_tier_0: flag(7),
            high_bitdepth: flag(6),
            twelve_bit: flag(5),
            monochrome: flag(4),
            chroma_subsampling_x: flag(3),
            chroma_subsampling_y: flag(2),
            chroma_sample_position: flags & 3,
            initial_presentation_delay: None,
            config_obus: Vec::new(),
        },
        btrt: None,
        ccst: None,
        colr: None,
        pasp: None,
        taic: None,
        spatial: None,
    }
}
