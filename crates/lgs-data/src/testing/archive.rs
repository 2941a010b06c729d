//! A checkpoint as today's `torch.save` writes a state dictionary that lies on a graphics card: a ZIP archive
//! with the pickle of an `OrderedDict`, its `_metadata`, and one member per storage.

use flate2::Crc;

/// An archive of named tensors (shape and values), in the members' order of PyTorch 2; `root` is the name of
/// the file without extension.
#[must_use]
pub fn checkpoint_archive(root: &str, tensors: &[(&str, &[usize], &[f32])]) -> Vec<u8> {
    let mut archive = Archive::default();
    archive.member(&format!("{root}/data.pkl"), &Pickle::default().state_dict(tensors));
    archive.member(&format!("{root}/byteorder"), b"little");
    for (key, (.., values)) in tensors.iter().enumerate() {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        archive.member(&format!("{root}/data/{key}"), &bytes);
    }
    archive.member(&format!("{root}/version"), b"3\n");
    archive.finish()
}

/// A pickle of protocol 2 that is being written.
#[derive(Default)]
struct Pickle {
    bytes: Vec<u8>,
    memo: u32,
}

impl Pickle {
    fn state_dict(mut self, tensors: &[(&str, &[usize], &[f32])]) -> Vec<u8> {
        self.bytes.extend([0x80, 2]);
        self.ordered_dict();
        self.bytes.push(b'(');
        for (key, (name, shape, values)) in tensors.iter().enumerate() {
            self.text(name);
            self.tensor(key, shape, values.len());
        }
        self.bytes.push(b'u');
        self.metadata();
        self.bytes.push(b'.');
        self.bytes
    }

    /// The attribute `_metadata` of a module's state: its version by its name.
    fn metadata(&mut self) {
        self.bytes.push(b'}');
        self.remember();
        self.text("_metadata");
        self.ordered_dict();
        self.text("");
        self.bytes.push(b'}');
        self.remember();
        self.text("version");
        self.bytes.extend([b'K', 1, b's', b's', b's', b'b']);
    }

    fn ordered_dict(&mut self) {
        self.bytes.extend(b"ccollections\nOrderedDict\n");
        self.remember();
        self.bytes.extend(b")R");
        self.remember();
    }

    /// `_rebuild_tensor_v2(storage, offset, size, stride, requires_grad, hooks)`.
    fn tensor(&mut self, key: usize, shape: &[usize], elements: usize) {
        self.bytes.extend(b"ctorch._utils\n_rebuild_tensor_v2\n");
        self.remember();
        self.bytes.extend(b"((");
        self.text("storage");
        self.bytes.extend(b"ctorch\nFloatStorage\n");
        self.remember();
        self.text(&key.to_string());
        self.text("cuda:0");
        self.integer(elements);
        self.bytes.push(b't');
        self.remember();
        self.bytes.extend(b"QK\0");
        self.extents(shape.iter().copied());
        self.extents((0..shape.len()).map(|axis| shape[axis + 1..].iter().product()));
        self.bytes.push(0x89);
        self.ordered_dict();
        self.bytes.push(b't');
        self.remember();
        self.bytes.push(b'R');
        self.remember();
    }

    fn extents(&mut self, extents: impl Iterator<Item = usize>) {
        self.bytes.push(b'(');
        extents.for_each(|extent| self.integer(extent));
        self.bytes.push(b't');
        self.remember();
    }

    fn text(&mut self, text: &str) {
        self.bytes.push(b'X');
        self.bytes.extend((text.len() as u32).to_le_bytes());
        self.bytes.extend(text.bytes());
        self.remember();
    }

    fn integer(&mut self, value: usize) {
        match u8::try_from(value) {
            Ok(value) => self.bytes.extend([b'K', value]),
            Err(_) => {
                self.bytes.push(b'J');
                self.bytes.extend((value as u32).to_le_bytes());
            }
        }
    }

    /// Puts the last value into the memo, as Python does with everything that it may meet again.
    fn remember(&mut self) {
        match u8::try_from(self.memo) {
            Ok(memo) => self.bytes.extend([b'q', memo]),
            Err(_) => {
                self.bytes.push(b'r');
                self.bytes.extend(self.memo.to_le_bytes());
            }
        }
        self.memo += 1;
    }
}

/// A ZIP archive of members that are stored as they are.
#[derive(Default)]
struct Archive {
    bytes: Vec<u8>,
    directory: Vec<u8>,
    members: u16,
}

impl Archive {
    fn member(&mut self, name: &str, contents: &[u8]) {
        let mut crc = Crc::new();
        crc.update(contents);
        let offset = self.bytes.len() as u32;
        let size = (contents.len() as u32).to_le_bytes();
        // Version needed, flags, method, time, date; sum, both sizes; lengths of name and of extra field.
        let mut facts = [20_u16, 0, 0, 0, 0].map(u16::to_le_bytes).concat();
        facts.extend([crc.sum().to_le_bytes(), size, size].concat());
        facts.extend([name.len() as u16, 0].map(u16::to_le_bytes).concat());
        self.bytes.extend([b"PK\x03\x04", facts.as_slice(), name.as_bytes(), contents].concat());
        self.directory.extend([b"PK\x01\x02\x14\0", facts.as_slice(), &[0; 10]].concat());
        self.directory.extend(offset.to_le_bytes());
        self.directory.extend(name.bytes());
        self.members += 1;
    }

    fn finish(mut self) -> Vec<u8> {
        let (start, length) = (self.bytes.len() as u32, self.directory.len() as u32);
        self.bytes.append(&mut self.directory);
        self.bytes.extend(b"PK\x05\x06\0\0\0\0");
        self.bytes.extend([self.members, self.members].map(u16::to_le_bytes).concat());
        self.bytes.extend([length, start].map(u32::to_le_bytes).concat());
        self.bytes.extend([0, 0]);
        self.bytes
    }
}
