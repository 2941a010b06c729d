//! An element of a polygon file as columns that are looked up by name.
//!
//! The number of bytes (or words, in an ASCII file) is compared with what the header announces before
//! anything is allocated, so a header that lies about its count costs nothing.

use super::error::PlyProblem;
use super::header::{Encoding, Header, Property, Scalar};

/// Words of an ASCII file or rows of a binary one.
enum Values<'a> {
    Words(Vec<&'a str>),
    Rows { bytes: &'a [u8], stride: usize, encoding: Encoding },
}

/// Name, type and offset in the row.
type Column = (String, Scalar, usize);

/// The rows of an element.
pub(crate) struct Table<'a> {
    element: &'static str,
    columns: Vec<Column>,
    count: usize,
    values: Values<'a>,
}

impl<'a> Table<'a> {
    /// The element of a name.
    pub(crate) fn of(bytes: &'a [u8], element: &'static str) -> Result<Self, PlyProblem> {
        let header = Header::parse(bytes)?;
        let position = header.elements.iter().position(|e| e.name == element);
        let position = position.ok_or(PlyProblem::NoElement(element))?;
        let body = &bytes[header.end..];
        let mut before = 0u128;
        for element in &header.elements[..position] {
            let (_, width) = columns_of(&element.properties, header.encoding)?;
            before += width as u128 * u128::from(element.count);
        }
        let own = &header.elements[position];
        let (columns, width) = columns_of(&own.properties, header.encoding)?;
        let extent = Extent {
            element,
            count: own.count,
            before,
            needed: width as u128 * u128::from(own.count),
            last: position + 1 == header.elements.len(),
        };
        let values = match header.encoding {
            Encoding::Ascii => Values::Words(words(body, &extent)?),
            binary => {
                extent.check(body.len(), "bytes")?;
                let bytes = &body[before as usize..][..extent.needed as usize];
                Values::Rows { bytes, stride: width, encoding: binary }
            }
        };
        Ok(Self { element, columns, count: if width == 0 { 0 } else { own.count as usize }, values })
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|(name, ..)| name.as_str())
    }

    /// `N` float properties of every row, finite.
    pub(super) fn floats<const N: usize>(&self, names: [&str; N]) -> Result<Vec<[f32; N]>, PlyProblem> {
        let flat = self.float_rows(&names)?;
        Ok(flat.as_chunks().0.to_vec())
    }

    /// Float properties of every row, finite, row by row.
    pub(crate) fn float_rows(&self, names: &[&str]) -> Result<Vec<f32>, PlyProblem> {
        let float = |s| matches!(s, Scalar::F32 | Scalar::F64);
        let columns = names
            .iter()
            .map(|name| self.column(name, "float or double", float))
            .collect::<Result<Vec<_>, _>>()?;
        let mut rows = Vec::with_capacity(self.count * columns.len());
        for index in 0..self.count {
            for (&column, &name) in columns.iter().zip(names) {
                let value = self.value(index, column)? as f32;
                if !value.is_finite() {
                    return Err(PlyProblem::NonFinite {
                        element: self.element,
                        property: name.to_owned(),
                        index,
                        found: value,
                    });
                }
                rows.push(value);
            }
        }
        Ok(rows)
    }

    /// Unsigned properties of one type of every row, row by row.
    pub(crate) fn words(&self, names: &[&str], scalar: Scalar) -> Result<Vec<u32>, PlyProblem> {
        let expected = if scalar == Scalar::U8 { "uchar" } else { "uint" };
        let columns = names.iter().map(|name| self.column(name, expected, |s| s == scalar));
        let columns = columns.collect::<Result<Vec<_>, _>>()?;
        let cells = (0..self.count).flat_map(|index| columns.iter().map(move |&column| (index, column)));
        cells.map(|(index, column)| Ok(self.value(index, column)? as u32)).collect()
    }

    /// Three byte properties of every row, scaled to [0, 1].
    pub(super) fn colors(&self, names: [&str; 3]) -> Result<Vec<[f32; 3]>, PlyProblem> {
        let mut columns = [0; 3];
        for (column, name) in columns.iter_mut().zip(names) {
            *column = self.column(name, "uchar", |s| s == Scalar::U8)?;
        }
        let mut colors = Vec::with_capacity(self.count);
        for index in 0..self.count {
            let mut color = [0.0; 3];
            for (channel, &column) in color.iter_mut().zip(&columns) {
                *channel = self.value(index, column)? as f32 / 255.0;
            }
            colors.push(color);
        }
        Ok(colors)
    }

    fn column(
        &self,
        name: &str,
        expected: &'static str,
        fits: impl Fn(Scalar) -> bool,
    ) -> Result<usize, PlyProblem> {
        let column = self
            .names()
            .position(|other| other == name)
            .ok_or_else(|| PlyProblem::Missing { element: self.element, property: name.to_owned() })?;
        let scalar = self.columns[column].1;
        if fits(scalar) {
            Ok(column)
        } else {
            Err(PlyProblem::Type { property: name.to_owned(), expected, found: format!("{scalar:?}") })
        }
    }

    fn value(&self, index: usize, column: usize) -> Result<f64, PlyProblem> {
        let (name, scalar, offset) = &self.columns[column];
        match &self.values {
            Values::Words(words) => {
                let word = words[index * self.columns.len() + column];
                let wrong = || PlyProblem::Number {
                    element: self.element,
                    property: name.clone(),
                    index,
                    found: word.chars().take(40).collect(),
                };
                word.parse().map_err(|_| wrong())
            }
            Values::Rows { bytes, stride, encoding } => {
                let bytes = &bytes[index * stride + offset..][..scalar.size()];
                Ok(decode(*scalar, bytes, *encoding))
            }
        }
    }
}

