//! A viewer of a small model in a process of its own, and a page that only speaks the protocol.

use labelgs::files::{LabelEntry, LabelTable};
use labelgs::formats::write_model;
use labelgs::scene::Gaussians;
use labelgs::scenes::LoadOptions;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Longest wait for anything.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A name that would run a script if it were markup.
pub const HOSTILE: &str = "<img src=x onerror=window.hacked=1>";

/// A scene of six small photos and a model of its points with four labels.
pub struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    pub fn new() -> Self {
        let place = Self { folder: tempfile::tempdir().expect("a folder") };
        let made = ["synth", "scene", "--preset", "simple", "--size", "64x48", "--views", "6", "--points", "400"];
        place.succeeds(&made);
        write_model(place.path("model.ply"), &model(&place.path("scene"))).expect("a model");
        let entry = |id, name: &str| LabelEntry { name: Some(name.into()), ..LabelEntry::new(id) };
        let table = LabelTable::new(vec![entry(1, "cup"), entry(2, HOSTILE), entry(3, "box of tea")]);
        table.write(&place.path("model.labels.json")).expect("a table");
        place
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A command of the program in the folder.
    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_labelgs"));
        command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", self.path("cache")).env_remove("RUST_LOG");
        command.current_dir(self.folder.path()).args(args);
        command
    }

    pub fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("it runs")
    }

    #[track_caller]
    pub fn succeeds(&self, args: &[&str]) -> Output {
        let output = self.run(args);
        assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
        output
    }

    /// Starts a viewer of the model with the scene.
    pub fn view(&self, flags: &[&str]) -> Server {
        let typed = ["view", "model.ply", "--scene", "scene", "--masks", "scene/masks"];
        Server::start(self.command(&[&typed[..], flags].concat()))
    }

    /// Pixels of a picture that the program wrote, as RGB or 16-bit grey in native order.
    pub fn picture(&self, name: &str) -> Picture {
        let path = self.path(name);
        decode(&std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    }
}

/// A model of the points of a scene, with labels from 0 to 4 by their place.
pub fn model(scene: &Path) -> Gaussians {
    let points = labelgs::scenes::open(scene, &LoadOptions::default()).expect("a scene").points;
    let count = points.len();
    let label = |row: usize| {
        let at = points[row].position;
        if row.is_multiple_of(5) { 0 } else { 1 + u32::from(at.x > 0.0) + 2 * u32::from(at.y > 0.0) }
    };
    Gaussians {
        means: points.iter().map(|point| point.position.as_vec3().to_array()).collect(),
        quats: vec![[1.0, 0.1, 0.0, 0.0]; count],
        scales: (0..count).map(|row| [-2.0 - 0.3 * (row % 3) as f32; 3]).collect(),
        opacities: vec![2.5; count],
        sh0: points.iter().map(|point| point.colour.map(|byte| (f32::from(byte) / 255.0 - 0.5) / 0.282_095)).collect(),
        sh_rest: (0..3 * count).map(|at| [0.02 * (at % 5) as f32; 3]).collect(),
        sh_degree: 1,
        labels: Some((0..count).map(label).collect()),
        label_confidence: Some((0..count).map(|row| 0.4 + 0.6 * (row % 10) as f32 / 9.0).collect()),
        ..Gaussians::default()
    }
}

/// Size and values of a picture, in the order of the rows.
#[derive(Debug, PartialEq)]
pub struct Picture {
    pub size: (u32, u32),
    pub values: Vec<u16>,
}

pub fn decode(bytes: &[u8]) -> Picture {
    let image = image::load_from_memory(bytes).expect("a picture");
    let values = match &image {
        image::DynamicImage::ImageLuma16(grey) => grey.as_raw().clone(),
        other => other.to_rgb8().into_raw().into_iter().map(u16::from).collect(),
    };
    Picture { size: (image.width(), image.height()), values }
}

/// A running server; it ends with this value.
pub struct Server {
    pub child: Child,
    pub address: String,
    /// What it says on standard error until it ends.
    said: Option<JoinHandle<String>>,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Server {
    /// Starts a viewer and reads its address.
    pub fn start(mut command: Command) -> Self {
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        let mut address = String::new();
        BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut address).expect("a line");
        let address = address.trim().to_owned();
        if address.is_empty() {
            let mut said = String::new();
            child.stderr.take().expect("a pipe").read_to_string(&mut said).expect("text");
            panic!("the viewer did not start: {said}");
        }
        let said = drain(&mut child);
        Self { child, address, said }
    }

