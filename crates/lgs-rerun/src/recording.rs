//! The file of a recording, written with rerun's own encoder.

use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use lgs_data::files::{FileError, GrowingFile};
use lgs_data::hash::ContentHash;
use re_build_info::CrateVersion;
use re_chunk::{Chunk, ChunkBuilder, ChunkId, RowId};
use re_log_encoding::{Encoder, EncodingOptions};
use re_log_types::external::re_tuid::Tuid;
use re_log_types::{
    ApplicationId, EntityPath, EntityPathPart, LogMsg, SetStoreInfo, StoreId, StoreInfo, StoreSource,
    TimeCell, TimePoint,
};
use re_sdk_types::AsComponents;
use re_sdk_types::archetypes::RecordingInfo;

use crate::archetypes::components;
use crate::content::{Content, When};
use crate::error::RerunError;
use crate::thresholds::{NANOSECONDS_PER_UNIT, NUMBERS_AT_ONCE};

/// Name under which rerun's viewer files all recordings of the program.
const APPLICATION: &str = "lagrangegs";

/// A recording under way. It can be opened while it grows, as `STEM.part.rrd`, and gets its own name at its
/// end; dropped before, it is removed.
pub struct Recording {
    path: PathBuf,
    encoder: Encoder<BufWriter<GrowingFile>>,
    store: StoreId,
    ids: Ids,
    /// Numbers of curves that wait to be written together.
    gathered: BTreeMap<String, Vec<(When, f64)>>,
}

impl Recording {
    /// Begins a recording with a title; `about` are bytes by which it is told apart from all others.
    ///
    /// # Errors
    /// If the name does not end with `.rrd`, is that of something other than a file, or nothing can be
    /// written there.
    pub fn begin(path: &Path, title: &str, about: &[u8]) -> Result<Self, RerunError> {
        if path.extension().is_none_or(|ending| ending != "rrd") {
            return Err(RerunError::Name { path: path.to_owned() });
        }
        let mut hash = ContentHash::default();
        [title.as_bytes(), path.file_name().unwrap_or_default().as_encoded_bytes(), about]
            .iter()
            .for_each(|part| hash.add(part));
        let id = hash.short();
        let application = ApplicationId::try_new(APPLICATION).map_err(|e| refused(path, &e))?;
        let store = StoreId::recording(application, format!("{title}-{id}"));
        let file = BufWriter::new(GrowingFile::begin(path)?);
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let encoder =
            Encoder::new_eager(CrateVersion::LOCAL, options, file).map_err(|e| refused(path, &e))?;
        let ids = Ids { first: u64::from_str_radix(&id, 16).unwrap_or_default() >> 1, next: 0 };
        let mut recording = Self { path: path.to_owned(), encoder, store, ids, gathered: BTreeMap::new() };
        recording.introduce(title)?;
        Ok(recording)
    }

    /// What every recording begins with.
    fn introduce(&mut self, title: &str) -> Result<(), RerunError> {
        let source = StoreSource::Other(APPLICATION.to_owned());
        let info = StoreInfo::new(self.store.clone(), source);
        let row_id = self.ids.next();
        self.append(&LogMsg::SetStoreInfo(SetStoreInfo { row_id, info }))?;
        let properties = RecordingInfo::new().with_name(title).as_serialized_batches();
        let (row, builder) = self.chunk(EntityPath::properties());
        self.write(builder.with_serialized_batches(row, TimePoint::default(), properties))?;
        self.flush()
    }

    /// Records something of an entity, whose path has slashes between its parts.
    pub(crate) fn log(&mut self, entity: &str, when: When, content: &Content<'_>) -> Result<(), RerunError> {
        if let Content::Number(value) = *content {
            let numbers = self.gathered.entry(entity.to_owned()).or_default();
            numbers.push((when, value));
            return if numbers.len() < NUMBERS_AT_ONCE { Ok(()) } else { self.write_gathered() };
        }
        let (row, builder) = self.chunk(path_of(entity));
        self.write(builder.with_serialized_batches(row, time_point(when), components(content)))
    }

    /// Hands everything over to the file system.
    pub(crate) fn flush(&mut self) -> Result<(), RerunError> {
        self.write_gathered()?;
        self.encoder.flush_blocking().map_err(|e| refused(&self.path, &e))
    }

    /// Ends the recording and gives it its name; returns its size in bytes.
    pub(crate) fn finish(mut self) -> Result<u64, RerunError> {
        self.write_gathered()?;
        let path = self.path;
        self.encoder.finish().map_err(|e| refused(&path, &e))?;
        let mut file = self.encoder.into_inner().map_err(|e| refused(&path, &e))?;
        file.flush().map_err(|e| FileError::new("write file", &path, e))?;
        let file = file.into_inner().map_err(|e| FileError::new("write file", &path, e.into_error()))?;
        file.finish()?;
        Ok(std::fs::metadata(&path).map_err(|e| FileError::new("read file", &path, e))?.len())
    }

    fn write_gathered(&mut self) -> Result<(), RerunError> {
        for (entity, numbers) in std::mem::take(&mut self.gathered) {
            let (mut row, mut builder) = self.chunk(path_of(&entity));
            for (when, value) in numbers {
                let batches = components(&Content::Number(value));
                builder = builder.with_serialized_batches(row, time_point(when), batches);
                row = RowId::from_tuid(self.ids.next());
            }
            self.write(builder)?;
        }
        Ok(())
    }

    /// A chunk of an entity, and the number of its first row.
    fn chunk(&mut self, entity: EntityPath) -> (RowId, ChunkBuilder) {
        let id = ChunkId::from_tuid(self.ids.next());
        (RowId::from_tuid(self.ids.next()), Chunk::builder_with_id(id, entity))
    }

    fn write(&mut self, chunk: ChunkBuilder) -> Result<(), RerunError> {
        let message = chunk.build().and_then(|chunk| chunk.to_arrow_msg());
        let message = message.map_err(|e| refused(&self.path, &e))?;
        self.append(&LogMsg::ArrowMsg(self.store.clone(), message))
    }

    fn append(&mut self, message: &LogMsg) -> Result<(), RerunError> {
        self.encoder.append(message).map(drop).map_err(|e| refused(&self.path, &e))
    }
}

/// Numbers of chunks and rows in the order of writing; those of different recordings differ.
struct Ids {
    first: u64,
    next: u64,
}

impl Ids {
    fn next(&mut self) -> Tuid {
        self.next += 1;
        Tuid::from_nanos_and_inc(self.first, self.next)
    }
}

fn refused(path: &Path, reason: &dyn std::fmt::Display) -> RerunError {
    RerunError::Encode { path: path.to_owned(), reason: reason.to_string() }
}

fn path_of(entity: &str) -> EntityPath {
    EntityPath::new(entity.split('/').map(EntityPathPart::new).collect())
}

fn time_point(when: When) -> TimePoint {
    match when {
        When::Always => TimePoint::default(),
        When::Step(step) => TimePoint::from([("step", TimeCell::from_sequence(step as i64))]),
        When::Time(time) => {
            let nanoseconds = (f64::from(time) * NANOSECONDS_PER_UNIT).round() as i64;
            TimePoint::from([("time", TimeCell::from_duration_nanos(nanoseconds))])
        }
    }
}