/// The place of an element among the values.
struct Extent {
    element: &'static str,
    count: u64,
    before: u128,
    needed: u128,
    last: bool,
}

impl Extent {
    fn check(&self, present: usize, unit: &'static str) -> Result<(), PlyProblem> {
        let found = (present as u128).saturating_sub(self.before);
        if found < self.needed || (self.last && found > self.needed) {
            let [expected, found] = [self.needed, found].map(|size| u64::try_from(size).unwrap_or(u64::MAX));
            return Err(PlyProblem::Count {
                element: self.element,
                count: self.count,
                expected,
                found,
                unit,
            });
        }
        Ok(())
    }
}

/// Columns with their offsets, and the width of a row: in bytes, or in words for ASCII.
fn columns_of(properties: &[Property], encoding: Encoding) -> Result<(Vec<Column>, usize), PlyProblem> {
    let mut width = 0;
    let mut columns = Vec::with_capacity(properties.len());
    for property in properties {
        let list = || PlyProblem::Type {
            property: property.name.clone(),
            expected: "a single value",
            found: "list".into(),
        };
        let scalar = property.scalar.ok_or_else(list)?;
        columns.push((property.name.clone(), scalar, width));
        width += if encoding == Encoding::Ascii { 1 } else { scalar.size() };
    }
    Ok((columns, width))
}

fn words<'a>(body: &'a [u8], extent: &Extent) -> Result<Vec<&'a str>, PlyProblem> {
    let text = std::str::from_utf8(body).map_err(|e| PlyProblem::Number {
        element: extent.element,
        property: String::new(),
        index: 0,
        found: format!("bytes that are not text at {}", e.valid_up_to()),
    })?;
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    extent.check(words.len(), "values")?;
    Ok(words[extent.before as usize..][..extent.needed as usize].to_vec())
}

fn decode(scalar: Scalar, bytes: &[u8], encoding: Encoding) -> f64 {
    let mut raw = [0; 8];
    raw[..bytes.len()].copy_from_slice(bytes);
    if encoding == Encoding::BigEndian {
        raw[..bytes.len()].reverse();
    }
    let bits = u64::from_le_bytes(raw);
    match scalar {
        Scalar::I8 => f64::from(bits as u8 as i8),
        Scalar::U8 => f64::from(bits as u8),
        Scalar::I16 => f64::from(bits as u16 as i16),
        Scalar::U16 => f64::from(bits as u16),
        Scalar::I32 => f64::from(bits as u32 as i32),
        Scalar::U32 => f64::from(bits as u32),
        Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
        Scalar::F64 => f64::from_bits(bits),
    }
}