    /// Does what Ctrl-C does.
    pub fn signal(&self) {
        let sent = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()));
    }

    /// Waits for its end. Returns its status and what it said on standard error.
    pub fn ended(mut self) -> (Option<i32>, String) {
        let status = self.child.wait().expect("it ends");
        let said = self.said.take().map(|said| said.join().expect("it is read")).unwrap_or_default();
        (status.code(), said)
    }

    /// Ends it as Ctrl-C does.
    pub fn interrupt(self) -> (Option<i32>, String) {
        self.signal();
        self.ended()
    }

    /// Starts a training with a viewer, whose address is on standard error.
    pub fn train(mut command: Command) -> Self {
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        let address = address_of(&mut child, "http://");
        Self { child, address, said: None }
    }

    /// Name and port, as in `Host`.
    pub fn host(&self) -> &str {
        self.address.trim_start_matches("http://").split('/').next().expect("a host")
    }

    pub fn port(&self) -> u16 {
        self.host().rsplit(':').next().and_then(|port| port.parse().ok()).expect("a port")
    }

    pub fn cookie(&self) -> String {
        let token = self.address.split("token=").nth(1).unwrap_or_default();
        format!("labelgs-{}={token}", self.port())
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port())).expect("a connection");
        stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a time");
        stream
    }

    /// Sends bytes and returns everything that is answered.
    pub fn raw(&self, bytes: &[u8]) -> String {
        let mut stream = self.connect();
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// Asks for a path with headers; `Host` is right unless it is among them.
    pub fn get(&self, path: &str, headers: &[(&str, &str)]) -> String {
        let mut head = format!("GET {path} HTTP/1.1\r\n");
        if !headers.iter().any(|(name, _)| *name == "Host") {
            head += &format!("Host: {}\r\n", self.host());
        }
        headers.iter().for_each(|(name, value)| head += &format!("{name}: {value}\r\n"));
        self.raw(format!("{head}\r\n").as_bytes())
    }

    /// Opens a page.
    pub fn page(&self) -> Page {
        self.try_page(&format!("http://{}", self.host()), &self.cookie()).expect("a page")
    }

    /// Opens a page of an origin with a cookie; none if the server refuses.
    pub fn try_page(&self, origin: &str, cookie: &str) -> Option<Page> {
        let request = tungstenite::http::Request::builder()
            .uri(format!("ws://{}/socket", self.host()))
            .header("Host", self.host())
            .header("Origin", origin)
            .header("Cookie", cookie)
            .header("Connection", "Upgrade")
            .header("Upgrade", "websocket")
            .header("Sec-WebSocket-Version", "13")
            .header("Sec-WebSocket-Key", tungstenite::handshake::client::generate_key())
            .body(())
            .expect("a request");
        let (socket, _) = tungstenite::client(request, self.connect()).ok()?;
        Some(Page { socket, seq: 0, texts: Vec::new() })
    }
}

/// Reads what a process says, so that it never waits.
fn drain(child: &mut Child) -> Option<JoinHandle<String>> {
    let mut pipe = child.stderr.take()?;
    Some(std::thread::spawn(move || {
        let mut said = Vec::new();
        let _ = pipe.read_to_end(&mut said);
        String::from_utf8_lossy(&said).into_owned()
    }))
}

/// A frame as a page gets it.
#[derive(Debug)]
pub struct Frame {
    pub seq: u32,
    pub size: (u32, u32),
    pub step: u32,
    pub exact: bool,
    pub pictures: Vec<Picture>,
}

/// A page without a browser.
pub struct Page {
    pub socket: WebSocket<TcpStream>,
    seq: u32,
    /// Messages that nobody waited for yet.
    texts: Vec<Value>,
}

impl Page {
    pub fn send(&mut self, value: &Value) {
        self.socket.send(Message::text(value.to_string())).expect("it is sent");
    }

    /// Asks for a frame.
    pub fn ask(&mut self, from: &Value, panes: &[&str], moving: bool) -> u32 {
        self.seq += 1;
        self.send(&json!({ "kind": "look", "seq": self.seq, "from": from, "panes": panes, "moving": moving }));
        self.seq
    }

    pub fn ack(&mut self, seq: u32) {
        self.send(&json!({ "kind": "ack", "seq": seq }));
    }

