//! The server: who is let in, what is refused, and what the simulation survives.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use live::{Live, LiveError, Options, Recording};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::handshake::client::generate_key;
use tungstenite::{Message, WebSocket};

use crate::ropes::{rebuild, rope, simulation};

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(60);

/// A live view in a thread of its own.
struct Shown {
    address: String,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<Recording>>,
}

impl Shown {
    fn new(options: Options) -> Self {
        let ends = Arc::new(AtomicBool::new(false));
        let (told, address) = channel();
        let own = ends.clone();
        let thread = thread::spawn(move || {
            let (model, state) = rope(0.5);
            let mut sim = simulation(&model, &state);
            let mut live = Live::open(&model, &mut sim, 0.01, Some(rebuild(&state)), options).expect("a view");
            told.send(live.address()).expect("told");
            while !own.load(Ordering::Relaxed) && live.turn(&mut sim).expect("a turn") {}
            live.recording()
        });
        let address = address.recv_timeout(PATIENCE).expect("an address");
        Self { address, ends, thread: Some(thread) }
    }

    fn port(&self) -> u16 {
        self.address.split([':', '/']).nth(4).expect("a port").parse().expect("a number")
    }

    fn token(&self) -> &str {
        self.address.split('/').nth(3).expect("a token")
    }

    /// Sends bytes, and reads all that is answered.
    fn ask(&self, request: &str) -> String {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port())).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        // A server that has refused already may take no more.
        let _ = stream.write_all(request.as_bytes());
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn get(&self, path: &str, fields: &str) -> String {
        self.ask(&format!("GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n{fields}\r\n", self.port()))
    }

    fn socket_request(&self, path: &str, origin: &str) -> String {
        let (port, key) = (self.port(), generate_key());
        format!(
            "GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{origin}Connection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n"
        )
    }

    fn viewer(&self) -> Viewer {
        let stream = TcpStream::connect(("127.0.0.1", self.port())).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        let (port, token) = (self.port(), self.token());
        let mut request = format!("ws://127.0.0.1:{port}/{token}/socket").into_client_request().expect("an address");
        let origin = format!("http://127.0.0.1:{port}").parse().expect("a value");
        request.headers_mut().insert("Origin", origin);
        Viewer(tungstenite::client(request, stream).expect("it is let in").0)
    }

    fn end(mut self) -> Recording {
        self.ends.store(true, Ordering::Relaxed);
        self.thread.take().expect("a thread").join().expect("no panic")
    }
}

struct Viewer(WebSocket<TcpStream>);

/// Times of a frame: of the simulation, first and last that one can go to [s].
fn times(frame: &[u8]) -> [f64; 3] {
    [0, 4, 5].map(|k| f64::from_le_bytes(frame[16 + 8 * k..24 + 8 * k].try_into().expect("eight bytes")))
}

impl Viewer {
    fn send(&mut self, command: &Value) {
        self.0.send(Message::text(command.to_string())).expect("sent");
    }

    /// The next message that `wanted` makes something of.
    fn wait<T>(&mut self, mut wanted: impl FnMut(&Message) -> Option<T>) -> T {
        let begin = Instant::now();
        while begin.elapsed() < PATIENCE {
            if let Some(found) = wanted(&self.0.read().expect("a message")) {
                return found;
            }
        }
        panic!("it did not come");
    }

    fn told(&mut self, key: &str) -> Value {
        self.wait(|message| {
            let Message::Text(text) = message else { return None };
            let value: Value = serde_json::from_str(text).expect("JSON");
            value.get(key).cloned()
        })
    }

    fn status_with(&mut self, holds: impl Fn(&Value) -> bool) -> Value {
        loop {
            let status = self.told("status");
            if holds(&status) {
                return status;
            }
        }
    }

    /// Times of all frames until none comes for a while [s].
    fn quiet_times(&mut self) -> Vec<f64> {
        self.0.get_ref().set_read_timeout(Some(Duration::from_secs(2))).expect("a timeout");
        let mut all = Vec::new();
        while let Ok(message) = self.0.read() {
            if let Message::Binary(bytes) = message {
                all.push(times(&bytes)[0]);
            }
        }
        self.0.get_ref().set_read_timeout(Some(PATIENCE)).expect("a timeout");
        all
    }

