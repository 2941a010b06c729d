//! Boxes of MP4 and MOV files (ISO/IEC 14496-12, section 4.2): a length, a name, and content. Of the file
//! only the boxes that describe it are read into memory.

use std::io::{self, Read, Seek, SeekFrom};

use mp4_atom::Atom;

use super::error::{DecodeError, index};
use crate::thresholds::LARGEST_INDEX;

type Name = [u8; 4];

/// Names with which files begin: all but the oldest with `ftyp`.
const FIRST: [&Name; 8] = [b"ftyp", b"moov", b"mdat", b"free", b"skip", b"wide", b"pnot", b"moof"];
/// Bytes of a length and a name.
const HEADER: u64 = 8;
/// Bytes more where the length has 64 bits.
const LONG: u64 = 8;

/// The boxes of a file that describe it.
pub(super) struct Description {
    /// The content of `moov`.
    pub(super) index: Vec<u8>,
    /// Where each `moof` begins, and its content.
    pub(super) fragments: Vec<(u64, Vec<u8>)>,
}

/// Reads what describes a file.
pub(super) fn describe<R: Read + Seek>(file: &mut R, length: u64) -> Result<Description, DecodeError> {
    let (mut found, mut fragments) = (None, Vec::new());
    let mut at = 0;
    while let Some((name, header, size)) = header_at(file, at, length)? {
        if at == 0 && !FIRST.contains(&&name) {
            return Err(DecodeError::Container);
        }
        let end = at.saturating_add(size);
        match &name {
            b"moov" if found.is_none() => found = Some(content(file, length, [at + header, end])?),
            b"moof" => fragments.push((at, content(file, length, [at + header, end])?)),
            _ => {}
        }
        at = end;
    }
    match found {
        Some(moov) => Ok(Description { index: moov, fragments }),
        None if at == 0 => Err(DecodeError::Container),
        None => Err(index("(`moov`) is missing: its recording or a copy was cut off")),
    }
}

/// Name, bytes of the header and bytes in all of the box at a place of the file; none at its end.
fn header_at<R: Read + Seek>(file: &mut R, at: u64, length: u64) -> io::Result<Option<(Name, u64, u64)>> {
    if length.saturating_sub(at) < HEADER {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(at))?;
    let mut bytes = [0; 16];
    let known = (length - at).min(bytes.len() as u64) as usize;
    file.read_exact(&mut bytes[..known])?;
    Ok(header_of(&bytes[..known], length - at))
}

/// The same of the box at the beginning of some bytes, of which `rest` follow in all.
fn header_of(bytes: &[u8], rest: u64) -> Option<(Name, u64, u64)> {
    let (&size, after) = bytes.split_first_chunk::<4>()?;
    let (&name, after) = after.split_first_chunk::<4>()?;
    let (header, size) = match u32::from_be_bytes(size) {
        0 => (HEADER, rest),
        1 => (HEADER + LONG, u64::from_be_bytes(*after.first_chunk()?)),
        size => (HEADER, u64::from(size)),
    };
    (size >= header).then_some((name, header, size))
}

fn content<R: Read + Seek>(file: &mut R, length: u64, [from, to]: [u64; 2]) -> Result<Vec<u8>, DecodeError> {
    if to > length {
        return Err(index(format!("is cut off: it goes to byte {to} of a file of {length}")));
    }
    if to - from > LARGEST_INDEX {
        return Err(index(format!("has {} bytes, more than the {LARGEST_INDEX} that are read", to - from)));
    }
    file.seek(SeekFrom::Start(from))?;
    let mut bytes = vec![0; (to - from) as usize];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// The boxes in a content, with their names. What is left at its end is no box: QuickTime closes lists with a
/// zero.
pub(super) fn boxes(mut content: &[u8]) -> impl Iterator<Item = (Name, &[u8])> {
    std::iter::from_fn(move || {
        if content.starts_with(&[0; 4]) {
            return None;
        }
        let (name, header, size) = header_of(content, content.len() as u64)?;
        let end = size.min(content.len() as u64) as usize;
        let own = content.get(header as usize..end)?;
        content = &content[end..];
        Some((name, own))
    })
}

/// The content of the box that a path of names leads to.
pub(super) fn find<'a>(content: &'a [u8], path: &[&Name]) -> Option<&'a [u8]> {
    let Some((first, rest)) = path.split_first() else { return Some(content) };
    boxes(content).filter(|(name, _)| name == *first).find_map(|(_, own)| find(own, rest))
}

/// The values of a box, if it is there. Bytes behind them are padding.
pub(super) fn values<T: Atom>(content: &[u8], path: &[&Name]) -> Result<Option<T>, DecodeError> {
    find(content, path).map(value).transpose()
}

/// The values in the content of a box.
pub(super) fn value<T: Atom>(mut content: &[u8]) -> Result<T, DecodeError> {
    T::decode_body(&mut content).map_err(|error| index(format!("has a defect in `{}`: {error}", T::KIND)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn a_box(name: &str, content: &[u8]) -> Vec<u8> {
        [&(8 + content.len() as u32).to_be_bytes(), name.as_bytes(), content].concat()
    }

    fn described(file: &[u8]) -> Result<Description, DecodeError> {
        describe(&mut Cursor::new(file), file.len() as u64)
    }

    #[test]
    fn boxes_are_found_by_their_path() {
        let inner = [a_box("free", b"x"), a_box("stbl", b"here")].concat();
        // A list that ends with a zero, as those of QuickTime do.
        let udta = a_box("udta", &[0; 4]);
        let moov = [udta, a_box("trak", b""), a_box("trak", &inner)].concat();
        assert_eq!(find(&moov, &[b"trak", b"stbl"]), Some(&b"here"[..]));
        assert_eq!(find(&moov, &[b"udta", b"stbl"]), None);
        let file = [a_box("ftyp", b"qt  "), a_box("moov", &moov)].concat();
        assert_eq!(described(&file).unwrap().index, moov);
    }

    #[test]
    fn lengths_of_64_bits_and_to_the_end_are_read() {
        let long = [&[0, 0, 0, 1][..], b"mdat", &20_u64.to_be_bytes(), b"data"].concat();
        let last = [&[0, 0, 0, 0][..], b"moov", b"rest"].concat();
        assert_eq!(described(&[long, last].concat()).unwrap().index, b"rest");
    }

    #[test]
    fn other_files_and_those_that_are_cut_off_are_told_apart() {
        let message = |file: &[u8]| described(file).map(drop).unwrap_err().to_string();
        assert!(message(b"RIFF....AVI LIST").contains("no MP4"));
        assert!(message(b"").contains("no MP4"));
        assert!(message(&a_box("ftyp", b"isom")).contains("is missing"));
        let file = [a_box("ftyp", b"isom"), a_box("moov", &[7; 40])].concat();
        assert!(message(&file[..file.len() - 1]).contains("cut off: it goes to byte 60 of a file of 59"));
        let endless = [a_box("ftyp", b"isom"), u32::MAX.to_be_bytes().to_vec(), b"mdat".to_vec()].concat();
        assert!(message(&endless).contains("is missing"));
    }
}