    /// The next frame, acknowledged by the caller. None if nothing comes in time, or the training is over.
    pub fn frame_within(&mut self, most: Duration) -> Option<Frame> {
        let end = Instant::now() + most;
        while Instant::now() < end {
            match self.next(end)? {
                Message::Binary(bytes) => return Some(parse(&bytes)),
                Message::Text(text) => {
                    let text: Value = serde_json::from_str(&text).expect("JSON");
                    let is_over = text["kind"] == "over";
                    self.texts.push(text);
                    if is_over {
                        return None;
                    }
                }
                _ => {}
            }
        }
        None
    }

    fn next(&mut self, end: Instant) -> Option<Message> {
        let left = end.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
        self.socket.get_ref().set_read_timeout(Some(left)).expect("a time");
        match self.socket.read() {
            Ok(message) => Some(message),
            Err(tungstenite::Error::Io(error))
                if matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) =>
            {
                None
            }
            Err(error) => panic!("the server closed the page: {error}"),
        }
    }

    /// The exact frame of a still camera.
    #[track_caller]
    pub fn still(&mut self, from: &Value, panes: &[&str]) -> Frame {
        let seq = self.ask(from, panes, false);
        loop {
            let frame = self.frame_within(PATIENCE).unwrap_or_else(|| panic!("no frame: {:?}", self.texts));
            self.ack(frame.seq);
            if frame.seq == seq {
                return frame;
            }
        }
    }

    /// Waits for a message of a kind that fits.
    #[track_caller]
    pub fn until(&mut self, kind: &str, fits: impl Fn(&Value) -> bool) -> Value {
        let end = Instant::now() + PATIENCE;
        loop {
            let found = self.texts.iter().position(|text| text["kind"] == kind && fits(text));
            if let Some(at) = found {
                return self.texts.remove(at);
            }
            let others: Vec<_> = self.texts.iter().map(|text| (&text["kind"], &text["text"])).collect();
            assert!(Instant::now() < end, "no {kind} came, but {others:?}");
            match self.next(end) {
                Some(Message::Text(text)) => self.texts.push(serde_json::from_str(&text).expect("JSON")),
                Some(Message::Binary(bytes)) => {
                    let seq = parse(&bytes).seq;
                    self.ack(seq);
                }
                _ => {}
            }
        }
    }

    /// The newest message of a kind among those that came until now, or the next one.
    #[track_caller]
    pub fn hear(&mut self, kind: &str) -> Value {
        self.until(kind, |_| true)
    }

    /// The newest message of a kind among those that came until now.
    pub fn newest(&mut self, kind: &str) -> Option<Value> {
        let at = self.texts.iter().rposition(|text| text["kind"] == kind)?;
        Some(self.texts.remove(at))
    }

    /// Forgets what came until now.
    pub fn forget(&mut self) {
        while let Some(message) = self.next(Instant::now() + Duration::from_millis(50)) {
            if let Message::Binary(bytes) = message {
                let seq = parse(&bytes).seq;
                self.ack(seq);
            }
        }
        self.texts.clear();
    }

    /// What is at a pixel.
    #[track_caller]
    pub fn pick(&mut self, from: &Value, pixel: [u32; 2]) -> Value {
        self.seq += 1;
        let seq = self.seq;
        self.send(&json!({ "kind": "pick", "seq": seq, "from": from, "pixel": pixel }));
        self.until("picked", |message| message["seq"] == seq)
    }

    pub fn edit(&mut self, what: &Value) {
        self.send(&json!({ "kind": "edit", "what": what }));
    }
}

fn parse(bytes: &[u8]) -> Frame {
    let word = |at: usize| u32::from_le_bytes(bytes[4 * at..4 * at + 4].try_into().expect("4 bytes"));
    assert_eq!(word(0), 1, "the kind of message");
    let (mut at, mut pictures) = (36, Vec::new());
    for _ in 0..word(6) >> 2 {
        let size = u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4 bytes")) as usize;
        pictures.push(decode(&bytes[at + 4..at + 4 + size]));
        at += 4 + size;
    }
    assert_eq!(at, bytes.len(), "nothing is left over");
    Frame { seq: word(1), step: word(2), size: (word(3), word(4)), exact: word(6) & 1 == 1, pictures }
}

/// The address that a program says on standard error. What it says later is dropped.
pub fn address_of(child: &mut Child, scheme: &str) -> String {
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut said = String::new();
    let address = loop {
        let before = said.len();
        assert!(lines.read_line(&mut said).expect("a line") > 0, "no address: {said}");
        if let Some(at) = said[before..].find(scheme) {
            break said[before + at..].trim().to_owned();
        }
    };
    std::thread::spawn(move || std::io::copy(&mut lines, &mut std::io::sink()));
    address
}
