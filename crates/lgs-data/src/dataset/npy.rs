//! Arrays of numpy: `.npy` files, and their archives `.npz`.
//!
//! A file is the bytes `\x93NUMPY`, a version, the length of a header, the header (a Python dictionary with
//! `descr`, `fortran_order` and `shape`) and the values (numpy.lib.format). Values are little-endian numbers
//! of one or two dimensions; there must be as many bytes as the header states.

use super::error::{DatasetError, Problem};
use crate::files;
use crate::ply::Points;
use std::io::{Cursor, Read};
use std::path::Path;

/// Rows of numbers. An array of one dimension is one column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    pub(super) columns: usize,
    /// Row by row.
    pub(super) values: Vec<f64>,
}

impl Table {
    pub(super) fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.columns.max(1))
    }
}

/// Reads a `.npy` file.
pub(super) fn read(path: &Path) -> Result<Table, DatasetError> {
    parse(&files::read_bytes(path)?).map_err(|reason| DatasetError::new(path, Problem::Malformed(reason)))
}

/// Reads one array of a `.npz` file.
pub(super) fn read_npz(path: &Path, name: &str) -> Result<Table, DatasetError> {
    let bytes = files::read_bytes(path)?;
    let wrong = |reason: String| DatasetError::new(path, Problem::Malformed(reason));
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes))
        .map_err(|e| wrong(format!("expected an archive of arrays (.npz): {e}")))?;
    let mut entry = archive
        .by_name(&format!("{name}.npy"))
        .map_err(|e| wrong(format!("expected an array `{name}`: {e}")))?;
    let mut array = Vec::new();
    entry.read_to_end(&mut array).map_err(|e| wrong(format!("array `{name}`: {e}")))?;
    parse(&array).map_err(|reason| wrong(format!("array `{name}`: {reason}")))
}

/// Points of a table's rows x y z, with r g b in [0, 1] behind them where there are six columns; else grey.
pub(super) fn points(table: &Table) -> Result<Points, Problem> {
    if table.columns < 3 {
        let found = format!("{} columns", table.columns);
        return Err(Problem::Malformed(format!("expected rows of at least x y z, found {found}")));
    }
    let mut points = Points::default();
    for (index, row) in table.rows().enumerate() {
        if !row.iter().all(|v| v.is_finite()) {
            return Err(Problem::Malformed(format!("point {index}: expected finite values, found {row:?}")));
        }
        let three = |from: usize| [row[from], row[from + 1], row[from + 2]].map(|v| v as f32);
        points.positions.push(three(0));
        points.colors.push(if table.columns >= 6 { three(3).map(|c| c.clamp(0.0, 1.0)) } else { [0.5; 3] });
    }
    Ok(points)
}

fn parse(bytes: &[u8]) -> Result<Table, String> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or("expected a numpy array (.npy)")?;
    let (length, start): (usize, usize) = match rest {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 4),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, 6),
        _ => return Err("expected version 1, 2 or 3 of the format".to_owned()),
    };
    let header = rest.get(start..start.saturating_add(length)).ok_or("the header is cut short")?;
    let header = std::str::from_utf8(header).map_err(|_| "the header is no text")?;
    let values = &rest[start + length..];
    let kind = field(header, "descr").ok_or("the header has no `descr`")?;
    let kind = kind.split('\'').nth(1).unwrap_or_default();
    let shape = field(header, "shape").and_then(shape_of).ok_or("the header has no `shape`")?;
    let (rows, columns) = match shape[..] {
        [rows] => (rows, 1),
        [rows, columns] => (rows, columns),
        _ => return Err(format!("expected one or two dimensions, found {}", shape.len())),
    };
    let (size, number) =
        number_of(kind).ok_or_else(|| format!("numbers of type `{kind}` are not supported"))?;
    let expected = rows.checked_mul(columns).and_then(|n| n.checked_mul(size));
    if expected != Some(values.len()) {
        return Err(format!(
            "expected {rows} x {columns} values of {size} bytes, found {} bytes",
            values.len()
        ));
    }
    let stored: Vec<f64> = values.chunks_exact(size).map(number).collect();
    let by_columns = field(header, "fortran_order").is_some_and(|text| text.starts_with("True"));
    let at = |i: usize| if by_columns { stored[i % columns * rows + i / columns] } else { stored[i] };
    Ok(Table { columns, values: (0..stored.len()).map(at).collect() })
}

