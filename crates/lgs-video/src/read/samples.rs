//! Where in the file the samples of a track are: tables of the index (ISO/IEC 14496-12, section 8.7), and
//! runs of the fragments behind it (section 8.8).

use mp4_atom::{Co64, Stco, Stsc, Stsz, StszSamples, Tfhd, Trex, Trun};

use super::boxes::{boxes, value, values};
use super::error::{DecodeError, index};
use crate::thresholds::MOST_FRAMES;

/// The place of a coded frame in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sample {
    /// Bytes of the file before it.
    pub(super) start: u64,
    /// Bytes.
    pub(super) size: u32,
}

/// Samples in the order in which they are decoded.
#[derive(Default)]
pub(super) struct Samples(pub(super) Vec<Sample>);

impl Samples {
    /// Adds a sample, and says where it ends.
    fn push(&mut self, start: u64, size: u32) -> Result<u64, DecodeError> {
        if self.0.len() >= MOST_FRAMES {
            return Err(index(format!("lists more than {MOST_FRAMES} frames")));
        }
        self.0.push(Sample { start, size });
        start.checked_add(size.into()).ok_or_else(|| index("has places beyond any file"))
    }

    /// The samples that the tables of a track (`stbl`) list.
    pub(super) fn of_tables(tables: &[u8]) -> Result<Self, DecodeError> {
        let sizes = values::<Stsz>(tables, &[b"stsz"])?;
        let sizes = sizes.ok_or_else(|| DecodeError::Unsupported("no `stsz` in its index".to_owned()))?;
        let count = match &sizes.samples {
            StszSamples::Identical { count, .. } => *count as usize,
            StszSamples::Different { sizes } => sizes.len(),
        };
        let size = |number: usize| match &sizes.samples {
            StszSamples::Identical { size, .. } => *size,
            StszSamples::Different { sizes } => sizes[number],
        };
        let chunks = match values::<Co64>(tables, &[b"co64"])? {
            Some(wide) => wide.entries,
            None => {
                let narrow = values::<Stco>(tables, &[b"stco"])?.unwrap_or_default();
                narrow.entries.into_iter().map(u64::from).collect()
            }
        };
        let mut found = Self::default();
        for (start, samples) in filled(&chunks, tables)? {
            let mut at = start;
            for _ in 0..samples.min(count - found.0.len()) {
                at = found.push(at, size(found.0.len()))?;
            }
        }
        if found.0.len() < count {
            return Err(index(format!("lists {count} frames and has places for {}", found.0.len())));
        }
        Ok(found)
    }

    /// Adds the samples of a fragment, the content of the `moof` at a place of the file.
    pub(super) fn add_fragment(&mut self, moof: &(u64, Vec<u8>), defaults: &Trex) -> Result<(), DecodeError> {
        let (place, content) = moof;
        let tracks = boxes(content).filter(|(name, _)| name == b"traf");
        for (number, (_, run)) in tracks.enumerate() {
            let head =
                values::<Tfhd>(run, &[b"tfhd"])?.ok_or_else(|| index("has a `traf` without `tfhd`"))?;
            if head.track_id != defaults.track_id {
                continue;
            }
            one_description(head.sample_description_index.unwrap_or(1))?;
            let base = match head.base_data_offset {
                Some(base) => base,
                None if head.default_base_is_moof || number == 0 => *place,
                // Behind the data of the track before.
                None => return Err(DecodeError::Unsupported("fragments without places".to_owned())),
            };
            let default_size = head.default_sample_size.unwrap_or(defaults.default_sample_size);
            let mut at = base;
            for (_, own) in boxes(run).filter(|(name, _)| name == b"trun") {
                let run: Trun = value(own)?;
                if let Some(offset) = run.data_offset {
                    let start = base.checked_add_signed(offset.into());
                    at = start.ok_or_else(|| index("has places before the file"))?;
                }
                for sample in &run.samples {
                    at = self.push(at, sample.size.unwrap_or(default_size))?;
                }
            }
        }
        Ok(())
    }
}

