//! The server as a page and as a stranger see it.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;
mod training;

use std::io::{Read, Write};
use std::net::TcpStream;

use common::{Running, camera, falling, request};
use lgs_dynamics::{Edit, Reversal};
use lgs_model::Motion;
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::Message;

/// The answer to a request over plain HTTP.
fn http(address: &str, lines: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "{lines}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

fn rendered(edit: Edit, time: f32) -> Vec<u8> {
    let scene = falling();
    let mut motion = Motion::new(&scene, edit, Reversal::default());
    let cloud = scene.cloud_at(&motion.state_at(time), time);
    lgs_eval::render(&cloud, &camera(), scene.background).image.to_rgb8()
}

#[test]
fn exact_pictures_have_the_pixels_of_render_at_all_times_and_under_edits() {
    let server = Running::start(4, None);
    let mut page = server.page();
    assert_eq!(page.hello["times"], json!([-0.75, 2.25]));
    assert_eq!(page.hello["objects"][0]["law"]["coordinates"], "point");
    for (serial, time) in [(1, 0.0), (2, 2.0), (3, -0.5), (4, 0.123)] {
        let (header, pixels) = page.picture(&request(serial, time));
        assert_eq!(header["mime"], "image/png");
        assert!(pixels == rendered(Edit::default(), time as f32), "t = {time}");
    }
    let mut edited = request(5, 1.0);
    edited["edits"] = json!([{"potential": 0.0}]);
    let (_, still) = page.picture(&edited);
    assert!(still == rendered(Edit::default(), 0.0), "without its potential the block does not fall");
    edited["edits"] = json!([{"terms": [0.5]}]);
    edited["serial"] = json!(6);
    let half = Edit { potential_scale: 0.5, ..Edit::default() };
    assert!(page.picture(&edited).1 == rendered(half, 1.0), "half of its only term is half of its potential");
}

#[test]
fn pictures_say_whom_not_to_trust() {
    let server = Running::start(4, None);
    let mut page = server.page();
    assert_eq!(page.picture(&request(1, 0.9)).0["untrusted"], json!([]));
    assert_eq!(page.picture(&request(2, 1.1)).0["untrusted"], json!([0]));
    let mut edited = request(3, 0.5);
    edited["edits"] = json!([{"velocity": 2.0}]);
    assert_eq!(page.picture(&edited).0["untrusted"], json!([0]), "a law that only describes");
}

#[test]
fn objects_are_picked_and_paths_are_sampled() {
    let server = Running::start(4, None);
    let mut page = server.page();
    let view: Value = {
        let mut view = request(7, 0.0);
        view.as_object_mut().unwrap().remove("kind");
        view
    };
    let pick = |pixel: [f64; 2]| json!({"kind": "pick", "view": view, "pixel": pixel}).to_string();
    let (center, _) = camera().pixel_from_world([0.0; 3]);
    page.send(&pick(center.map(f64::from)));
    assert_eq!(page.answer()["object"], 0);
    page.send(&pick([1.0, 1.0]));
    assert_eq!(page.answer()["object"], Value::Null, "the background");
    page.send(&json!({"kind": "paths", "serial": 9, "edits": []}).to_string());
    let paths = page.answer();
    let (first, last) = (&paths["points"][0][0], &paths["points"][0][64]);
    assert_eq!(paths["times"][64], 2.25);
    let fallen = first[2].as_f64().unwrap() - last[2].as_f64().unwrap();
    assert!((fallen - (2.25_f64.powi(2) - 0.75_f64.powi(2))).abs() < 1e-3, "{fallen}");
}

#[test]
fn the_potential_of_an_object_is_sampled_in_its_picture() {
    let server = Running::start(4, None);
    let mut page = server.page();
    let mut view = request(7, 0.0);
    view.as_object_mut().unwrap().remove("kind");
    let mut slice = |view: &Value, object: usize| {
        page.send(&json!({"kind": "slice", "view": view, "object": object}).to_string());
        page.answer()
    };
    let found = slice(&view, 0)["slice"].clone();
    let values: Vec<f64> =
        found["values"].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
    let columns = found["size"][0].as_u64().unwrap() as usize;
    assert!(values[0] > 0.9 && values[values.len() - 1] < 0.1, "the potential falls downwards");
    assert!((values[0] - values[columns - 1]).abs() < 1e-3, "and is level sideways");
    let arrows = found["arrows"].as_array().unwrap();
    assert!(arrows.iter().all(|arrow| arrow[3].as_f64() > arrow[1].as_f64()), "the force points down");
    view["edits"] = json!([{"potential": 2.0}]);
    let spread = |slice: &Value| slice["range"][1].as_f64().unwrap() - slice["range"][0].as_f64().unwrap();
    let doubled = slice(&view, 0)["slice"].clone();
    assert!((spread(&doubled) - 2.0 * spread(&found)).abs() < 1e-3 * spread(&found));
    assert!(slice(&view, 3)["reason"].as_str().unwrap().contains("no object 3"));
}

#[test]
fn the_image_of_the_dataset_and_every_style_is_drawn() {
    let server = Running::start(4, None);
    let mut page = server.page();
    let mut truth = request(1, 0.4);
    truth["model"] = json!("truth");
    let (header, pixels) = page.picture(&truth);
    assert_eq!((&header["time"], pixels[0]), (&json!(0.5), 128));
    let plain = rendered(Edit::default(), 0.0);
    for (serial, style) in [(2, "objects"), (3, "points"), (4, "ellipsoids")] {
        let mut styled = request(serial, 0.0);
        styled["style"] = json!(style);
        assert!(page.picture(&styled).1 != plain, "{style}");
    }
    let mut free = request(5, 0.0);
    free["camera"] = json!({"position": [0, -4, 0.5], "rotation": [0.7, -0.7, 0, 0], "fov_y": 0.6});
    free["quality"] = json!("moving");
    assert_eq!(page.picture(&free).0["mime"], "image/jpeg");
}

#[test]
fn faulty_requests_are_refused_and_malformed_ones_end_the_connection() {
    let server = Running::start(4, None);
    let mut page = server.page();
    let faults = [
        ("time", json!(9.0), "t = 9 is not between"),
        ("size", json!([0, 10]), "each side is 1 to"),
        ("camera", json!({"dataset": 7}), "no camera 7"),
        ("camera", json!({"position": [0, 0, 0], "rotation": [0, 0, 0, 0], "fov_y": 1}), "a camera needs"),
        ("model", json!("source"), "no source model"),
        ("edits", json!([{}, {"velocity": 2}]), "2 edits for 1 objects"),
        ("edits", json!([{"velocity": 1e30}]), "not between -10 and 10"),
        ("edits", json!([{"terms": [1.5, 2]}]), "factors"),
        ("edits", json!([{"terms": [-1]}]), "at least 0"),
    ];
    for (field, value, reason) in faults {
        let mut faulty = request(3, 0.5);
        faulty[field] = value;
        page.send(&faulty.to_string());
        let answer = page.answer();
        assert!(answer["reason"].as_str().unwrap().contains(reason), "{answer}");
    }
    for text in ["", "{}", "{\"kind\":\"frame\"}", "[1]", "\u{0}"] {
        let mut page = server.page();
        page.send(text);
        let Message::Close(Some(close)) = page.message() else { panic!("{text:?} is answered") };
        assert!(close.reason.contains("not a request"), "{close:?}");
    }
    page.picture(&request(20, 0.1));
}

#[test]
fn strangers_are_kept_out() {
    let server = Running::start(1, None);
    let at = &server.address;
    let page = http(at, &format!("GET / HTTP/1.1\r\nHost: {at}"));
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("<!doctype html>"), "{page}");
    assert!(page.contains("content-security-policy: default-src 'self'"), "{page}");
    for path in ["/../Cargo.toml", "/etc/passwd", "/%2e%2e/Cargo.toml", "/config.toml"] {
        let answer = http(at, &format!("GET {path} HTTP/1.1\r\nHost: {at}"));
        assert!(answer.starts_with("HTTP/1.1 404"), "{path}: {answer}");
    }
    assert!(http(at, "GET / HTTP/1.1\r\nHost: evil.example").starts_with("HTTP/1.1 403"));
    let socket = format!(
        "GET /socket HTTP/1.1\r\nHost: {at}\r\nOrigin: http://evil.example\r\nUpgrade: websocket\r\n\
         Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="
    );
    assert!(http(at, &socket).starts_with("HTTP/1.1 403"), "a socket from another site");
    let _first = server.page();
    let mut second = server.page();
    assert_eq!(second.hello, Value::Null, "there is room for one page");
    assert!(second.is_closed());
    let secret = Running::start(1, Some("a-secret-word"));
    let at = &secret.address;
    assert!(http(at, &format!("GET / HTTP/1.1\r\nHost: {at}")).starts_with("HTTP/1.1 403"));
    let open = http(at, &format!("GET /?token=a-secret-word HTTP/1.1\r\nHost: {at}"));
    assert!(open.contains("set-cookie: lagrangegs_token=a-secret-word; HttpOnly; SameSite=Strict"), "{open}");
}

#[test]
fn a_page_that_does_not_read_delays_nobody_and_random_input_leaves_no_stuck_picture() {
    let server = Running::start(3, None);
    let mut silent = server.page();
    for serial in 0..400 {
        let mut large = request(serial, 0.01 * (serial % 200) as f64);
        large["size"] = json!([400, 300]);
        silent.send(&large.to_string());
    }
    let mut page = server.page();
    let mut random = lgs_core::stream(5, "random input", 0);
    for serial in 0..300 {
        let mut any = |range: f64| range * rand::RngExt::random::<f64>(&mut random);
        let mut next = request(serial, any(3.0) - 0.75);
        next["pane"] = json!(serial % 2);
        next["quality"] = json!(["moving", "still", "exact"][any(3.0) as usize]);
        next["edits"] = json!([{"potential": any(2.0).round(), "velocity": any(3.0).round()}]);
        page.send(&next.to_string());
    }
    let (header, _) = page.picture(&request(1000, 1.0));
    let kept = header["kept"].as_array().unwrap();
    assert!(kept[0].as_u64() <= kept[1].as_u64(), "rollouts take {kept:?}");
}
