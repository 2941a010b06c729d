//! What a recording holds.

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufReader;
use std::path::Path;

use re_chunk::Chunk;
use re_log_encoding::Decoder;
use re_log_types::LogMsg;
use re_sdk_types::{Component, ComponentDescriptor};

/// What a recording holds.
#[derive(Default)]
pub(crate) struct Contents {
    pub(crate) recording: String,
    chunks: BTreeMap<String, Vec<Chunk>>,
}

impl Contents {
    pub(crate) fn read(path: &Path) -> Self {
        let file = BufReader::new(std::fs::File::open(path).expect("a recording"));
        let mut contents = Self::default();
        for message in Decoder::<LogMsg>::decode_eager(file).expect("a stream") {
            match message.expect("a message") {
                LogMsg::SetStoreInfo(set) => contents.recording = set.info.recording_id().to_string(),
                LogMsg::ArrowMsg(_, message) => {
                    let chunk = Chunk::from_arrow_msg(&message).expect("a chunk");
                    contents.chunks.entry(chunk.entity_path().to_string()).or_default().push(chunk);
                }
                LogMsg::BlueprintActivationCommand(_) => {}
            }
        }
        contents
    }

    /// Asserts that another recording has the same name and the same chunks, numbers included.
    #[track_caller]
    pub(crate) fn assert_same(&self, other: &Self) {
        assert_eq!(self.recording, other.recording);
        assert_eq!(self.entities(), other.entities());
        for (entity, chunks) in &self.chunks {
            let others = &other.chunks[entity];
            assert_eq!(chunks.len(), others.len(), "{entity}");
            assert!(chunks.iter().zip(others).all(|(a, b)| a.are_equal(b)), "{entity}");
        }
    }

    /// All entities but rerun's own.
    pub(crate) fn entities(&self) -> Vec<&str> {
        self.chunks.keys().map(String::as_str).filter(|entity| !entity.starts_with("/__")).collect()
    }

    /// Names of all timelines.
    pub(crate) fn timelines(&self) -> BTreeSet<String> {
        let all = self.chunks.values().flatten();
        all.flat_map(|chunk| chunk.timelines().keys()).map(ToString::to_string).collect()
    }

    /// Values of a component of an entity with the time of each, in order; `i64::MIN` where it holds always.
    pub(crate) fn values<C: Component>(
        &self,
        entity: &str,
        component: &ComponentDescriptor,
    ) -> Vec<(i64, Vec<C>)> {
        let mut found = Vec::new();
        for chunk in self.chunks.get(entity).into_iter().flatten() {
            let times = chunk.timelines().values().next().map(|column| column.times_raw().to_vec());
            let rows = chunk.iter_component::<C>(component.component);
            for (row, values) in rows.enumerate().filter(|(_, values)| !values.as_slice().is_empty()) {
                let time = times.as_ref().map_or(i64::MIN, |times| times[row]);
                found.push((time, values.as_slice().to_vec()));
            }
        }
        found.sort_by_key(|(time, _)| *time);
        found
    }
}
