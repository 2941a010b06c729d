//! C3D files of every processor and form.

/// Whose numbers a file has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Processor {
    /// Little endian, IEEE floats.
    Intel,
    /// Little endian, VAX floats.
    Dec,
    /// Big endian, IEEE floats.
    Sgi,
}

/// How coordinates are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum C3dForm {
    /// 16-bit integers times a scale.
    Integer(f32),
    /// Floats.
    Float,
}

/// The contents of a file.
#[derive(Clone, Copy, Debug)]
pub struct C3d<'a> {
    /// Who wrote it.
    pub processor: Processor,
    /// How.
    pub form: C3dForm,
    /// Frames per second.
    pub rate: f32,
    /// The unit of lengths.
    pub unit: &'a str,
    /// Names of the points `[n]`.
    pub labels: &'a [&'a str],
    /// Analog values per frame.
    pub analog: usize,
    /// Positions `[T][n]`.
    pub frames: &'a [Vec<Option<[f32; 3]>>],
}

/// Number of the group `POINT`.
const GROUP: u8 = 1;

impl C3d<'_> {
    /// The file.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        // Without the place of the data the section is as long as with it.
        let blocks = self.parameters(0, 0).len() / 512;
        let start = (2 + blocks) as u16;
        let mut bytes = self.header(start);
        bytes.extend(self.parameters(blocks as u8, start));
        for frame in self.frames {
            frame.iter().for_each(|point| self.point(&mut bytes, *point));
            (0..self.analog).for_each(|_| self.word(&mut bytes, 7.0));
        }
        bytes
    }

    fn header(&self, start: u16) -> Vec<u8> {
        let mut bytes = vec![2, 0x50];
        let counts = [self.labels.len() as u16, self.analog as u16, 1, self.frames.len() as u16, 10];
        counts.iter().for_each(|&count| self.integer(&mut bytes, count));
        self.float(&mut bytes, self.scale());
        self.integer(&mut bytes, start);
        self.integer(&mut bytes, 1);
        self.float(&mut bytes, self.rate);
        bytes.resize(512, 0);
        bytes
    }

    fn parameters(&self, blocks: u8, start: u16) -> Vec<u8> {
        let code = match self.processor {
            Processor::Intel => 84,
            Processor::Dec => 85,
            Processor::Sgi => 86,
        };
        let mut bytes = vec![1, 0x50, blocks, code];
        bytes.extend([5, GROUP.wrapping_neg()]);
        bytes.extend(b"POINT");
        self.integer(&mut bytes, 3);
        bytes.push(0);
        let number = |value| {
            let mut word = Vec::new();
            self.integer(&mut word, value);
            word
        };
        let float = |value| {
            let mut word = Vec::new();
            self.float(&mut word, value);
            word
        };
        let longest = self.labels.iter().map(|label| label.len()).max().unwrap_or(1);
        let padded: String = self.labels.iter().map(|label| format!("{label:<longest$}")).collect();
        self.parameter(&mut bytes, "USED", 2, &[], &number(self.labels.len() as u16));
        self.parameter(&mut bytes, "FRAMES", 2, &[], &number(self.frames.len() as u16));
        self.parameter(&mut bytes, "DATA_START", 2, &[], &number(start));
        self.parameter(&mut bytes, "SCALE", 4, &[], &float(self.scale()));
        self.parameter(&mut bytes, "RATE", 4, &[], &float(self.rate));
        self.parameter(&mut bytes, "UNITS", -1, &[self.unit.len()], self.unit.as_bytes());
        self.parameter(&mut bytes, "LABELS", -1, &[longest, self.labels.len()], padded.as_bytes());
        bytes.resize(bytes.len().next_multiple_of(512).max(512), 0);
        bytes
    }

    fn parameter(&self, bytes: &mut Vec<u8>, name: &str, kind: i8, extents: &[usize], data: &[u8]) {
        bytes.extend([name.len() as u8, GROUP]);
        bytes.extend(name.bytes());
        self.integer(bytes, (2 + 2 + extents.len() + data.len() + 1) as u16);
        bytes.extend([kind as u8, extents.len() as u8]);
        bytes.extend(extents.iter().map(|&extent| extent as u8));
        bytes.extend(data);
        bytes.push(0);
    }

    fn scale(&self) -> f32 {
        match self.form {
            C3dForm::Integer(scale) => scale,
            C3dForm::Float => -1.0,
        }
    }

    fn point(&self, bytes: &mut Vec<u8>, point: Option<[f32; 3]>) {
        let factor = if self.form == C3dForm::Float { 1.0 } else { self.scale() };
        point.unwrap_or_default().iter().for_each(|value| self.word(bytes, value / factor));
        self.word(bytes, if point.is_some() { 0.0 } else { -1.0 });
    }

    /// A number of the frames.
    fn word(&self, bytes: &mut Vec<u8>, value: f32) {
        match self.form {
            C3dForm::Float => self.float(bytes, value),
            C3dForm::Integer(_) => self.integer(bytes, value.round() as i16 as u16),
        }
    }

    fn integer(&self, bytes: &mut Vec<u8>, value: u16) {
        bytes.extend(if self.processor == Processor::Sgi {
            value.to_be_bytes()
        } else {
            value.to_le_bytes()
        });
    }

    fn float(&self, bytes: &mut Vec<u8>, value: f32) {
        bytes.extend(match self.processor {
            Processor::Intel => value.to_le_bytes(),
            Processor::Sgi => value.to_be_bytes(),
            Processor::Dec => {
                let [a, b, c, d] = (4.0 * value).to_be_bytes();
                [b, a, d, c]
            }
        });
    }
}
