//! A track as an MP4 file, its index first so that it plays while it loads.

use mp4_atom::{
    Codec, Compressor, Dinf, Dref, DrefEntry, Encode, FixedPoint, FourCC, Ftyp, Hdlr, Matrix, Mdat, Mdhd,
    Mdia, Minf, Moov, Mvhd, Stbl, Stco, Stsc, StscEntry, Stsd, Stss, Stsz, StszSamples, Stts, SttsEntry,
    Tkhd, Trak, Url, Visual, Vmhd,
};

use crate::error::VideoError;
use crate::spec::VideoSpec;
use crate::thresholds::TICKS_PER_FRAME;
use crate::track::Sample;

/// Resolution that players ignore, dots per inch, as the format asks for one.
const DOTS_PER_INCH: u16 = 72;

/// What an MP4 file holds.
pub(crate) struct Movie<'a> {
    pub(crate) spec: VideoSpec,
    pub(crate) samples: &'a [Sample],
    pub(crate) codec: Codec,
    /// How a player turns the frames.
    pub(crate) matrix: Matrix,
}

/// The bytes of the file.
pub(crate) fn mp4(movie: &Movie) -> Result<Vec<u8>, VideoError> {
    let mut bytes = Vec::new();
    let codec = if matches!(movie.codec, Codec::Av01(_)) { b"av01" } else { b"avc1" };
    let brands = [b"isom", b"iso6", codec, b"mp41"].map(FourCC::new).to_vec();
    Ftyp { major_brand: FourCC::new(b"isom"), minor_version: 0, compatible_brands: brands }
        .encode(&mut bytes)?;
    let data: Vec<u8> = movie.samples.iter().flat_map(|sample| &sample.data).copied().collect();
    // The index has the same length whatever it says of where the samples begin.
    let mut index = Vec::new();
    moov(movie, 0).encode(&mut index)?;
    const HEADER_OF_DATA: usize = 8;
    let first = bytes.len() + index.len() + HEADER_OF_DATA;
    moov(movie, first as u32).encode(&mut bytes)?;
    Mdat { data }.encode(&mut bytes)?;
    Ok(bytes)
}

/// The part of a sample entry that all codecs have.
pub(crate) fn visual(spec: &VideoSpec) -> Visual {
    Visual {
        data_reference_index: 1,
        width: spec.width as u16,
        height: spec.height as u16,
        horizresolution: DOTS_PER_INCH.into(),
        vertresolution: DOTS_PER_INCH.into(),
        frame_count: 1,
        compressor: Compressor::default(),
        depth: 24,
    }
}

/// The index of the file, with its samples from byte `first` on.
fn moov(movie: &Movie, first: u32) -> Moov {
    let timescale = movie.spec.frames_per_second * TICKS_PER_FRAME;
    let duration = movie.samples.len() as u64 * u64::from(TICKS_PER_FRAME);
    let rate: FixedPoint<u16> = 1.into();
    let [width, height] = [movie.spec.width as u16, movie.spec.height as u16];
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
                matrix: movie.matrix.clone(),
                ..Tkhd::default()
            },
            mdia: Mdia {
                mdhd: Mdhd { timescale, duration, language: "und".to_owned(), ..Mdhd::default() },
                hdlr: Hdlr { handler: FourCC::new(b"vide"), name: "video".to_owned() },
                minf: Minf {
                    vmhd: Some(Vmhd::default()),
                    // The samples are in the file itself.
                    dinf: Dinf { dref: Dref { entries: vec![DrefEntry::Url(Url::default())] } },
                    stbl: samples(movie, first),
                    ..Minf::default()
                },
            },
            ..Trak::default()
        }],
        ..Moov::default()
    }
}

/// Where and when the samples are: one chunk of all.
fn samples(movie: &Movie, first: u32) -> Stbl {
    let count = movie.samples.len() as u32;
    let keys = (1..).zip(movie.samples).filter(|(_, sample)| sample.is_key).map(|(number, _)| number);
    let sizes = movie.samples.iter().map(|sample| sample.data.len() as u32).collect();
    Stbl {
        stsd: Stsd { codecs: vec![movie.codec.clone()] },
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
