use super::*;
use lgs_core::stream;
use rand::RngExt;
use std::fs;

fn cloud(n: usize, sh_degree: usize) -> GaussianCloud {
    let mut rng = stream(5, "ply test", sh_degree as u64);
    let mut value = || rng.random_range(-2.0f32..2.0);
    GaussianCloud {
        means: (0..n).map(|_| [value(), value(), value()]).collect(),
        rotations: (0..n).map(|_| [value(), value(), value(), value()]).collect(),
        log_scales: (0..n).map(|_| [value(), value(), value()]).collect(),
        raw_opacities: (0..n).map(|_| value()).collect(),
        sh: (0..n * 3 * sh_coefficients(sh_degree)).map(|_| value()).collect(),
        sh_degree,
    }
}

fn problem_of(bytes: &[u8]) -> PlyProblem {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.ply");
    fs::write(&path, bytes).unwrap();
    let error = read_ply(&path).unwrap_err();
    assert!(error.to_string().ends_with("bad.ply"), "{error}");
    match error {
        PlyError::Content { problem, .. } => problem,
        other => panic!("{other}"),
    }
}

fn bytes_of(cloud: &GaussianCloud) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.ply");
    write_ply(&path, cloud).unwrap();
    fs::read(path).unwrap()
}

/// Replaces text in the header.
fn edited(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

#[test]
fn clouds_of_every_degree_round_trip_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    for degree in 0..=3 {
        for n in [0, 1, 17] {
            let path = dir.path().join("a.ply");
            let cloud = cloud(n, degree);
            write_ply(&path, &cloud).unwrap();
            assert_eq!(read_ply(&path).unwrap(), cloud);
        }
    }
}

#[test]
fn the_layout_is_the_inria_one_byte_for_byte() {
    let cloud = cloud(2, 1);
    let mut expected = b"ply\nformat binary_little_endian 1.0\nelement vertex 2\n".to_vec();
    let names = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 f_rest_0 f_rest_1 f_rest_2 f_rest_3 f_rest_4 f_rest_5 \
        f_rest_6 f_rest_7 f_rest_8 \
                 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    for name in names.split_whitespace() {
        expected.extend(format!("property float {name}\n").bytes());
    }
    expected.extend(b"end_header\n");
    for i in 0..2 {
        let sh = &cloud.sh[12 * i..12 * (i + 1)];
        let mut row = cloud.means[i].to_vec();
        row.extend([0.0; 3]);
        row.extend([
            sh[0],
            sh[1],
            sh[2],
            sh[3],
            sh[6],
            sh[9],
            sh[4],
            sh[7],
            sh[10],
            sh[5],
            sh[8],
            sh[11],
            cloud.raw_opacities[i],
        ]);
        row.extend(cloud.log_scales[i]);
        row.extend(cloud.rotations[i]);
        expected.extend(row.iter().flat_map(|v| v.to_le_bytes()));
    }
    assert_eq!(bytes_of(&cloud), expected);
}

#[test]
fn ascii_other_orders_doubles_and_extra_properties_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.ply");
    let text = "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement thing 1\r\nproperty int a\r\n\
        element vertex 1\r\nproperty float rot_3\r\nproperty float rot_0\r\nproperty float rot_1\r\n\
        property float rot_2\r\nproperty uchar red\r\nproperty double z\r\nproperty float x\r\n\
        property float y\r\nproperty float opacity\r\nproperty float f_dc_0\r\n\
        property float f_dc_2\r\nproperty float f_dc_1\r\nproperty float scale_0\r\n\
        property float scale_1\r\nproperty float scale_2\r\n\
        element face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n7\r\n4 1 2 3 255 3.5 1.5 \
        2.5 0.25 10 12 11 -1 -2 -3\r\n3 0 0 0\r\n";
    fs::write(&path, text).unwrap();
    let cloud = read_ply(&path).unwrap();
    assert_eq!((cloud.means[0], cloud.rotations[0]), ([1.5, 2.5, 3.5], [1.0, 2.0, 3.0, 4.0]));
    assert_eq!(
        (cloud.sh.as_slice(), cloud.log_scales[0], cloud.raw_opacities[0]),
        (&[10.0, 11.0, 12.0][..], [-1.0, -2.0, -3.0], 0.25)
    );
}

