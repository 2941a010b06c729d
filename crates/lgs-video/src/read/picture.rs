//! Decoded pictures, and their colours. A pixel's chroma is interpolated linearly between the samples around
//! it, whose places the video tells; where it tells none they are those of MPEG-2, left and between lines.

use rust_h264::decoder::{ChromaFormat, Frame};

use super::look::Look;
use super::turn::Turn;

/// A frame of a video as a player shows it. Its colours are worked out when they are asked for, so that many
/// threads can do so.
#[derive(Debug)]
pub struct Picture {
    frame: Frame,
    look: Look,
    turn: Turn,
}

impl Picture {
    /// A picture, if the frame has all samples of its size.
    pub(super) fn of(frame: Frame, look: Look, turn: Turn) -> Option<Self> {
        let bytes = |width: u32, height: u32| width as usize * height as usize * frame.bytes_per_sample();
        let chroma = bytes(frame.chroma_width(), frame.chroma_height());
        let is_whole = frame.y.len() == bytes(frame.width, frame.height)
            && frame.u.len() == chroma
            && frame.v.len() == chroma
            && chroma > 0;
        is_whole.then_some(Self { frame, look, turn })
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.turn.size(self.stored()).map(|side| side as u32)
    }

    /// Red, green and blue of 8 bits each, row after row from the top.
    #[must_use]
    pub fn to_rgb8(&self) -> Vec<u8> {
        self.turn.apply(self.colours(), self.stored()).into_flattened()
    }

    /// Width and height of the frame before it is turned.
    fn stored(&self) -> [usize; 2] {
        [self.frame.width as usize, self.frame.height as usize]
    }

    fn colours(&self) -> Vec<[u8; 3]> {
        let frame = &self.frame;
        let ([width, height], levels) = (self.stored(), Levels::of(frame.bit_depth, &self.look));
        let stored = [frame.chroma_width() as usize, frame.chroma_height() as usize];
        let columns = taps(width, stored[0], Some(self.look.shift[0]));
        let is_halved = frame.chroma_format == ChromaFormat::Yuv420;
        let rows = taps(height, stored[1], is_halved.then_some(self.look.shift[1]));
        let mut pixels = Vec::with_capacity(width * height);
        let mut chroma = [(); 2].map(|()| vec![0.0; stored[0]]);
        for (y, row) in rows.iter().enumerate() {
            for (line, plane) in chroma.iter_mut().zip([&frame.u, &frame.v]) {
                for (x, value) in line.iter_mut().enumerate() {
                    *value = row.mix(|y| f32::from(frame.sample(plane, y * stored[0] + x)));
                }
            }
            pixels.extend(columns.iter().enumerate().map(|(x, column)| {
                let luma = f32::from(frame.sample(&frame.y, y * width + x));
                levels.colour(luma, [0, 1].map(|plane| column.mix(|x| chroma[plane][x])))
            }));
        }
        pixels
    }
}

/// Two neighbouring samples and the weight of the second.
struct Tap {
    samples: [usize; 2],
    weight: f32,
}

impl Tap {
    fn mix(&self, sample: impl Fn(usize) -> f32) -> f32 {
        let [first, second] = self.samples.map(sample);
        first + self.weight * (second - first)
    }
}

/// Where the values of a line of pixels come from: from a sample for each, or from one for two pixels whose
/// first is shifted by quarters of a sample.
fn taps(pixels: usize, samples: usize, shift: Option<usize>) -> Vec<Tap> {
    let last = samples - 1;
    let tap = |pixel: usize| {
        let Some(shift) = shift else { return Tap { samples: [pixel.min(last); 2], weight: 0.0 } };
        // One sample more, so that nothing is below zero.
        let quarters = 4 + 2 * pixel - shift;
        let [first, second] = [0, 1].map(|further| (quarters / 4 + further).saturating_sub(1).min(last));
        Tap { samples: [first, second], weight: (quarters % 4) as f32 / 4.0 }
    };
    (0..pixels).map(tap).collect()
}

/// What samples stand for, as numbers of 0 to 255.
struct Levels {
    /// The sample of black, and 255 over the range of luma.
    luma: [f32; 2],
    /// The sample of grey, and 255 over the range of chroma.
    chroma: [f32; 2],
    /// Red by the second difference, green by both, blue by the first.
    red: f32,
    green: [f32; 2],
    blue: f32,
}

impl Levels {
    fn of(bits: u8, look: &Look) -> Self {
        let steps = f32::from(1_u16 << (bits - 8));
        let all = 256.0 * steps - 1.0;
        let [black, range] = if look.is_full { [0.0, all] } else { [16.0 * steps, 219.0 * steps] };
        let chroma_range = if look.is_full { all } else { 224.0 * steps };
        let [red, blue] = look.weights;
        let green = 1.0 - red - blue;
        Self {
            luma: [black, 255.0 / range],
            chroma: [128.0 * steps, 255.0 / chroma_range],
            red: 2.0 * (1.0 - red),
            green: [blue, red].map(|weight| -2.0 * weight * (1.0 - weight) / green),
            blue: 2.0 * (1.0 - blue),
        }
    }

