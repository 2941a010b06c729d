//! AV1 by rav1e.

use lgs_core::Image;
use mp4_atom::{Av01, Av1c, Matrix};
use rav1e::prelude::{
    ChromaSampling, ColorDescription, ColorPrimaries, Config, Context, EncoderConfig, EncoderStatus,
    FrameType, MatrixCoefficients, PixelRange, Rational, TransferCharacteristics,
};

use crate::Video;
use crate::color::planes;
use crate::error::VideoError;
use crate::mp4::{Movie, mp4, visual};
use crate::spec::{VideoFormat, VideoSpec};
use crate::thresholds::{AV1_QUANTIZER, AV1_SPEED, KEY_FRAME_SECONDS, TILES};
use crate::track::{Sample, Track};
use crate::webm::webm;

/// A video of AV1 under way.
pub(crate) struct Av1 {
    spec: VideoSpec,
    context: Context<u8>,
    samples: Vec<Sample>,
}

impl Av1 {
    pub(crate) fn start(spec: VideoSpec) -> Result<Self, VideoError> {
        let config = Config::new().with_encoder_config(settings(&spec));
        let context = config.new_context().map_err(|error| VideoError::Av1(error.to_string()))?;
        Ok(Self { spec, context, samples: Vec::new() })
    }

    /// Takes what the encoder has finished.
    fn drain(&mut self) -> Result<(), VideoError> {
        loop {
            match self.context.receive_packet() {
                Ok(packet) => {
                    let is_key = packet.frame_type == FrameType::KEY;
                    self.samples.push(Sample { data: packet.data, is_key });
                }
                Err(EncoderStatus::Encoded) => {}
                Err(EncoderStatus::NeedMoreData | EncoderStatus::LimitReached) => return Ok(()),
                Err(error) => return Err(VideoError::Av1(error.to_string())),
            }
        }
    }
}

/// What decodes the samples; the fields of AV1CodecConfigurationRecord (AV1 in ISOBMFF, section 2.3.3).
fn sample_entry(track: &Track) -> Av01 {
    let [_, profile, flags, _] = track.configuration;
    let flag = |bit: u8| flags >> bit & 1 == 1;
    Av01 {
        visual: visual(&track.spec),
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

fn settings(spec: &VideoSpec) -> EncoderConfig {
    EncoderConfig {
        width: spec.width as usize,
        height: spec.height as usize,
        time_base: Rational::new(1, u64::from(spec.frames_per_second)),
        chroma_sampling: ChromaSampling::Cs420,
        pixel_range: PixelRange::Limited,
        color_description: Some(ColorDescription {
            color_primaries: ColorPrimaries::BT709,
            transfer_characteristics: TransferCharacteristics::SRGB,
            matrix_coefficients: MatrixCoefficients::BT709,
        }),
        quantizer: AV1_QUANTIZER,
        min_key_frame_interval: 1,
        max_key_frame_interval: u64::from(KEY_FRAME_SECONDS * spec.frames_per_second),
        tiles: TILES,
        ..EncoderConfig::with_speed_preset(AV1_SPEED)
    }
}

impl Video for Av1 {
    fn push(&mut self, frame: &Image) -> Result<(), VideoError> {
        let source = planes(&self.spec.rgb8(frame)?, self.spec.width as usize);
        let mut taken = self.context.new_frame();
        let [blue, red] = &source.chroma;
        taken.planes[0].copy_from_raw_u8(&source.luma, self.spec.width as usize, 1);
        taken.planes[1].copy_from_raw_u8(blue, source.chroma_width, 1);
        taken.planes[2].copy_from_raw_u8(red, source.chroma_width, 1);
        self.context.send_frame(taken).map_err(|error| VideoError::Av1(error.to_string()))?;
        self.drain()
    }

    fn finish(mut self: Box<Self>) -> Result<Vec<u8>, VideoError> {
        self.context.flush();
        self.drain()?;
        if self.samples.is_empty() {
            return Err(VideoError::Empty);
        }
        let record = self.context.container_sequence_header();
        let record = record.first_chunk().ok_or_else(|| VideoError::Av1("no sequence header".to_owned()))?;
        let track = Track { spec: self.spec, samples: self.samples, configuration: *record };
        match self.spec.format {
            VideoFormat::WebM => Ok(webm(&track)),
            VideoFormat::Mp4 | VideoFormat::Gif => mp4(&Movie {
                spec: track.spec,
                samples: &track.samples,
                codec: sample_entry(&track).into(),
                matrix: Matrix::default(),
            }),
        }
    }
}