#[test]
fn big_endian_is_read() {
    let header = "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\n\
        property double y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend(1.5f32.to_be_bytes());
    bytes.extend((-2.25f64).to_be_bytes());
    bytes.extend(3.0f32.to_be_bytes());
    bytes.extend([255, 0, 51]);
    assert_eq!(
        parse_points(&bytes).unwrap(),
        Points { positions: vec![[1.5, -2.25, 3.0]], colors: vec![[1.0, 0.0, 0.2]] }
    );
}

#[test]
fn points_round_trip_and_need_byte_colours() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("points3d.ply");
    let points = Points {
        positions: vec![[1.0, 2.0, 3.0], [-1.0, 0.5, 0.0]],
        colors: vec![[0.0, 0.2, 1.0], [1.0, 0.4, 0.6]],
    };
    write_points(&path, &points).unwrap();
    assert_eq!(read_points(&path).unwrap(), points);
    let bytes = fs::read(&path).unwrap();
    assert_eq!(
        parse_points(&edited(&bytes, "green", "gruen")),
        Err(PlyProblem::Missing { element: "vertex", property: "green".into() })
    );
    assert!(matches!(parse_points(&edited(&bytes, "uchar red", "char red")), Err(PlyProblem::Type { .. })));
}

#[test]
fn a_count_that_does_not_fit_the_bytes_is_an_error_before_any_allocation() {
    let bytes = bytes_of(&cloud(3, 0));
    for count in ["2", "4", "18446744073709551615"] {
        let problem = problem_of(&edited(&bytes, "element vertex 3", &format!("element vertex {count}")));
        assert!(matches!(problem, PlyProblem::Count { .. }), "{count}: {problem}");
    }
    for cut in 0..bytes.len() {
        problem_of(&bytes[..cut]);
    }
}

#[test]
fn wrong_types_missing_properties_and_odd_harmonics_are_named() {
    let bytes = bytes_of(&cloud(3, 1));
    assert_eq!(
        problem_of(&edited(&bytes, "float opacity", "int opacity")),
        PlyProblem::Type { property: "opacity".into(), expected: "float or double", found: "I32".into() }
    );
    assert_eq!(
        problem_of(&edited(&bytes, "rot_3", "rot_9")),
        PlyProblem::Missing { element: "vertex", property: "rot_3".into() }
    );
    assert_eq!(problem_of(&edited(&bytes, "f_rest_8", "f_test_8")), PlyProblem::Harmonics(8));
    assert_eq!(
        problem_of(&edited(&bytes, "f_rest_8", "f_rest_9")),
        PlyProblem::Missing { element: "vertex", property: "f_rest_8".into() }
    );
    assert_eq!(
        problem_of(&edited(&bytes, "element vertex", "element vortex")),
        PlyProblem::NoElement("vertex")
    );
    for (from, to) in [
        ("ply\n", "pny\n"),
        ("float x", "flout x"),
        ("vertex 3", "vertex -3"),
        ("1.0", "2.0"),
        (" nx", " x"),
        ("end_header", "end"),
    ] {
        assert!(matches!(problem_of(&edited(&bytes, from, to)), PlyProblem::Header { .. }), "{from} -> {to}");
    }
    assert!(matches!(
        problem_of(&edited(&bytes, "property float x", "property list uchar int x")),
        PlyProblem::Type { .. }
    ));
    assert!(matches!(problem_of(b""), PlyProblem::Header { line: 1, .. }));
}

#[test]
fn nan_is_named_with_its_property_and_vertex() {
    let mut bytes = bytes_of(&cloud(3, 0));
    let row = 4 * 17;
    let at = bytes.len() - 2 * row + 4; // `y` of vertex 1
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let problem = problem_of(&bytes);
    assert!(
        matches!(&problem, PlyProblem::NonFinite { property, index: 1, .. } if property == "y"),
        "{problem}"
    );
}

#[test]
fn text_that_is_no_number_is_named() {
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n1 two 3 0 0 0\n";
    assert_eq!(
        parse_points(text.as_bytes()),
        Err(PlyProblem::Number { element: "vertex", property: "y".into(), index: 0, found: "two".into() })
    );
}

#[test]
fn an_invalid_cloud_is_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.ply");
    let mut bad = cloud(3, 0);
    bad.means[1][0] = f32::INFINITY;
    assert!(matches!(write_ply(&path, &bad), Err(PlyError::Content { problem: PlyProblem::Cloud(_), .. })));
    assert!(!path.exists());
}