    fn colour(&self, luma: f32, chroma: [f32; 2]) -> [u8; 3] {
        let luma = (luma - self.luma[0]) * self.luma[1];
        let [first, second] = chroma.map(|value| (value - self.chroma[0]) * self.chroma[1]);
        let green = luma + self.green[0] * first + self.green[1] * second;
        // A cast keeps to 0 to 255.
        [luma + self.red * second, green, luma + self.blue * first].map(|value| (value + 0.5) as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::look::tests::info;
    use mp4_atom::Matrix;
    use rust_h264::nal::SpsInfo;

    /// A picture of 4 × 2 pixels whose chroma is the same in a column.
    fn picture(info: &SpsInfo, luma: u16, columns: [[u16; 2]; 2]) -> Picture {
        let bytes = |samples: Vec<u16>| -> Vec<u8> {
            let wide = info.bit_depth_luma > 8;
            samples.iter().flat_map(|s| s.to_le_bytes().into_iter().take(1 + usize::from(wide))).collect()
        };
        let chroma_format = [ChromaFormat::Yuv420, ChromaFormat::Yuv422][info.chroma_format as usize - 1];
        let [u, v] = columns.map(|columns| bytes(columns.repeat(info.chroma_format as usize)));
        let (y, bit_depth) = (bytes(vec![luma; 8]), info.bit_depth_luma as u8);
        let frame = Frame { width: 4, height: 2, y, u, v, pic_order_cnt: 0, chroma_format, bit_depth };
        Picture::of(frame, Look::of(info).unwrap(), Turn::of(&Matrix::default())).unwrap()
    }

    fn first(info: &SpsInfo, [y, u, v]: [u16; 3]) -> [u8; 3] {
        *picture(info, y, [[u; 2], [v; 2]]).to_rgb8().first_chunk().unwrap()
    }

    #[test]
    fn colours_are_those_of_the_standards() {
        let hd = SpsInfo { matrix: 1, ..info() };
        assert_eq!(first(&hd, [16, 128, 128]), [0; 3]);
        assert_eq!(first(&hd, [235, 128, 128]), [255; 3]);
        assert_eq!(first(&hd, [63, 102, 240]), [255, 1, 0], "red of BT.709");
        assert_eq!(first(&SpsInfo { matrix: 6, ..hd }, [81, 90, 240]), [254, 0, 0], "red of BT.601");
        assert_eq!(first(&SpsInfo { matrix: 9, ..hd }, [74, 97, 240]), [255, 0, 1], "red of BT.2020");
        assert_eq!(first(&SpsInfo { full_range: true, ..hd }, [54, 99, 255]), [254, 0, 0]);
        let deep = SpsInfo { bit_depth_luma: 10, bit_depth_chroma: 10, ..hd };
        assert_eq!(first(&deep, [4 * 63, 4 * 102, 4 * 240]), [255, 1, 0]);
        assert_eq!(first(&SpsInfo { full_range: true, ..deep }, [1023, 512, 512]), [255; 3]);
        assert_eq!(first(&SpsInfo { chroma_format: 2, ..hd }, [63, 102, 240]), [255, 1, 0]);
    }

    #[test]
    fn without_a_matrix_the_height_decides() {
        let unknown = |height| Look::of(&SpsInfo { height, ..info() }).unwrap().weights;
        assert_eq!((unknown(719), unknown(720)), ([0.299, 0.114], [0.2126, 0.0722]));
    }

    #[test]
    fn chroma_is_interpolated_from_where_it_lies() {
        // Full range and no weights but those of chroma: red is 1.5748 of the second difference over grey.
        let of = |chroma_location| {
            let info = SpsInfo { chroma_location, full_range: true, matrix: 1, ..info() };
            let rgb = picture(&info, 100, [[128; 2], [128, 168]]).to_rgb8();
            [0, 1, 2, 3].map(|x| rgb[3 * x])
        };
        assert_eq!(of(0), [100, 131, 163, 163], "on every second pixel");
        assert_eq!(of(1), [100, 116, 147, 163], "between two pixels");
    }

    #[test]
    fn rows_of_chroma_lie_where_the_video_says() {
        let weights = |shift| -> Vec<f32> {
            taps(4, 2, Some(shift)).iter().map(|tap| tap.mix(|sample| sample as f32)).collect()
        };
        assert_eq!(weights(0), [0.0, 0.5, 1.0, 1.0]);
        assert_eq!(weights(1), [0.0, 0.25, 0.75, 1.0]);
        assert_eq!(weights(2), [0.0, 0.0, 0.5, 1.0]);
        assert!(taps(5, 2, Some(1)).iter().all(|tap| tap.samples[1] < 2), "an odd number of pixels");
    }
}
