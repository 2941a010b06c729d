use super::*;
use crate::testing::assert_named;
use flate2::Compression;
use flate2::write::GzEncoder;
use lgs_core::linear::quat_normalize;
use lgs_core::{sh_coefficients, stream};
use rand::RngExt;
use std::fs;
use std::io::Write;
use std::path::PathBuf;

/// Gaussians of ordinary values, more than a chunk of them.
fn cloud(n: usize, sh_degree: usize) -> GaussianCloud {
    let mut rng = stream(5, "splats test", sh_degree as u64);
    let mut value = |size: f32| rng.random_range(-size..size);
    GaussianCloud {
        means: (0..n).map(|_| [value(3.0), value(3.0), value(3.0)]).collect(),
        rotations: (0..n).map(|_| [value(1.0), value(1.0), value(1.0), value(1.0)]).collect(),
        log_scales: (0..n).map(|_| [value(1.0) - 4.0, value(1.0) - 4.0, value(1.0) - 4.0]).collect(),
        raw_opacities: (0..n).map(|_| value(4.0)).collect(),
        sh: (0..n * 3 * sh_coefficients(sh_degree)).map(|_| value(0.9)).collect(),
        sh_degree,
    }
}

fn file(folder: &tempfile::TempDir, format: SplatFormat) -> PathBuf {
    folder.path().join(format!("a.{}", format.extension()))
}

