//! Files for tests that only other programs write: PyTorch checkpoints and motion capture. And what errors
//! about files have to say.

mod archive;
mod c3d;

pub use archive::checkpoint_archive;
pub use c3d::{C3d, C3dForm, Processor};

use std::path::Path;

/// Asserts that an error holds all of `words` and ends with the file that it is about.
///
/// # Panics
/// If it does not.
#[track_caller]
pub fn assert_named(error: &dyn std::error::Error, path: &Path, words: &[&str]) {
    let text = error.to_string();
    assert!(text.ends_with(&path.display().to_string()), "should end with {}: {text}", path.display());
    for word in words {
        assert!(text.contains(word), "should contain {word}: {text}");
    }
}

/// One value of a checkpoint's dictionary.
#[derive(Clone, Copy, Debug)]
pub enum CheckpointEntry<'a> {
    /// A tensor: shape and values.
    Tensor(&'a [usize], &'a [f32]),
    /// A call that a Python program would make on reading: module, function, and its one argument.
    Call(&'a str, &'a str, &'a str),
}

/// A dictionary as `torch.save` wrote it before version 1.6: a stream of pickles, then each storage as a
/// count and its bytes.
#[must_use]
pub fn checkpoint(entries: &[(&str, CheckpointEntry<'_>)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    // The magic number, the version 1001, and a dictionary about the machine, as pickles of protocol 2.
    bytes.extend([0x80, 2, 0x8a, 10, 0x6c, 0xfc, 0x9c, 0x46, 0xf9, 0x20, 0x6a, 0xa8, 0x50, 0x19, b'.']);
    bytes.extend([0x80, 2, b'M', 0xe9, 0x03, b'.']);
    bytes.extend([0x80, 2, b'}', b'(']);
    text(&mut bytes, "little_endian");
    bytes.extend([0x88, b'u', b'.']);
    bytes.extend([0x80, 2, b'}', b'(']);
    for (key, (name, entry)) in entries.iter().enumerate() {
        text(&mut bytes, name);
        match entry {
            CheckpointEntry::Tensor(shape, values) => tensor(&mut bytes, key, shape, values.len()),
            CheckpointEntry::Call(module, function, argument) => {
                bytes.extend(format!("c{module}\n{function}\n(").bytes());
                text(&mut bytes, argument);
                bytes.extend(b"tR");
            }
        }
    }
    bytes.extend(b"u.");
    let storages =
        || entries.iter().enumerate().filter_map(|(key, (_, entry))| values(entry).map(|v| (key, v)));
    bytes.extend([0x80, 2, b']', b'(']);
    storages().for_each(|(key, _)| text(&mut bytes, &key.to_string()));
    bytes.extend(b"e.");
    for (_, values) in storages() {
        bytes.extend((values.len() as u64).to_le_bytes());
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

fn values<'a>(entry: &CheckpointEntry<'a>) -> Option<&'a [f32]> {
    match entry {
        CheckpointEntry::Tensor(_, values) => Some(values),
        CheckpointEntry::Call(..) => None,
    }
}

/// `_rebuild_tensor_v2(storage, offset, size, stride, requires_grad, hooks)`.
fn tensor(bytes: &mut Vec<u8>, key: usize, shape: &[usize], elements: usize) {
    bytes.extend(b"ctorch._utils\n_rebuild_tensor_v2\n((");
    text(bytes, "storage");
    bytes.extend(b"ctorch\nFloatStorage\n");
    text(bytes, &key.to_string());
    text(bytes, "cpu");
    integer(bytes, elements);
    bytes.extend(b"NtQK\0(");
    shape.iter().for_each(|&extent| integer(bytes, extent));
    bytes.extend(b"t(");
    (0..shape.len()).for_each(|axis| integer(bytes, shape[axis + 1..].iter().product()));
    bytes.extend([b't', 0x89, b'N', b't', b'R']);
}

fn text(bytes: &mut Vec<u8>, text: &str) {
    bytes.push(b'X');
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(text.bytes());
}

fn integer(bytes: &mut Vec<u8>, value: usize) {
    bytes.push(b'J');
    bytes.extend((value as u32).to_le_bytes());
}
