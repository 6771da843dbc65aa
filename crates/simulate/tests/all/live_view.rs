//! `--live`, `--port` and `--replay`: the program serves a simulation, saves what was done, and does it again.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use export::read_trajectory;
use serde_json::json;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use crate::common::{interrupt, refused, runs, simulate};

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(60);

fn connect(port: &str) -> TcpStream {
    let stream = TcpStream::connect(format!("127.0.0.1:{port}")).expect("a connection");
    stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
    stream
}

/// First line of what is answered to a request for the page.
fn page(port: &str, token: &str) -> String {
    let mut stream = connect(port);
    write!(stream, "GET /{token}/ HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n").expect("sent");
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).lines().next().unwrap_or_default().to_owned()
}

/// A viewer.
fn socket(port: &str, token: &str) -> WebSocket<TcpStream> {
    let mut request = format!("ws://127.0.0.1:{port}/{token}/socket").into_client_request().expect("an address");
    let origin = format!("http://127.0.0.1:{port}").parse().expect("a value");
    request.headers_mut().insert("Origin", origin);
    tungstenite::client(request, connect(port)).expect("it is let in").0
}

/// Waits for a frame at `time` [s] or later.
fn wait_until(viewer: &mut WebSocket<TcpStream>, time: f64) {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        let message = match viewer.read() {
            // A signal to this process is no message.
            Err(tungstenite::Error::Io(error)) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            message => message.expect("a message"),
        };
        if let Message::Binary(frame) = message
            && f64::from_le_bytes(frame[16..24].try_into().expect("eight bytes")) >= time
        {
            return;
        }
    }
    panic!("it does not get to {time} s");
}

#[test]
fn what_is_done_to_a_running_simulation_is_saved_and_done_again() {
    let place = tempfile::tempdir().expect("a folder");
    let [own, again] = ["own", "again"].map(|name| place.path().join(name));
    let [own, again] = [&own, &again].map(|path| path.to_str().expect("UTF-8"));
    let free = TcpListener::bind("127.0.0.1:0").and_then(|own| own.local_addr()).expect("a port").port().to_string();
    let mut child = simulate(&["helix", "--live", "--port", &free, "--out", own])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    let address = lines.next().expect("an address").expect("a line");
    let rest = address.strip_prefix("http://127.0.0.1:").expect("an address of this machine");
    let (port, token) = rest.trim_end_matches('/').split_once('/').expect("a port and a token");
    assert_eq!(port, free);
    assert_eq!(page(port, token), "HTTP/1.1 200 OK");
    assert!(page(port, &"0".repeat(token.len())).starts_with("HTTP/1.1 403"));
    assert!(refused(&["helix", "--live", "--port", port]).contains("--port"), "it is taken");

    let mut viewer = socket(port, token);
    for command in [
        json!({"do": {"grab": {"hand": 0, "segment": 59, "at": [0.5, 0, -0.25]}}}),
        json!({"do": {"move": {"hand": 0, "to": [0.5, 0.4, -0.5]}}}),
    ] {
        viewer.send(Message::text(command.to_string())).expect("sent");
    }
    wait_until(&mut viewer, 0.5);
    for command in ["pause", "save"] {
        viewer.send(Message::text(json!(command).to_string())).expect("sent");
    }
    let input = Path::new(own).join("live-input.json");
    let begin = Instant::now();
    while !input.is_file() {
        assert!(begin.elapsed() < PATIENCE, "nothing is saved");
        std::thread::sleep(Duration::from_millis(20));
    }
    interrupt(child.id());
    assert_eq!(child.wait().expect("an end").code(), Some(0), "a live view ends with Ctrl-C");

    let recording = input.to_str().expect("UTF-8");
    runs(&["helix", "--replay", recording, "--trajectory", "--out", again]);
    let [first, second] =
        [own, again].map(|of| read_trajectory(&Path::new(of).join("trajectory.safetensors")).expect("one"));
    assert!(first.states.len() > 2);
    assert_eq!(first.states, second.states);
    assert_eq!(first.time, second.time);
}

#[test]
fn what_is_no_recording_is_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let file = place.path().join("live-input.json");
    std::fs::write(&file, "{}").expect("a file");
    let file = file.to_str().expect("UTF-8");
    let error = refused(&["helix", "--replay", file]);
    assert!(error.contains(file) && error.contains("no recording of a live view"), "{error}");
    assert!(refused(&["helix", "--port", "7000"]).contains("--live"), "a port is for a live view");
}