/// What follows a key of the header.
fn field<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(&format!("'{key}':"))?;
    Some(rest.trim_start())
}

fn shape_of(text: &str) -> Option<Vec<usize>> {
    let (inside, _) = text.strip_prefix('(')?.split_once(')')?;
    inside.split(',').map(str::trim).filter(|part| !part.is_empty()).map(|part| part.parse().ok()).collect()
}

/// Reads a number from its bytes.
type Read64 = fn(&[u8]) -> f64;

/// Bytes of a number, and how they are read.
fn number_of(kind: &str) -> Option<(usize, Read64)> {
    fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
        std::array::from_fn(|i| bytes[i])
    }
    Some(match kind {
        "<f8" => (8, |b| f64::from_le_bytes(array(b))),
        "<f4" => (4, |b| f64::from(f32::from_le_bytes(array(b)))),
        "<i8" => (8, |b| i64::from_le_bytes(array(b)) as f64),
        "<i4" => (4, |b| f64::from(i32::from_le_bytes(array(b)))),
        "|u1" => (1, |b| f64::from(b[0])),
        _ => return None,
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::io::Write;

    pub(in crate::dataset) fn npy([rows, columns]: [usize; 2], values: &[f64]) -> Vec<u8> {
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({rows}, {columns}), }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.bytes());
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        bytes
    }

    pub(in crate::dataset) fn write_npz(path: &Path, name: &str, (shape, values): ([usize; 2], &[f64])) {
        let mut archive = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
        archive.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default()).unwrap();
        archive.write_all(&npy(shape, values)).unwrap();
        archive.finish().unwrap();
    }

    #[test]
    fn tables_of_both_orders_and_several_types_are_read() {
        let table = parse(&npy([2, 3], &[1., 2., 3., 4., 5., 6.])).unwrap();
        assert_eq!(table.rows().collect::<Vec<_>>(), [[1., 2., 3.], [4., 5., 6.]]);
        let text = |edit: [&str; 2], values: &[u8]| {
            let header =
                "{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }".replace(edit[0], edit[1]);
            let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
            bytes.extend((header.len() as u32).to_le_bytes());
            bytes.extend(header.bytes());
            bytes.extend(values);
            bytes
        };
        let columns: Vec<u8> = [1_f32, 4., 2., 5., 3., 6.].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(parse(&text(["", ""], &columns)).unwrap(), table);
        let bytes = parse(&text(["'<f4'", "'|u1'"], &[1, 4, 2, 5, 3, 6])).unwrap();
        assert_eq!(bytes, table);
        let line = parse(&text(["(2, 3)", "(6,)"], &columns)).unwrap();
        assert_eq!((line.columns, line.values.len()), (1, 6));
        for (edit, expected) in [
            (["'<f4'", "'>f4'"], ">f4"),
            (["(2, 3)", "(2, 3, 1)"], "dimensions"),
            (["(2, 3)", "(2, 4)"], "2 x 4 values"),
            (["(2, 3)", "(9223372036854775807, 16)"], "found 24 bytes"),
            (["'shape'", "'form'"], "shape"),
        ] {
            let message = parse(&text(edit, &columns)).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
        assert!(parse(&npy([1, 1], &[1.0])[..12]).is_err() && parse(b"P6").is_err());
    }

    #[test]
    fn archives_without_the_array_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        write_npz(&path, "data", ([1, 3], &[1., 2., f64::NAN]));
        assert!(points(&read_npz(&path, "data").unwrap()).is_err());
        assert!(read_npz(&path, "other").unwrap_err().to_string().contains("`other`"));
        std::fs::write(&path, "PK").unwrap();
        assert!(read_npz(&path, "data").unwrap_err().to_string().ends_with("a.npz"));
    }
}
