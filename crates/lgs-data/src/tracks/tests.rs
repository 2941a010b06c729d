use super::*;
use crate::testing::{C3d, C3dForm, Processor, assert_named};
use std::fs;
use std::path::PathBuf;

/// Two points: one in free fall, one at rest; the second is not seen at time 3.
fn frames() -> Vec<Vec<Option<[f32; 3]>>> {
    let falling = |t: f32| Some([100.0 * t, -50.0, 1000.0 - 20.0 * t * t]);
    (0..8).map(|t| vec![falling(t as f32), (t != 3).then_some([-250.0, 0.5, 0.0])]).collect()
}

fn file(folder: &tempfile::TempDir, name: &str, contents: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, contents).unwrap();
    path
}

fn of(processor: Processor, form: C3dForm, frames: &[Vec<Option<[f32; 3]>>]) -> C3d<'_> {
    C3d { processor, form, rate: 100.0, unit: "mm", labels: &["ball", "corner 1"], analog: 3, frames }
}

fn c3d_file(processor: Processor, form: C3dForm, frames: &[Vec<Option<[f32; 3]>>]) -> Vec<u8> {
    of(processor, form, frames).bytes()
}

fn refused(path: &Path, words: &[&str]) {
    assert_named(&read_tracks(path).unwrap_err(), path, words);
}

#[test]
fn c3d_files_of_every_processor_and_form_are_read() {
    let folder = tempfile::tempdir().unwrap();
    for processor in [Processor::Intel, Processor::Dec, Processor::Sgi] {
        for form in [C3dForm::Float, C3dForm::Integer(0.5)] {
            let path = file(&folder, "a.c3d", c3d_file(processor, form, &frames()));
            let tracks = read_tracks(&path).unwrap();
            assert_eq!(tracks.labels, ["ball", "corner 1"]);
            assert_eq!(tracks.unit, LengthUnit { name: "mm".to_owned(), metres: Some(1e-3) });
            assert_eq!(tracks.points, frames(), "{processor:?} {form:?}");
            assert!((tracks.times[7] - 0.07).abs() < 1e-12);
        }
    }
}

#[test]
fn a_c3d_file_cut_anywhere_is_named_and_takes_no_memory() {
    let folder = tempfile::tempdir().unwrap();
    let whole = c3d_file(Processor::Intel, C3dForm::Float, &frames());
    for length in (0..whole.len()).step_by(37) {
        refused(&file(&folder, "cut.c3d", &whole[..length]), &["expected"]);
    }
    let mut lying = whole.clone();
    let at = lying.windows(6).position(|bytes| bytes == b"FRAMES").unwrap() + 6 + 4;
    lying[at..at + 2].copy_from_slice(&60_000_u16.to_le_bytes());
    refused(&file(&folder, "lying.c3d", lying), &["frames (60000 of 2 points)", "expected 2640000 bytes"]);
    let none = C3d {
        labels: &[],
        frames: &[vec![], vec![]],
        analog: 0,
        ..of(Processor::Intel, C3dForm::Float, &[])
    };
    refused(&file(&folder, "none.c3d", none.bytes()), &["expected points, found none"]);
    for (at, value, word) in [(1, 0x51, "0x50 of a C3D file"), (512 + 3, 83, "`processor`"), (0, 99, "bytes")]
    {
        let mut broken = whole.clone();
        broken[at] = value;
        refused(&file(&folder, "broken.c3d", broken), &[word]);
    }
}

#[test]
fn damaged_parameters_never_panic() {
    let whole = c3d_file(Processor::Sgi, C3dForm::Integer(0.5), &frames());
    for at in 512..1024 {
        for value in [0, 1, 0x7f, 0x80, 0xff] {
            let mut broken = whole.clone();
            broken[at] = value;
            let _ = c3d::parse(&broken);
        }
    }
}

const PLAIN: &str = "time (s),a_x (mm),a_y (mm),a_z (mm),b_x (mm),b_y (mm),b_z (mm)\n\
                     0.5,1,2,3,4,5,6\n0.51,1.5,2,3,,,\n";
const BARE: &str = "0.5;1;2;3;4;5;6\n\n0.51;1.5;2;3;nan;nan;nan\n";
const QUALISYS: &str = "NO_OF_FRAMES\t2\nNO_OF_MARKERS\t2\nFREQUENCY\t100\nMARKER_NAMES\ta\tb\n\
                        1\t2\t3\t4\t5\t6\n1.5\t2\t3\t0.000\t0.000\t0.000\t\n";
const TIMED: &str = "NO_OF_MARKERS\t2\nFREQUENCY\t100\nMARKER_NAMES\ta\tb\n\
                     TRAJECTORY_TYPES\tMeasured\tMixed\nFrame\tTime\ta X\ta Y\ta Z\tb X\tb Y\tb Z\n\
                     1\t0.00000\t1\t2\t3\t4\t5\t6\n2\t0.01000\t1.5\t2\t3\t\t\t\n";
const NEXUS: &str = "Joints\n100\n\nTrajectories\n100\n,,S:a,,,S:b,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n\
                     ,,mm,mm,mm,mm,mm,mm\n1,0,1,2,3,4,5,6\n2,0,1.5,2,3,,,\n\nModel Outputs\n100\n";