/// Largest error of centres, logarithms of scales, opacities, rotations as half angles, and harmonics of
/// degree 0 and above.
fn errors_of(found: &GaussianCloud, expected: &GaussianCloud) -> [f32; 6] {
    let most = |values: &[f32], others: &[f32]| {
        values.iter().zip(others).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    let opacities = |c: &GaussianCloud| (0..c.len()).map(|i| c.opacity(i)).collect::<Vec<f32>>();
    let turn = |(a, b): (&[f32; 4], &[f32; 4])| {
        let (a, b) = (quat_normalize(*a), quat_normalize(*b));
        let apart = |sign: f32| (0..4).map(|i| (a[i] - sign * b[i]).powi(2)).sum::<f32>().sqrt();
        apart(1.0).min(apart(-1.0))
    };
    let harmonics = |c: &GaussianCloud, base: bool| -> Vec<f32> {
        let rows = c.sh.chunks_exact(c.sh_stride());
        rows.flat_map(|sh| if base { sh[..3].to_vec() } else { sh[3..].to_vec() }).collect()
    };
    [
        most(found.means.as_flattened(), expected.means.as_flattened()),
        most(found.log_scales.as_flattened(), expected.log_scales.as_flattened()),
        most(&opacities(found), &opacities(expected)),
        found.rotations.iter().zip(&expected.rotations).map(turn).fold(0.0, f32::max),
        most(&harmonics(found, true), &harmonics(expected, true)),
        most(&harmonics(found, false), &harmonics(expected, false)),
    ]
}

/// Half a step of each quantity, and a little for rounding.
fn bounds(format: SplatFormat) -> [f32; 6] {
    let (byte, dc) = (0.5 / 255.0, 0.5 / 255.0 / lgs_core::SH_C0);
    let exact = [1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6];
    let steps = match format {
        SplatFormat::Ply => [0.0; 6],
        // 10 bits over a chunk of 6 units, and of 2; colours over their own range of 1.8 C0.
        SplatFormat::CompressedPly => [3.0 / 1023.0, 1.0 / 1023.0, byte, 2e-3, 1.8 * byte, 4.0 / 256.0],
        SplatFormat::Splat => [0.0, 0.0, byte, 1e-2, dc, 0.0],
        SplatFormat::Spz => [2e-6, 0.5 / 16.0, byte, 3e-3, byte / 0.15, 0.5 / 128.0],
    };
    std::array::from_fn(|i| 1.01 * steps[i] + exact[i])
}

#[test]
fn every_format_round_trips_within_its_quantisation_and_then_exactly() {
    let folder = tempfile::tempdir().unwrap();
    for format in SplatFormat::ALL {
        let path = file(&folder, format);
        for (n, degree) in [(0, 0), (1, 0), (300, 0), (256, 1), (257, 2), (513, 3)] {
            let cloud = cloud(n, degree);
            write_splats(&path, &cloud, format).unwrap();
            assert_eq!(SplatFormat::of_file(&path).unwrap(), format);
            if n == 0 && format == SplatFormat::Splat {
                let error = read_splats(&path).unwrap_err().to_string();
                assert!(error.contains("found 0 bytes"), "a file without a header cannot say that: {error}");
                continue;
            }
            let read = read_splats(&path).unwrap();
            let kept = if format == SplatFormat::Splat { 0 } else { degree };
            assert_eq!((read.len(), read.sh_degree), (n, kept));
            assert_eq!(read.validate(), Ok(()));
            let (errors, bounds) = (errors_of(&read, &cloud), bounds(format));
            assert!(errors.iter().zip(bounds).all(|(e, b)| *e <= b), "{format:?}: {errors:?}, {bounds:?}");
            write_splats(&path, &read, format).unwrap();
            let again = read_splats(&path).unwrap();
            // Of two components as good as equal another one may count as the largest: one more half step.
            let drift = errors_of(&again, &read);
            let still = |i: usize| drift[i] <= if i == 3 { bounds[3] } else { 4e-6 };
            assert!((0..6).all(still), "{format:?} drifts by {drift:?}");
        }
    }
}

#[test]
fn values_at_the_ends_of_the_ranges_stay_finite() {
    let folder = tempfile::tempdir().unwrap();
    let mut extreme = cloud(4, 1);
    extreme.raw_opacities = vec![-1e9, 1e9, -30.0, 30.0];
    extreme.log_scales = vec![[-300.0; 3], [88.0; 3], [0.0; 3], [-10.0; 3]];
    extreme.rotations = vec![[0.0; 4], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.5, -0.5, 0.5, -0.5]];
    extreme.sh[..4].copy_from_slice(&[1e9, -1e9, 40.0, 40.0]);
    for format in SplatFormat::ALL {
        let path = file(&folder, format);
        write_splats(&path, &extreme, format).unwrap();
        let read = read_splats(&path).unwrap();
        assert_eq!(read.validate(), Ok(()), "{format:?}");
        assert!(read.opacity(0) < 0.002 && read.opacity(1) > 0.998);
        let turns = [2, 3].map(|i| quat_normalize(read.rotations[i]));
        assert!(turns[0][2].abs() > 0.999 && (turns[1][0] * turns[1][1] + 0.25).abs() < 0.01, "{turns:?}");
    }
    extreme.log_scales[2] = [0.0, 300.0, 0.0];
    for format in [SplatFormat::Ply, SplatFormat::CompressedPly] {
        let path = file(&folder, format);
        write_splats(&path, &extreme, format).unwrap();
        let error = read_splats(&path).unwrap_err().to_string();
        assert!(error.contains("`scale_1` of vertex 2"), "{error}");
    }
    let far = GaussianCloud::isotropic(vec![[0.0; 3], [1e7, 0.0, 0.0]], 0.1, [0.5; 3], 0.5);
    let error = write_splats(&file(&folder, SplatFormat::Spz), &far, SplatFormat::Spz).unwrap_err();
    assert!(error.to_string().contains("`position` of Gaussian 1"), "{error}");
}

/// A Gaussian whose bytes were worked out by hand from the descriptions of the formats.
fn one() -> GaussianCloud {
    GaussianCloud {
        means: vec![[1.0, 2.0, -3.0]],
        rotations: vec![[0.0, 0.6, 0.0, 0.8]],
        log_scales: vec![[0.0, -1.0, -2.0]],
        raw_opacities: vec![0.0],
        sh: vec![0.0, 1.0, -1.0],
        sh_degree: 0,
    }
}

