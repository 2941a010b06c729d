//! The file form of laws: what is written is read, and each fault has an error that names it.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use lgs_mechanics::Law;

const GRAVITY: &str = r#"{
    "coordinates": { "kind": "point" }, "step": 0.01,
    "terms": [
        { "kind": "uniform-field", "on": "whole",
          "parameters": { "field-x": 0.0, "field-y": 0.0, "field-z": -9.81 } },
        { "kind": "linear-drag", "on": "whole", "parameters": { "rate": 0.3 } }
    ]
}"#;

#[test]
fn laws_are_read_as_they_were_written() {
    for (mut law, _) in common::examples() {
        for with_deviations in [false, true] {
            if with_deviations {
                law.deviations = law.parameters.iter().map(|value| 0.01 * value.abs()).collect();
            }
            let text = serde_json::to_string(&law).unwrap();
            assert_eq!(serde_json::from_str::<Law>(&text).unwrap(), law, "{text}");
        }
    }
    assert_eq!(serde_json::from_str::<Law>(GRAVITY).unwrap().parameters, [0.0, 0.0, -9.81, 0.3]);
}

/// The error of the file with one change.
fn error(from: &str, to: &str) -> String {
    assert!(GRAVITY.contains(from));
    serde_json::from_str::<Law>(&GRAVITY.replace(from, to)).unwrap_err().to_string()
}

#[test]
fn faults_are_named() {
    let expect = |from: &str, to: &str, part: &str| {
        let message = error(from, to);
        assert!(message.contains(part), "{message}");
    };
    expect("linear-drag", "perpetual-motion", "unknown term `perpetual-motion`; known are uniform-field");
    expect("\"on\": \"whole\"", "\"on\": \"spin\"", "cannot act on `spin` of point coordinates");
    expect("\"rate\": 0.3", "\"rate\": -0.3", "`rate` of linear-drag is -0.3");
    expect("\"rate\": 0.3", "", "parameters of linear-drag without `rate`: 1 values expected, 0 found");
    expect("\"rate\": 0.3", "\"rate\": 0.3, \"mass\": 1.0", "unknown `mass`");
    expect("\"kind\": \"point\"", "\"kind\": \"string\"", "unknown variant `string`");
    expect("\"step\": 0.01", "\"step\": 0.0", "the step is 0");
    let hinge = r#""kind": "hinge", "axis": [0.0, 0.0, 2.0], "pivot": [0.0, 0.0, 0.0]"#;
    expect("\"kind\": \"point\"", hinge, "length of the axis is 2");
    let empty = r#""kind": "modal", "affine": [], "further": 0"#;
    expect("\"kind\": \"point\"", empty, "modes: 1 values expected, 0 found");
}