    fn frame(&mut self) -> Vec<u8> {
        self.wait(|message| match message {
            Message::Binary(bytes) => Some(bytes.to_vec()),
            _ => None,
        })
    }
}

#[test]
fn the_page_is_for_those_who_know_the_address_alone() {
    let shown = Shown::new(Options::new("rope <1>"));
    let page = shown.get(&format!("/{}/", shown.token()), "");
    assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{page:.100}");
    for part in [
        "\r\nCache-Control: no-store\r\n",
        "\r\nX-Content-Type-Options: nosniff\r\n",
        "\r\nReferrer-Policy: no-referrer\r\n",
        "default-src 'none'",
        &format!("connect-src ws://127.0.0.1:{}", shown.port()),
        "<title>rope &lt;1&gt;</title>",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Nothing is loaded from anywhere.
    assert!(!page.contains("src=") && !page.contains("https://") && !page.contains("@import"));
    assert_eq!(shown.token().len(), 32);
    let wrong = "0".repeat(32);
    for (path, fields) in [
        ("/".to_owned(), String::new()),
        (format!("/{wrong}/"), String::new()),
        (format!("/{}", shown.token()), String::new()),
        (format!("/{}/../", shown.token()), String::new()),
        (format!("/{}/", shown.token()), "Origin: http://evil.example\r\n".to_owned()),
        (format!("/{wrong}/socket"), String::new()),
    ] {
        let answer = shown.get(&path, &fields);
        assert!(answer.starts_with("HTTP/1.1 403 "), "{path} {fields}: {answer:.60}");
        assert!(answer.ends_with("\r\n\r\n"), "{path}: something is told");
    }
    let elsewhere = shown.ask(&format!("GET /{}/ HTTP/1.1\r\nHost: evil.example\r\n\r\n", shown.token()));
    assert!(elsewhere.starts_with("HTTP/1.1 403 "), "{elsewhere:.60}");
    let post = format!("POST /{}/ HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", shown.token(), shown.port());
    assert!(shown.ask(&post).starts_with("HTTP/1.1 405 "));
    // No HTTP, and too much of it.
    assert!(shown.ask("\x16\x03\x01 hello\r\n\r\n").starts_with("HTTP/1.1 400 "));
    assert!(!shown.ask(&format!("GET / HTTP/1.1\r\nX: {}", "x".repeat(20_000))).starts_with("HTTP/1.1 200 "));
    // A socket without an origin, or from elsewhere.
    let path = format!("/{}/socket", shown.token());
    assert!(shown.ask(&shown.socket_request(&path, "")).starts_with("HTTP/1.1 400 "));
    assert!(shown.ask(&shown.socket_request(&path, "Origin: http://evil.example\r\n")).starts_with("HTTP/1.1 403 "));
    let plain = shown.get(&path, &format!("Origin: http://127.0.0.1:{}\r\n", shown.port()));
    assert!(plain.starts_with("HTTP/1.1 400 "), "{plain:.60}");
    shown.end();
}

#[test]
fn a_port_that_is_taken_is_an_error() {
    let shown = Shown::new(Options::new("rope"));
    let (model, state) = rope(0.5);
    let mut sim = simulation(&model, &state);
    let options = Options { port: shown.port(), ..Options::new("rope") };
    let error = Live::open(&model, &mut sim, 0.01, None, options).err().expect("no view");
    assert!(matches!(error, LiveError::Port { port, .. } if port == shown.port()), "{error}");
    assert!(error.to_string().contains(&shown.port().to_string()), "{error}");
    shown.end();
}

#[test]
fn time_stands_goes_in_steps_and_back() {
    let shown = Shown::new(Options::new("rope"));
    let mut viewer = shown.viewer();
    assert_eq!(viewer.told("you"), 0);
    let frame = viewer.frame();
    // Four counts, seven numbers, eleven floats a segment.
    assert_eq!(frame.len(), 16 + 7 * 8 + 4 * 11 * 40);
    let now = |viewer: &mut Viewer| times(&viewer.frame())[0];
    let first = now(&mut viewer);
    while now(&mut viewer) < first + 0.6 {}
    viewer.send(&json!("pause"));
    viewer.status_with(|status| status["plays"] == false);
    let before = viewer.quiet_times();
    let mut steps = Vec::new();
    for _ in 0..2 {
        viewer.send(&json!("step"));
        steps.extend(viewer.quiet_times());
    }
    // What was asked for may be shown before it is done.
    steps.dedup();
    steps.retain(|time| Some(time) != before.last());
    let paused = before.last().expect("a frame after the pause");
    assert_eq!(steps.len(), 2);
    for (k, time) in steps.iter().enumerate() {
        assert!((time - paused - 0.01 * (k + 1) as f64).abs() < 1e-9, "{steps:?} after {paused}");
    }
    viewer.send(&json!({"back": 0.3}));
    while now(&mut viewer) != 0.25 {}
    viewer.send(&json!({"pace": 4.0}));
    assert_eq!(viewer.status_with(|status| status["pace"] == 4.0)["plays"], false);
    viewer.send(&json!("play"));
    while now(&mut viewer) < 1.0 {}
    viewer.send(&json!("pause"));
    viewer.send(&json!("reset"));
    while now(&mut viewer) != 0.0 {}
    let recording = shown.end();
    assert_eq!(recording.steps, 0);
}

#[test]
fn what_is_wrong_is_refused_and_a_second_page_watches() {
    let shown = Shown::new(Options::new("rope"));
    let mut viewer = shown.viewer();
    viewer.frame();
    for wrong in ["", "{", "\"fly\"", r#"{"do":{"grab":{"hand":0}}}"#, r#"{"pace":-1}"#, "[[[[[[[[[[[[[[[[[[[["] {
        viewer.0.send(Message::text(wrong)).expect("sent");
        assert!(viewer.told("refused").as_str().is_some_and(|why| why.contains("command") || why.contains("pace")));
    }
    viewer.0.send(Message::binary(vec![0; 64])).expect("sent");
    assert_eq!(viewer.told("refused"), "commands are text");
    for wrong in [
        json!({"do": {"grab": {"hand": 0, "segment": 40, "at": [0, 0, 0]}}}),
        json!({"do": {"grab": {"hand": 10, "segment": 4, "at": [0, 0, 0]}}}),
        json!({"do": {"move": {"hand": 4, "to": [0, 0, 0]}}}),
        json!({"do": {"unpin": {"segment": 4}}}),
        json!({"do": {"set": {"stiffness": 0}}}),
        json!("save"),
    ] {
        viewer.send(&wrong);
        assert!(viewer.told("refused").is_string(), "{wrong}");
    }
    let mut second = shown.viewer();
    assert_eq!(second.told("you"), 1);
    second.send(&json!("pause"));
    assert!(second.told("refused").as_str().is_some_and(|why| why.contains("another page leads")));
    second.frame();
    // A message that is too long ends a connection, and with it the lead.
    let _ = viewer.0.send(Message::text("x".repeat(100_000)));
    second.status_with(|status| status["leader"] == 1 && status["viewers"] == 1);
    second.send(&json!("pause"));
    second.status_with(|status| status["plays"] == false);
    shown.end();
}

#[test]
fn a_page_that_goes_in_the_middle_of_a_drag_is_survived() {
    let shown = Shown::new(Options { alone: Duration::from_millis(300), ..Options::new("rope") });
    let mut viewer = shown.viewer();
    viewer.frame();
    viewer.send(&json!({"do": {"grab": {"hand": 0, "segment": 4, "at": [0.1, 0, 0]}}}));
    viewer.send(&json!({"do": {"move": {"hand": 0, "to": [0.1, 0, 1]}}}));
    viewer.frame();
    // Without a word: the connection is cut, half a message sent.
    let Viewer(socket) = viewer;
    let mut stream = socket.into_inner();
    stream.write_all(&[0x81, 0xfe, 0x01]).expect("sent");
    drop(stream);
    // The view ends by itself some time after its last page.
    let recording = shown.thread_ends();
    let held = recording.inputs.iter().filter(|(_, input)| matches!(input, live::Input::Grab { .. })).count();
    let dropped = recording.inputs.iter().filter(|(_, input)| matches!(input, live::Input::Drop { .. })).count();
    assert_eq!((held, dropped), (1, 1), "what it held is let go");
}

impl Shown {
    /// Waits until the view ends by itself.
    fn thread_ends(mut self) -> Recording {
        self.thread.take().expect("a thread").join().expect("no panic")
    }
}