/// The chunks of a track, as where each begins and how many samples it has.
fn filled(chunks: &[u64], tables: &[u8]) -> Result<Vec<(u64, usize)>, DecodeError> {
    let runs = values::<Stsc>(tables, &[b"stsc"])?.unwrap_or_default().entries;
    let mut found = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        one_description(run.sample_description_index)?;
        let end =
            runs.get(number + 1).map_or(chunks.len(), |next| next.first_chunk.saturating_sub(1) as usize);
        let own = (run.first_chunk as usize).checked_sub(1).and_then(|first| chunks.get(first..end));
        let own = own.ok_or_else(|| index("has chunks (`stsc`) that have no place"))?;
        found.extend(own.iter().map(|&start| (start, run.samples_per_chunk as usize)));
    }
    Ok(found)
}

/// Frames of a track that are described in several ways come from editing programs alone.
fn one_description(number: u32) -> Result<(), DecodeError> {
    if number == 1 { Ok(()) } else { Err(DecodeError::Unsupported("several descriptions".to_owned())) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mp4_atom::{Encode, StscEntry, TrunEntry};

    fn encoded(atom: &impl Encode) -> Vec<u8> {
        let mut bytes = Vec::new();
        atom.encode(&mut bytes).unwrap();
        bytes
    }

    fn tables(chunks: &[u32], runs: &[[u32; 2]], samples: StszSamples) -> Vec<u8> {
        let entry = |&[first_chunk, samples_per_chunk]: &[u32; 2]| StscEntry {
            first_chunk,
            samples_per_chunk,
            sample_description_index: 1,
        };
        let runs = Stsc { entries: runs.iter().map(entry).collect() };
        let chunks = Stco { entries: chunks.to_vec() };
        [encoded(&Stsz { samples }), encoded(&runs), encoded(&chunks)].concat()
    }

    fn listed(chunks: &[u32], runs: &[[u32; 2]], sizes: &[u32]) -> Result<Vec<[u64; 2]>, String> {
        let sizes = StszSamples::Different { sizes: sizes.to_vec() };
        let samples = Samples::of_tables(&tables(chunks, runs, sizes)).map_err(|error| error.to_string())?;
        Ok(samples.0.iter().map(|sample| [sample.start, sample.size.into()]).collect())
    }

    #[test]
    fn chunks_hold_their_samples_one_after_the_other() {
        let found = listed(&[100, 200, 300], &[[1, 2], [3, 1]], &[5, 6, 7, 8, 9]).unwrap();
        assert_eq!(found, [[100, 5], [105, 6], [200, 7], [207, 8], [300, 9]]);
    }

    #[test]
    fn tables_that_do_not_fit_together_are_errors() {
        let refused = |chunks: &[u32], runs: &[[u32; 2]]| listed(chunks, runs, &[5, 6, 7]).unwrap_err();
        assert!(refused(&[100], &[[1, 2]]).contains("lists 3 frames and has places for 2"));
        for runs in [&[[0, 3]][..], &[[4, 3]], &[[2, 1], [1, 1]], &[[1, 1], [9, 1]]] {
            assert!(refused(&[100, 200], runs).contains("no place"), "{runs:?}");
        }
        let endless = StszSamples::Identical { count: u32::MAX, size: 1 };
        let error = Samples::of_tables(&tables(&[0], &[[1, u32::MAX]], endless)).map(drop).unwrap_err();
        assert!(error.to_string().contains("lists more than"), "{error}");
    }

    #[test]
    fn fragments_add_samples_of_their_track() {
        let run = |track_id: u32, data_offset: Option<i32>, sizes: &[Option<u32>]| {
            let entry = |&size: &Option<u32>| TrunEntry { size, duration: Some(1), ..TrunEntry::default() };
            let samples = sizes.iter().map(entry).collect::<Vec<_>>().into();
            let head = Tfhd { track_id, default_base_is_moof: true, ..Tfhd::default() };
            let content = [encoded(&head), encoded(&Trun { data_offset, samples })].concat();
            [&(8 + content.len() as u32).to_be_bytes(), &b"traf"[..], &content].concat()
        };
        let moof = [run(2, Some(70), &[Some(1)]), run(1, Some(80), &[Some(5), Some(6)])].concat();
        let defaults = Trex { track_id: 1, default_sample_size: 9, ..Trex::default() };
        let mut samples = Samples::default();
        samples.add_fragment(&(1000, moof), &defaults).unwrap();
        samples.add_fragment(&(2000, run(1, None, &[None])), &defaults).unwrap();
        let sample = |start, size| Sample { start, size };
        assert_eq!(samples.0, [sample(1080, 5), sample(1085, 6), sample(2000, 9)]);
        assert!(samples.add_fragment(&(10, run(1, Some(-20), &[None])), &defaults).is_err());
    }
}
