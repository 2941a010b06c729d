//! COLMAP's binary files. All numbers are little-endian; every file begins with the number of its entries,
//! and ends with the last of them.

use super::model::{ColmapCamera, ColmapImage, MODELS};
use crate::dataset::error::Problem;
use crate::ply::Points;

/// Fewest bytes of a camera, an image and a point.
const CAMERA: usize = 24 + 8 * 3;
const IMAGE: usize = 4 + 8 * 7 + 4 + 1 + 8;
const POINT: usize = 8 + 8 * 3 + 3 + 8 + 8;
/// Bytes of a keypoint of an image, and of an observation of a point.
const KEYPOINT: usize = 24;
const OBSERVATION: usize = 8;

/// The bytes that are left.
struct Bytes<'a> {
    rest: &'a [u8],
    entry: usize,
}

pub(super) fn cameras(bytes: &[u8]) -> Result<Vec<ColmapCamera>, Problem> {
    entries(bytes, CAMERA, |bytes| {
        let (id, model) = (bytes.u32()?, bytes.u32()?);
        let size = [bytes.u64()? as f64, bytes.u64()? as f64];
        let unknown = || Problem::Part {
            part: format!("camera {id}"),
            field: "model",
            expected: "the number of a model of COLMAP".to_owned(),
            found: model.to_string(),
        };
        let &(name, count) = MODELS.get(model as usize).ok_or_else(unknown)?;
        let parameters = (0..count).map(|_| bytes.f64()).collect::<Result<Vec<_>, _>>()?;
        ColmapCamera::new(id, name, size, &parameters)
    })
}

pub(super) fn images(bytes: &[u8]) -> Result<Vec<ColmapImage>, Problem> {
    entries(bytes, IMAGE, |bytes| {
        bytes.u32()?;
        let rotation = bytes.floats()?;
        let translation = bytes.floats()?;
        let camera_id = bytes.u32()?;
        let name = bytes.name()?;
        let keypoints = bytes.u64()?;
        bytes.skip(keypoints, KEYPOINT)?;
        Ok(ColmapImage { rotation, translation, camera_id, name })
    })
}

pub(super) fn points(bytes: &[u8]) -> Result<Points, Problem> {
    let read = entries(bytes, POINT, |bytes| {
        bytes.u64()?;
        let position: [f64; 3] = bytes.floats()?;
        let colour = [bytes.take(1)?[0], bytes.take(1)?[0], bytes.take(1)?[0]];
        bytes.f64()?;
        let observations = bytes.u64()?;
        bytes.skip(observations, OBSERVATION)?;
        super::text::check_point(bytes.entry, position)?;
        Ok((position.map(|v| v as f32), colour.map(|c| f32::from(c) / 255.0)))
    })?;
    let (positions, colors) = read.into_iter().unzip();
    Ok(Points { positions, colors })
}

/// All entries of a file, which are at least so long each.
fn entries<T>(
    bytes: &[u8],
    shortest: usize,
    read: impl Fn(&mut Bytes<'_>) -> Result<T, Problem>,
) -> Result<Vec<T>, Problem> {
    let mut bytes = Bytes { rest: bytes, entry: 0 };
    let count = bytes.u64()?;
    if count > (bytes.rest.len() / shortest) as u64 {
        let most = bytes.rest.len() / shortest;
        let found = format!("expected at most {most} entries in {} bytes", bytes.rest.len());
        return Err(Problem::Malformed(format!("{found}, found a count of {count}")));
    }
    let mut found = Vec::new();
    for entry in 0..count as usize {
        bytes.entry = entry;
        found.push(read(&mut bytes)?);
    }
    if bytes.rest.is_empty() {
        Ok(found)
    } else {
        let left = bytes.rest.len();
        Err(Problem::Malformed(format!("expected the end after {count} entries, found {left} more bytes")))
    }
}

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Problem> {
        let cut = || Problem::Malformed(format!("the file ends within entry {}", self.entry));
        let (taken, rest) = self.rest.split_at_checked(count).ok_or_else(cut)?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Problem> {
        let taken = self.take(N)?;
        Ok(std::array::from_fn(|i| taken[i]))
    }

    fn u32(&mut self) -> Result<u32, Problem> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn u64(&mut self) -> Result<u64, Problem> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    fn f64(&mut self) -> Result<f64, Problem> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    fn floats<const N: usize>(&mut self) -> Result<[f64; N], Problem> {
        let mut floats = [0.0; N];
        for slot in &mut floats {
            *slot = self.f64()?;
        }
        Ok(floats)
    }

    fn name(&mut self) -> Result<String, Problem> {
        let length = self.rest.iter().position(|&b| b == 0).unwrap_or(self.rest.len());
        let name = String::from_utf8_lossy(self.take(length)?).into_owned();
        self.take(1)?;
        Ok(name)
    }

    fn skip(&mut self, count: u64, size: usize) -> Result<(), Problem> {
        let bytes = usize::try_from(count).ok().and_then(|count| count.checked_mul(size));
        self.take(bytes.unwrap_or(usize::MAX)).map(|_| ())
    }
}
