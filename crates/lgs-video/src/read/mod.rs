//! Frames of H.264 videos in MP4 and MOV files.
//!
//! ```no_run
//! for picture in lgs_video::read::frames(std::fs::File::open("cam00.mp4")?)? {
//!     let picture = picture?;
//!     println!("{:?} pixels, {} bytes", picture.size(), picture.to_rgb8().len());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Every frame comes as it is, in the order in which frames are shown, one at a time: a file is never in
//! memory as a whole, nor are its frames. Frames are turned upright as the file asks for. Matrix and range
//! are those that the video names; without a matrix it is that of BT.709 from 720 lines on and of BT.601
//! below. A pixel's chroma is interpolated linearly between samples, whose places the video names too.
//! Not regarded are lists of edits, which hide frames from players, shapes of pixels, and tone curves of high
//! dynamic range; fields of interlaced video stay woven.
//!
//! 8 and 10 bits, 4:2:0, 4:2:2 and grey are read, whole or in fragments. What is not is an error that
//! [`DecodeError::is_of_another_kind`] tells from a damaged file.

mod boxes;
mod error;
mod look;
mod picture;
mod samples;
mod track;
mod turn;

use std::collections::VecDeque;
use std::io::{Read, Seek, SeekFrom};

use rust_h264::decoder::{Frame, OrderedDecoder};
use rust_h264::error::DecodeError as Refusal;
use rust_h264::nal::{NalUnit, NalUnitType, parse_avcc, parse_avcc_config, parse_sps_info};

use look::Look;
use samples::Sample;
use track::Track;

pub use error::DecodeError;
pub use picture::Picture;

/// The frames of a video, decoded one after the other. The first error is the last item.
pub struct Frames<R> {
    file: R,
    /// Bytes of the file.
    length: u64,
    track: Track,
    /// Bytes of the length of a unit in a sample.
    length_size: usize,
    decoder: OrderedDecoder,
    look: Option<Look>,
    size: Option<[u32; 2]>,
    /// Samples that have been decoded.
    begun: usize,
    ready: VecDeque<Picture>,
    handed_over: usize,
    is_over: bool,
    failure: Option<DecodeError>,
}

/// Opens a video: the first video track of the file, which has to be H.264.
///
/// # Errors
/// If the file cannot be read, is of another kind, or its index is damaged.
pub fn frames<R: Read + Seek>(mut file: R) -> Result<Frames<R>, DecodeError> {
    let length = file.seek(SeekFrom::End(0))?;
    let track = Track::of(&boxes::describe(&mut file, length)?)?;
    let configuration = track.configuration.clone();
    let parsed = parse_avcc_config(&configuration).map_err(|defect| error::index(format!("has {defect}")))?;
    let mut frames = Frames {
        file,
        length,
        track,
        length_size: parsed.length_size,
        decoder: OrderedDecoder::new(),
        look: None,
        size: None,
        begun: 0,
        ready: VecDeque::new(),
        handed_over: 0,
        is_over: false,
        failure: None,
    };
    for unit in parsed.sps_nals.iter().chain(&parsed.pps_nals) {
        frames.decode(unit, None)?;
    }
    Ok(frames)
}

impl<R: Read + Seek> Frames<R> {
    /// Number of frames that the file's index lists.
    #[must_use]
    pub fn listed(&self) -> usize {
        self.track.samples.len()
    }

    /// Decodes the next sample, or ends.
    fn advance(&mut self) {
        let outcome = match self.track.samples.get(self.begun).copied() {
            Some(sample) => self.decode_sample(sample),
            None => return self.end(None),
        };
        match outcome {
            Ok(()) => self.begun += 1,
            Err(error) => self.end(Some(error)),
        }
    }

    /// Takes the last frames out of the decoder.
    fn end(&mut self, defect: Option<DecodeError>) {
        let last = self.decoder.flush();
        let taken = self.take(last);
        self.is_over = true;
        let [expected, decoded] = [self.listed(), self.handed_over + self.ready.len()];
        let missing = || self.ended_early("the stream has no more");
        self.failure = defect.or(taken.err()).or_else(|| (decoded < expected).then(missing));
        if let Some(DecodeError::EndsEarly { decoded: counted, .. }) = &mut self.failure {
            *counted = decoded;
        }
    }

    fn ended_early(&self, reason: impl Into<String>) -> DecodeError {
        let [expected, decoded] = [self.listed(), self.handed_over + self.ready.len()];
        DecodeError::EndsEarly { expected, decoded, reason: reason.into() }
    }

    fn decode_sample(&mut self, sample: Sample) -> Result<(), DecodeError> {
        let (number, end) = (self.begun, sample.start.saturating_add(sample.size.into()));
        if end > self.length {
            let length = self.length;
            return Err(self.ended_early(format!(
                "frame {number} goes to byte {end} of a file of {length}, which was cut off"
            )));
        }
        self.file.seek(SeekFrom::Start(sample.start))?;
        let mut bytes = vec![0; sample.size as usize];
        self.file.read_exact(&mut bytes)?;
        if !is_whole(&bytes, self.length_size) {
            return Err(self.ended_early(format!("frame {number} has parts that are longer than itself")));
        }
        parse_avcc(&bytes, self.length_size).iter().try_for_each(|unit| self.decode(unit, Some(number)))
    }

    /// Decodes a unit of a frame, or one that the index has for all.
    fn decode(&mut self, unit: &NalUnit, number: Option<usize>) -> Result<(), DecodeError> {
        let refused = |error: Refusal, frames: &Self| match (error, number) {
            (Refusal::Unsupported(what), _) => DecodeError::Unsupported(what.to_owned()),
            (other, Some(number)) => frames.ended_early(format!("frame {number}: {other}")),
            (other, None) => error::index(format!("has a parameter set with a defect: {other}")),
        };
        if unit.nal_unit_type == NalUnitType::Sps {
            // The size is checked before the decoder makes room for it.
            let info = parse_sps_info(unit).map_err(|error| refused(error, self))?;
            self.look = Some(Look::of(&info)?);
        }
        let shown = self.decoder.decode_nal(unit).map_err(|error| refused(error, self))?;
        self.take(shown)
    }

    /// Makes pictures of frames.
    fn take(&mut self, frames: Vec<Frame>) -> Result<(), DecodeError> {
        for frame in frames {
            let size = *self.size.get_or_insert([frame.width, frame.height]);
            if size != [frame.width, frame.height] {
                return Err(DecodeError::Unsupported("frames of several sizes".to_owned()));
            }
            let picture = self.look.and_then(|look| Picture::of(frame, look, self.track.turn));
            let lacks = || self.ended_early("a frame lacks samples");
            let picture = picture.ok_or_else(lacks)?;
            self.ready.push_back(picture);
        }
        Ok(())
    }
}

/// Whether the units of a sample end where it does.
fn is_whole(mut sample: &[u8], length_size: usize) -> bool {
    while sample.len() >= length_size {
        let (length, rest) = sample.split_at(length_size);
        let length = length.iter().fold(0, |sum, &byte| sum << 8 | usize::from(byte));
        let Some(after) = rest.get(length..) else { return false };
        sample = after;
    }
    true
}

impl<R: Read + Seek> Iterator for Frames<R> {
    type Item = Result<Picture, DecodeError>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.ready.is_empty() && !self.is_over {
            self.advance();
        }
        match self.ready.pop_front() {
            Some(picture) => {
                self.handed_over += 1;
                Some(Ok(picture))
            }
            None => self.failure.take().map(Err),
        }
    }
}
