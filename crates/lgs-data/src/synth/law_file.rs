//! The laws of a scene as data.

use super::body;
use super::options::SynthOptions;
use super::scenes::Scene;
use serde_json::{Value, json};

/// The contents of `scene.json`.
pub(super) fn law(scene: &Scene, options: &SynthOptions) -> Value {
    let object = |(number, body): (usize, &body::Body)| {
        let mut entry = json!({ "object": number, "name": body.name, "center": body.center.to_array() });
        if let (Some(entry), Value::Object(law)) = (entry.as_object_mut(), body.motion.describe()) {
            entry.extend(law);
        }
        entry
    };
    let objects: Vec<Value> = scene.stage.bodies.iter().enumerate().map(object).collect();
    json!({
        "schema": 1, "scene": scene.info.name, "description": scene.info.description,
        "seed": options.seed, "tau_max": 0.75,
        "expected": if scene.info.explained { "explained" } else { "outside" }, "drawn": scene.info.drawn,
        "objects": objects,
    })
}
