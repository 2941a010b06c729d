//! Pages that ask a running viewer for random pictures, and what they get:
//! `cargo run --release -p lgs-view --example soak ADDRESS SECONDS PAGES`, with the address of a viewer of a
//! finished run as `lagrangegs view RUN` prints it, without `http://` (127.0.0.1:7007).
//!
//! Every page turns its camera, and now and then jumps in time, edits physics, changes style, picks, or asks
//! for paths. It fails if a page waits for a picture for ten seconds.

use std::error::Error;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use rand::RngExt;
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::stream::MaybeTlsStream;
use tokio_tungstenite::tungstenite::{Message, WebSocket, connect};

/// Longest wait for a picture.
const STUCK: Duration = Duration::from_secs(10);

/// What a page got.
struct Got {
    pictures: usize,
    /// Sorted, milliseconds.
    waits: Vec<f32>,
    bytes: usize,
    kept: [u64; 2],
}

type Fault = Box<dyn Error + Send + Sync>;

fn main() -> Result<(), Fault> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [address, seconds, pages] = &words[..] else {
        return Err("three words: ADDRESS SECONDS PAGES".into());
    };
    let (seconds, pages): (u64, u64) = (seconds.parse()?, pages.parse()?);
    let ask = |page| ask(address, Duration::from_secs(seconds), page);
    let got: Vec<Got> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..pages).map(|page| scope.spawn(move || ask(page))).collect();
        let ended = threads.into_iter().map(|thread| thread.join().map_err(|_| "a page panicked"));
        ended.map(|ended| ended?).collect::<Result<_, Fault>>()
    })?;
    for (page, got) in got.iter().enumerate() {
        let at = |part: usize| got.waits.get(part * got.waits.len() / 100).copied().unwrap_or_default();
        println!(
            "page {page}: {:.1} pictures per second, median wait {:.0} ms, 99 % within {:.0} ms, {} kB each, \
             rollouts {} of {} MiB",
            got.pictures as f64 / seconds as f64,
            at(50),
            at(99),
            got.bytes / got.pictures.max(1) / 1000,
            got.kept[0] >> 20,
            got.kept[1] >> 20
        );
    }
    let all: usize = got.iter().map(|got| got.pictures).sum();
    println!("{pages} pages: {:.1} pictures per second", all as f64 / seconds as f64);
    Ok(())
}

/// One page's requests until the time is over, each after the picture of the one before.
fn ask(address: &str, time: Duration, page: u64) -> Result<Got, Fault> {
    let (mut socket, _) = connect(format!("ws://{address}/socket"))?;
    if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
        stream.set_read_timeout(Some(STUCK))?;
    }
    let hello: Value = serde_json::from_str(socket.read()?.to_text()?)?;
    let objects = hello["objects"].as_array().map_or(0, Vec::len);
    let [first, last] = [&hello["times"][0], &hello["times"][1]].map(|time| time.as_f64().unwrap_or(0.0));
    let mut got = Got { pictures: 0, waits: Vec::new(), bytes: 0, kept: [0; 2] };
    let mut request = frame(&hello);
    let (begun, mut serial) = (Instant::now(), 0);
    while begun.elapsed() < time {
        serial += 1;
        let mut random = lgs_core::stream(page, "soak", serial);
        let mut any = |range: f64| range * random.random::<f64>();
        request["serial"] = json!(serial);
        request["camera"] = orbit(&hello, 0.05 * serial as f64 + page as f64);
        match any(40.0) as usize {
            0 => request["time"] = json!(first + any(last - first)),
            1 => request["edits"] = json!(vec![json!({"potential": any(3.0).round()}); objects]),
            2 => request["edits"] = json!([]),
            3 => request["style"] = json!(["color", "objects", "points", "ellipsoids"][any(4.0) as usize]),
            4 => request["quality"] = json!(["moving", "still", "exact"][any(3.0) as usize]),
            5 => other(&mut socket, &request, json!({"kind": "pick", "pixel": [any(400.0), any(400.0)]}))?,
            6 => other(&mut socket, &request, json!({"kind": "slice", "object": 0}))?,
            _ => {}
        }
        let asked = Instant::now();
        socket.send(Message::text(request.to_string()))?;
        receive(&mut socket, serial, &mut got)?;
        got.waits.push(1e3 * asked.elapsed().as_secs_f32());
    }
    got.waits.sort_by(f32::total_cmp);
    Ok(got)
}

/// A request for a picture.
fn frame(hello: &Value) -> Value {
    json!({
        "kind": "frame", "pane": 0, "serial": 0, "size": [400, 400], "time": 0.0, "camera": {"dataset": 0},
        "model": hello["models"][0], "edits": [], "quality": "moving", "style": "color",
    })
}

/// Something else than a picture, of the same view.
fn other(
    socket: &mut WebSocket<MaybeTlsStream<TcpStream>>,
    request: &Value,
    mut ask: Value,
) -> Result<(), Fault> {
    ask["view"] = request.clone();
    ask["view"].as_object_mut().ok_or("a request")?.remove("kind");
    Ok(socket.send(Message::text(ask.to_string()))?)
}

/// Waits for a picture of a request.
fn receive(
    socket: &mut WebSocket<MaybeTlsStream<TcpStream>>,
    serial: u64,
    got: &mut Got,
) -> Result<(), Fault> {
    loop {
        let Message::Binary(bytes) = socket.read()? else { continue };
        let length = u32::from_le_bytes(bytes[..4].try_into()?) as usize;
        let header: Value = serde_json::from_slice(&bytes[4..4 + length])?;
        got.pictures += 1;
        got.bytes += bytes.len();
        got.kept = [&header["kept"][0], &header["kept"][1]].map(|bytes| bytes.as_u64().unwrap_or(0));
        if header["serial"] == serial {
            return Ok(());
        }
    }
}

/// A camera on a circle around the scene's start camera's target, upright.
fn orbit(hello: &Value, angle: f64) -> Value {
    let three = |value: &Value| {
        glam::Vec3::from_array(std::array::from_fn(|i| value[i].as_f64().unwrap_or(0.0) as f32))
    };
    let start = &hello["start"];
    let (position, target, up) = (three(&start["position"]), three(&start["target"]), three(&start["up"]));
    let turn = glam::Quat::from_axis_angle(up.normalize_or(glam::Vec3::Z), angle as f32);
    let eye = target + turn * (position - target);
    let forward = (target - eye).normalize_or(glam::Vec3::X);
    let right = forward.cross(up).normalize_or(glam::Vec3::Y);
    let axes = glam::Mat3::from_cols(right, forward.cross(right), forward);
    let rotation = glam::Quat::from_mat3(&axes);
    json!({
        "position": eye.to_array(), "rotation": [rotation.w, rotation.x, rotation.y, rotation.z],
        "fov_y": start["fov_y"],
    })
}
