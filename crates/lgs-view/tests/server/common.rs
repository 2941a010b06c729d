//! A server of a falling block, and a page that talks to it.

use std::net::{IpAddr, Ipv4Addr, TcpStream};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use lgs_core::{Camera, GaussianCloud, Image};
use lgs_eval::laws::ObjectLaw;
use lgs_mechanics::Law;
use lgs_mechanics::bands::{Known, Verdict};
use lgs_mechanics::coordinates::{Bodies, Coordinates, Port, State};
use lgs_mechanics::terms::{Term, kind};
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, MotionConfig, ObjectModel};
use lgs_view::{Exhibit, Options, Server, Stopper, Subject, TruthImage};
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::stream::MaybeTlsStream;
use tokio_tungstenite::tungstenite::{Message, WebSocket, connect};

/// A block that falls with an acceleration of 2, over static Gaussians.
pub(crate) fn falling() -> LagrangianScene {
    let means: Vec<[f32; 3]> =
        (0..27).map(|i| [i % 3, i / 3 % 3, i / 9].map(|c| 0.1 * (c as f32 - 1.0))).collect();
    let field = Term { kind: kind("uniform-field").expect("a kind"), port: Port::Whole };
    let law = Law::new(Coordinates::Point, vec![field], vec![0.0, 0.0, -2.0], 0.01).expect("a law");
    let start = State { x: vec![0.0; 3], v: vec![0.0; 3] };
    let dynamics = Dynamics::Generalised(GeneralisedDynamics {
        law,
        bodies: Bodies::default(),
        start,
        known: Known::default(),
    });
    LagrangianScene {
        velocities: vec![[0.0; 3]; means.len()],
        dynamic_gaussians: GaussianCloud::isotropic(means, 0.05, [0.9, 0.3, 0.1], 0.9),
        objects: vec![ObjectModel { members: 0..27, recording: None, dynamics }],
        ..LagrangianScene::still(
            GaussianCloud::isotropic(vec![[0.0, 0.0, -1.2]; 3], 0.1, [0.2, 0.5, 0.2], 0.9),
            MotionConfig { dt: 0.01, time_window: 0.75 },
            [1.0; 3],
        )
    }
}

pub(crate) fn camera() -> Camera {
    Camera::look_at([0.0, -4.0, 0.5], [0.0; 3], 0.8, 64, 48)
}

pub(crate) fn subject() -> Subject {
    let law = ObjectLaw {
        coordinates: "point".to_owned(),
        verdict: Verdict::Described,
        trusted: Some([-0.5, 1.0]),
        ..ObjectLaw::default()
    };
    let grey = || Ok(Image::filled(64, 48, [0.5; 3]));
    Subject {
        title: "falling".to_owned(),
        run: "runs/falling".to_owned(),
        has_scene: true,
        scene: falling(),
        source: None,
        laws: vec![Some(law)],
        cameras: vec![("train/r_000".to_owned(), camera())],
        truth: vec![TruthImage { camera: 0, time: 0.5, load: Box::new(grey) }],
        start: (camera(), [0.0; 3]),
        missing: Vec::new(),
    }
}

/// A server on a free port, until it is dropped.
pub(crate) struct Running {
    pub(crate) address: String,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    pub(crate) fn start(most_pages: usize, token: Option<&str>) -> Self {
        Self::of(Exhibit::of(subject()), most_pages, token)
    }

    pub(crate) fn of(exhibit: impl Into<Arc<Exhibit>>, most_pages: usize, token: Option<&str>) -> Self {
        let exhibit = exhibit.into();
        let options = Options {
            host: IpAddr::V4(Ipv4Addr::LOCALHOST),
            port: 0,
            token: token.map(str::to_owned),
            cache_bytes: 1 << 20,
            most_pages,
        };
        let server = Server::bind(options).expect("a free port");
        let (url, stopper) = (server.url(), server.stopper());
        let address = url.trim_start_matches("http://").split('/').next().expect("an address").to_owned();
        let thread = std::thread::spawn(move || server.run(&exhibit).expect("the server runs"));
        Self { address, stopper, thread: Some(thread) }
    }

    pub(crate) fn page(&self) -> Page {
        Page::open(&self.address).expect("a page")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stopper.stop();
        let ended = self.thread.take().map(JoinHandle::join);
        assert!(ended.is_none_or(|ended| ended.is_ok()), "the server ended with a panic");
    }
}

/// The socket of a page.
pub(crate) struct Page {
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    pub(crate) hello: Value,
}

/// A picture with its header.
pub(crate) struct Frame {
    pub(crate) header: Value,
    pub(crate) picture: Vec<u8>,
}

impl Page {
    fn open(address: &str) -> Result<Self, tokio_tungstenite::tungstenite::Error> {
        let request = format!("ws://{address}/socket").into_client_request()?;
        let (socket, _) = connect(request)?;
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout");
        }
        let mut page = Self { socket, hello: Value::Null };
        if let Message::Text(text) = page.socket.read()? {
            page.hello = serde_json::from_str(&text).expect("JSON");
        }
        Ok(page)
    }

    pub(crate) fn send(&mut self, text: &str) {
        self.socket.send(Message::text(text)).expect("sent");
    }

    pub(crate) fn message(&mut self) -> Message {
        self.socket.read().expect("a message in time")
    }

    /// The next picture.
    pub(crate) fn frame(&mut self) -> Frame {
        loop {
            if let Message::Binary(bytes) = self.message() {
                let length = u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")) as usize;
                let header = serde_json::from_slice(&bytes[4..4 + length]).expect("a header");
                return Frame { header, picture: bytes[4 + length..].to_vec() };
            }
        }
    }

    /// The finished picture of a request, and its pixels.
    pub(crate) fn picture(&mut self, request: &Value) -> (Value, Vec<u8>) {
        self.send(&request.to_string());
        loop {
            let Frame { header, picture } = self.frame();
            if header["serial"] == request["serial"] && header["rolling"] == false {
                let image = image::load_from_memory(&picture).expect("a picture").to_rgb8();
                return (header, image.into_raw());
            }
        }
    }

    /// The next answer in JSON.
    pub(crate) fn answer(&mut self) -> Value {
        loop {
            if let Message::Text(text) = self.message() {
                return serde_json::from_str(&text).expect("JSON");
            }
        }
    }
}

/// A request of the dataset's camera at a time, of exact quality.
pub(crate) fn request(serial: u64, time: f64) -> Value {
    json!({
        "kind": "frame", "pane": 0, "serial": serial, "camera": {"dataset": 0}, "size": [64, 48],
        "time": time, "model": "lagrangian", "quality": "exact",
    })
}

impl Page {
    /// Whether the server has ended the connection.
    pub(crate) fn is_closed(&mut self) -> bool {
        matches!(self.socket.read(), Ok(Message::Close(_)) | Err(_))
    }
}