/// A rigid body, its rotation first, and the two markers.
fn motive() -> String {
    let row = |word: &str, [first, second]: [String; 2]| format!("{word}{first}{second}\n");
    [
        "Format Version,1.23,Take Name,\"one, two\",Capture Frame Rate,100.0,Length Units,Millimeters\n\n",
        &row(",Type", [",Rigid Body".repeat(7), ",Marker".repeat(6)]),
        &row(",Name", [",R".repeat(7), [",a".repeat(3), ",b".repeat(3)].concat()]),
        &row(",", [",Rotation".repeat(4), ",Position".repeat(9)]),
        "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z,X,Y,Z\n",
        "0,0.0,0,0,0,1,9,9,9,1,2,3,4,5,6\n1,0.01,0,0,0,1,9,9,9,1.5,2,3,,,\n",
    ]
    .concat()
}

#[test]
fn tables_of_every_program_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let expected = [vec![Some([1.0, 2.0, 3.0]), Some([4.0, 5.0, 6.0])], vec![Some([1.5, 2.0, 3.0]), None]];
    let motive = motive();
    let cases = [
        ("plain.csv", PLAIN, "mm", ["a", "b"]),
        ("bare.csv", BARE, "", ["1", "2"]),
        ("qualisys.tsv", QUALISYS, "mm", ["a", "b"]),
        ("timed.tsv", TIMED, "mm", ["a", "b"]),
        ("nexus.csv", NEXUS, "mm", ["S:a", "S:b"]),
        ("motive.csv", &motive, "Millimeters", ["a", "b"]),
    ];
    for (name, text, unit, labels) in cases {
        let tracks = read_tracks(&file(&folder, name, text)).unwrap();
        assert_eq!(tracks.labels, labels, "{name}");
        assert_eq!(tracks.unit.name, unit, "{name}");
        assert_eq!(tracks.points, expected, "{name}");
        assert!(
            tracks.times[0] == 0.0 && (tracks.times[1] - 0.01).abs() < 1e-9,
            "{name}: {:?}",
            tracks.times
        );
        for end in 0..text.len() {
            let _ = table::parse(&text.as_bytes()[..end]);
        }
    }
}

#[test]
fn what_is_wrong_with_a_table_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for (text, words) in [
        ("", "expected rows, found none"),
        ("frame,x1,y1,z1\n0,1,2,3\n", "found a first row `frame,x1,y1,z1`"),
        ("time,x1,y1\n0,1,2\n", "found 2 columns"),
        ("time,x1,z1,y1\n0,1,2,3\n", "`x1,z1,y1`"),
        (
            "time,x1,y1,z1\n0,1,2,3\n0.1,1,here,3\n",
            "line 3, column 3: expected a finite number, found `here`",
        ),
        ("time,x1,y1,z1\n0,1,2,inf\n", "line 2, column 4"),
        ("time,x1,y1,z1\n,1,2,3\n", "line 2, column 1"),
        ("time,x1,y1,z1\n0,1,2,3\n0.1,1,2\n", "line 3: expected 4 cells, found 3"),
        ("time,x1,y1,z1\n0.2,1,2,3\n0.1,1,2,3\n", "found 0.2 before 0.1"),
        ("time,x1,y1,z1\n", "expected times, found none"),
        ("time\n0\n", "expected points, found none"),
        ("NO_OF_MARKERS\t1\nMARKER_NAMES\ta\n1\t2\t3\n", "`FREQUENCY`"),
        ("Trajectories\nfast\n,,a\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n", "`fast`"),
    ] {
        refused(&file(&folder, "bad.csv", text), &[words]);
    }
    refused(&folder.path().join("absent.csv"), &["read file"]);
}

#[test]
fn short_gaps_are_filled_and_points_with_long_ones_are_left_out() {
    let curve = |t: f64| [3.0 * t, 0.0, 2.0 - 4.9 * t * t].map(|v| v as f32);
    let times: Vec<f64> = (0..101).map(|t| 0.01 * f64::from(t)).collect();
    let seen = |label: &str, t: usize| match label {
        "whole" => true,
        "short gap" => !(40..44).contains(&t),
        "long gap" => !(40..46).contains(&t),
        "late" => t > 5,
        "early" => t < 90,
        _ => false,
    };
    let labels = ["whole", "short gap", "long gap", "late", "early", "never"];
    let mut points: Vec<Vec<Option<[f32; 3]>>> = (0..101)
        .map(|t| labels.iter().map(|label| seen(label, t).then(|| curve(times[t]))).collect())
        .collect();
    let labels = labels.map(str::to_owned).to_vec();
    let tracks = PointTracks { labels, unit: LengthUnit::named("mm"), times, points: points.clone() };
    let whole = tracks.whole().unwrap();
    assert_eq!(whole.labels, ["whole", "short gap"]);
    assert_eq!(whole.left_out, ["long gap", "late", "early", "never"]);
    assert_eq!((whole.filled, whole.times.len()), (4, 101));
    for (t, row) in whole.positions.iter().enumerate() {
        for (found, expected) in row[1].iter().zip(curve(0.01 * t as f64)) {
            assert!((found - 1e-3 * expected).abs() < 1e-9, "filled by the curve itself, in metres");
        }
    }
    // Times at which nothing is seen are no part of the recording.
    points[0] = vec![None; 6];
    let trimmed = PointTracks { points, ..tracks.clone() }.whole().unwrap();
    assert_eq!((trimmed.times.len(), trimmed.times[0]), (100, 0.0));
    let none = PointTracks { points: vec![vec![None; 6]; 101], ..tracks };
    assert_eq!(none.whole(), Err(TracksProblem::Empty("seen points")));
}
