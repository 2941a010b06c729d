//! The text header of a polygon file: format, elements and their properties.

use super::error::PlyProblem;
use crate::thresholds::MAX_HEADER;

/// The storage of the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A number's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Number of bytes of a value.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// A property; `scalar` is absent for lists.
pub(super) struct Property {
    pub(super) name: String,
    pub(super) scalar: Option<Scalar>,
}

/// An element with its number of rows.
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

/// A parsed header; `end` is where the values start.
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) end: usize,
}

impl Header {
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, PlyProblem> {
        let (mut at, mut line) = (0, 0);
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let text = next_line(bytes, &mut at, line + 1)?;
            line += 1;
            let wrong =
                |expected| PlyProblem::Header { line, expected, found: text.chars().take(80).collect() };
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            match (line, words.as_slice()) {
                (1, ["ply"]) => {}
                (1, _) => return Err(wrong("`ply`")),
                (_, ["comment" | "obj_info", ..] | []) => {}
                (_, ["format", name, "1.0"]) => {
                    encoding = Some(parse_encoding(name).ok_or_else(|| wrong("a known format"))?)
                }
                (_, ["element", name, count]) => {
                    let count = count.parse().map_err(|_| wrong("`element NAME COUNT`"))?;
                    elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                (_, ["property", rest @ ..]) => {
                    let property = parse_property(rest)
                        .ok_or_else(|| wrong("`property TYPE NAME` with a known type"))?;
                    let element =
                        elements.last_mut().ok_or_else(|| wrong("an element before its properties"))?;
                    if element.properties.iter().any(|other| other.name == property.name) {
                        return Err(wrong("each property once"));
                    }
                    element.properties.push(property);
                }
                (_, ["end_header"]) => {
                    let encoding = encoding.ok_or_else(|| wrong("a `format` line before"))?;
                    return Ok(Self { encoding, elements, end: at });
                }
                _ => return Err(wrong("format, element, property, comment or end_header")),
            }
        }
    }
}

fn next_line<'a>(bytes: &'a [u8], at: &mut usize, line: usize) -> Result<&'a str, PlyProblem> {
    let rest = &bytes[*at..bytes.len().min(MAX_HEADER)];
    let ended = PlyProblem::Header { line, expected: "`end_header`", found: String::new() };
    let length = rest.iter().position(|&b| b == b'\n').ok_or(ended)?;
    *at += length + 1;
    std::str::from_utf8(&rest[..length]).map_err(|_| PlyProblem::Header {
        line,
        expected: "text",
        found: String::from_utf8_lossy(&rest[..length.min(40)]).into_owned(),
    })
}

fn parse_encoding(name: &str) -> Option<Encoding> {
    match name {
        "ascii" => Some(Encoding::Ascii),
        "binary_little_endian" => Some(Encoding::LittleEndian),
        "binary_big_endian" => Some(Encoding::BigEndian),
        _ => None,
    }
}

fn parse_property(words: &[&str]) -> Option<Property> {
    match words {
        ["list", count, item, name] => {
            Scalar::parse(count)?;
            Scalar::parse(item)?;
            Some(Property { name: (*name).to_owned(), scalar: None })
        }
        [scalar, name] => Some(Property { name: (*name).to_owned(), scalar: Some(Scalar::parse(scalar)?) }),
        _ => None,
    }
}