#[test]
fn splat_bytes_are_those_of_the_description() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder, SplatFormat::Splat);
    write_splats(&path, &one(), SplatFormat::Splat).unwrap();
    let floats = [1.0, 2.0, -3.0, 1.0, (-1.0_f32).exp(), (-2.0_f32).exp()];
    let mut expected: Vec<u8> = floats.iter().flat_map(|v| v.to_le_bytes()).collect();
    expected.extend([128, 199, 56, 128, 128, 205, 128, 230]);
    assert_eq!(fs::read(&path).unwrap(), expected);
}

#[test]
fn compressed_ply_words_are_those_of_the_description() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder, SplatFormat::CompressedPly);
    let mut two = one();
    two.means.push([3.0, 4.0, -1.0]);
    two.rotations.push([2.0, 0.0, 0.0, 0.0]);
    two.log_scales.push([1.0, -1.0, -1.0]);
    two.raw_opacities.push(100.0);
    two.sh.extend([0.0; 3]);
    write_splats(&path, &two, SplatFormat::CompressedPly).unwrap();
    let bytes = fs::read(&path).unwrap();
    let words: Vec<u32> =
        bytes[bytes.len() - 32..].as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    // The largest of 0, 0.6, 0, 0.8 is the last; 0.6 / √2 + 0.5 is 946 of 1023.
    let first = [0, 3 << 30 | 512 << 20 | 946 << 10 | 512, 0, 255 << 16 | 128];
    // The second is at the upper bound of everything that has bounds, but for red, green and y of the scales.
    let scales = 2047 << 21 | 2047;
    let second = [u32::MAX, 512 << 20 | 512 << 10 | 512, scales, 255 << 8 | 255];
    assert_eq!(words, [first, second].concat());
}

#[test]
fn spz_bytes_are_those_of_the_description() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder, SplatFormat::Spz);
    write_splats(&path, &one(), SplatFormat::Spz).unwrap();
    let bytes = fs::read(&path).unwrap();
    let mut columns = Vec::new();
    std::io::Read::read_to_end(&mut flate2::read::GzDecoder::new(bytes.as_slice()), &mut columns).unwrap();
    let mut expected = b"NGSP\x03\0\0\0\x01\0\0\0\0\x14\0\0".to_vec();
    // 20 bits behind the point; y and z turn over: 1, −2, 3.
    expected.extend([0, 0, 0x10, 0, 0, 0xe0, 0, 0, 0x30]);
    expected.extend([128, 128, 166, 89, 160, 144, 128]);
    // x y z w = 0.6, 0, −0.8, 0 is the rotation −0.6, 0, 0.8, 0: largest 2; −434/511, 0, 0 of 1/√2.
    expected.extend((2_u32 << 30 | (512 + 434) << 20).to_le_bytes());
    assert_eq!(columns, expected);
    let read = read_splats(&path).unwrap();
    let turned = quat_normalize(read.rotations[0]);
    assert!((turned[1] * turned[3] - 0.48).abs() < 2e-3, "{turned:?}");
}

#[test]
fn version_2_of_spz_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder, SplatFormat::Spz);
    let mut columns = b"NGSP\x02\0\0\0\x01\0\0\0\x01\x0c\0\0".to_vec();
    columns.extend([0, 0x10, 0, 0, 0xe0, 0xff, 0, 0x30, 0, 255, 0, 128, 255, 160, 160, 160]);
    columns.extend([128, 204, 128, 128, 192, 64, 0, 128, 255, 128, 128, 128]);
    fs::write(&path, gzip(&columns)).unwrap();
    let read = read_splats(&path).unwrap();
    assert_eq!((read.means[0], read.log_scales[0]), ([1.0, 2.0, -3.0], [0.0; 3]));
    let [w, x, y, z] = read.rotations[0];
    assert!((w - 0.8).abs() < 0.01 && (y + 0.6).abs() < 0.01 && x.abs() < 0.01 && z.abs() < 0.01);
    // Harmonics of y and z change sign, that of x does not.
    assert_eq!(read.sh[3..9], [0.0, -0.5, 0.5, 1.0, 0.0, -127.0 / 128.0]);
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(bytes).unwrap();
    gzip.finish().unwrap()
}

fn refused(path: &Path, bytes: &[u8], words: &[&str]) {
    fs::write(path, bytes).unwrap();
    assert_named(&read_splats(path).unwrap_err(), path, words);
}

#[test]
fn files_cut_anywhere_and_counts_that_lie_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    for format in SplatFormat::ALL {
        let path = file(&folder, format);
        write_splats(&path, &cloud(3, 1), format).unwrap();
        let whole = fs::read(&path).unwrap();
        for length in (0..whole.len()).filter(|length| format != SplatFormat::Splat || length % 32 > 0) {
            refused(&path, &whole[..length], &[]);
        }
    }
    let spz = file(&folder, SplatFormat::Spz);
    let header = |version: u8, count: u32, degree: u8, bits: u8, flags: u8| {
        let count = count.to_le_bytes();
        gzip(&[b"NGSP", &[version, 0, 0, 0], count.as_slice(), &[degree, bits, flags, 0], &[0; 20]].concat())
    };
    refused(&spz, &header(3, u32::MAX, 3, 12, 0), &["for 4294967295 Gaussians"]);
    refused(&spz, &header(3, 2, 0, 12, 0), &["expected 40 bytes for 2 Gaussians, found 20"]);
    refused(&spz, &header(3, 0, 0, 12, 0), &["expected 0 bytes"]);
    refused(&spz, &header(1, 1, 0, 12, 0), &["`version`: expected 2 or 3, found 1"]);
    refused(&spz, &header(3, 1, 4, 12, 0), &["harmonics"]);
    refused(&spz, &header(3, 1, 0, 24, 0), &["fractional bits"]);
    refused(&spz, &header(3, 1, 0, 12, 2), &["extensions"]);
    refused(&spz, b"NGSP\x04\0\0\0", &["`version`"]);
    refused(&spz, &gzip(b"PGSN000000000000"), &["`magic`"]);
}

#[test]
fn impossible_values_and_lying_elements_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let splat = file(&folder, SplatFormat::Splat);
    write_splats(&splat, &cloud(2, 0), SplatFormat::Splat).unwrap();
    let whole = fs::read(&splat).unwrap();
    let with = |at: usize, bytes: &[u8]| [&whole[..at], bytes, &whole[at + bytes.len()..]].concat();
    refused(&splat, &with(36, &f32::NAN.to_le_bytes()), &["`position` of Gaussian 1"]);
    refused(&splat, &with(12, &(-1.0_f32).to_le_bytes()), &["`scale` of Gaussian 0", "found -1"]);
    refused(&splat, &with(60, &[128; 4]), &["`rotation` of Gaussian 1"]);
    let packed = file(&folder, SplatFormat::CompressedPly);
    write_splats(&packed, &cloud(300, 1), SplatFormat::CompressedPly).unwrap();
    let whole = fs::read(&packed).unwrap();
    let edited = |from: &str, to: &str| {
        let at = whole.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        [&whole[..at], to.as_bytes(), &whole[at + from.len()..]].concat()
    };
    refused(&packed, &edited("element chunk 2", "element chunk 9999999"), &["element `chunk`"]);
    refused(&packed, &edited("element vertex 300", "element vertex 301"), &["element `"]);
    refused(&packed, &edited("uint packed_scale", "int packed_scale"), &["`packed_scale`", "uint"]);
    refused(&packed, &edited("property uchar f_rest_8\n", ""), &["element `sh`"]);
    let chunks = edited("element chunk 2", "element chunk 1");
    refused(&packed, &[chunks.as_slice(), &[0; 0]].concat(), &["`"]);
    let at = whole.len() - 300 * (16 + 9) - 2 * 72;
    let nan = [&whole[..at], &f32::NAN.to_le_bytes(), &whole[at + 4..]].concat();
    refused(&packed, &nan, &["`min_x`", "not finite"]);
    refused(&folder.path().join("a.obj"), b"v 0 0 0", &["expected a splat file"]);
}
