//! The server: a page and a WebSocket on one port of this machine, a thread or two a connection.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

use crate::LiveError;
use crate::command::{Command, LONGEST};
use crate::head::{Head, same};
use crate::hub::{Hub, Id, News, Seen};

/// Connections at a time.
const CONNECTIONS: usize = 32;
/// A viewer that takes nothing for so long is let go.
const PATIENCE: Duration = Duration::from_secs(10);
/// Bytes of the address that nobody can guess.
const TOKEN: usize = 16;

/// What every answer says: nothing is kept, nothing is told, nothing else is loaded.
const POLICY: &str = "Cache-Control: no-store\r\nReferrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\n\
                      Cross-Origin-Opener-Policy: same-origin\r\nX-Frame-Options: DENY\r\nConnection: close\r\n";

/// What connections need.
struct Site {
    hub: Arc<Hub>,
    page: Vec<u8>,
    token: String,
    port: u16,
    connections: AtomicUsize,
}

/// A server that listens until it is dropped.
pub(crate) struct Server {
    site: Arc<Site>,
    accepts: Option<JoinHandle<()>>,
}

impl Server {
    /// Listens on a port of this machine, or on any free one if it is 0. `page` makes the page, of the port.
    ///
    /// # Errors
    /// If the port is taken, or the system gives no random numbers.
    pub(crate) fn open(
        port: u16,
        hub: Arc<Hub>,
        page: impl FnOnce(u16) -> io::Result<String>,
    ) -> Result<Self, LiveError> {
        let refused = |source| LiveError::Port { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(refused)?;
        let port = listener.local_addr().map_err(refused)?.port();
        let mut random = [0; TOKEN];
        getrandom::fill(&mut random).map_err(LiveError::Random)?;
        let token = random.iter().map(|byte| format!("{byte:02x}")).collect();
        let page = page(port).map_err(LiveError::Page)?.into_bytes();
        let site = Arc::new(Site { hub, page, token, port, connections: AtomicUsize::new(0) });
        let own = site.clone();
        let accepts = thread::Builder::new().name("live server".to_owned()).spawn(move || accept(&listener, &own));
        Ok(Self { site, accepts: Some(accepts.map_err(refused)?) })
    }

    /// What to open in a browser.
    pub(crate) fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.site.port, self.site.token)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.site.hub.end();
        // Wakes the thread that listens.
        let _ = TcpStream::connect(SocketAddr::from((Ipv4Addr::LOCALHOST, self.site.port)));
        if let Some(accepts) = self.accepts.take() {
            let _ = accepts.join();
        }
    }
}

fn accept(listener: &TcpListener, site: &Arc<Site>) {
    for stream in listener.incoming() {
        if site.hub.is_over() {
            return;
        }
        let Ok(stream) = stream else {
            // Out of file descriptors, for instance: it may pass.
            thread::sleep(Duration::from_millis(50));
            continue;
        };
        if site.connections.fetch_add(1, Ordering::Relaxed) >= CONNECTIONS {
            site.connections.fetch_sub(1, Ordering::Relaxed);
            continue;
        }
        let own = site.clone();
        let serve = move || {
            // Whatever goes wrong with a connection is its own.
            let _ = connection(stream, &own);
            own.connections.fetch_sub(1, Ordering::Relaxed);
        };
        if thread::Builder::new().name("live connection".to_owned()).spawn(serve).is_err() {
            site.connections.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

fn answer(stream: &mut TcpStream, status: &str, fields: &str, body: &[u8]) -> io::Result<()> {
    let head = format!("HTTP/1.1 {status}\r\n{POLICY}{fields}Content-Length: {}\r\n\r\n", body.len());
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.flush()?;
    stream.shutdown(Shutdown::Write)
}

fn connection(mut stream: TcpStream, site: &Site) -> io::Result<()> {
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let head = match Head::read(&mut stream) {
        Ok(head) => head,
        Err(error) if error.kind() == io::ErrorKind::InvalidData => {
            return answer(&mut stream, "400 Bad Request", "", b"");
        }
        Err(error) => return Err(error),
    };
    if !head.is_local(site.port) {
        return answer(&mut stream, "403 Forbidden", "", b"");
    }
    if head.method != "GET" {
        return answer(&mut stream, "405 Method Not Allowed", "Allow: GET\r\n", b"");
    }
    let path = head.path.strip_prefix('/').unwrap_or_default();
    if path == "favicon.ico" {
        return answer(&mut stream, "204 No Content", "", b"");
    }
    match path.split_once('/') {
        Some((token, "")) if same(token, &site.token) => {
            let kind = "Content-Type: text/html; charset=utf-8\r\n";
            answer(&mut stream, "200 OK", kind, &site.page)
        }
        Some((token, "socket")) if same(token, &site.token) => match head.field("sec-websocket-key") {
            Some(key) if head.is_socket() => socket(stream, key, site),
            _ => answer(&mut stream, "400 Bad Request", "", b""),
        },
        _ => answer(&mut stream, "403 Forbidden", "", b""),
    }
}

/// A viewer, from its coming to its going.
fn socket(mut stream: TcpStream, key: &str, site: &Site) -> io::Result<()> {
    let accept = derive_accept_key(key.as_bytes());
    write!(
        stream,
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
    )?;
    stream.set_read_timeout(None)?;
    let config = WebSocketConfig::default().max_message_size(Some(LONGEST)).max_frame_size(Some(LONGEST));
    let sends = stream.try_clone()?;
    let id = site.hub.enter();
    let hub = site.hub.clone();
    let sender = thread::Builder::new().name("live frames".to_owned()).spawn(move || {
        send(sends, &hub, id);
        hub.leave(id);
    });
    if let Ok(sender) = sender {
        receive(WebSocket::from_raw_socket(Reads(&mut stream), Role::Server, Some(config)), &site.hub, id);
        site.hub.leave(id);
        // It says goodbye.
        let _ = sender.join();
    }
    site.hub.leave(id);
    stream.shutdown(Shutdown::Both)
}

/// Sends a viewer the newest of all that it has not seen, until it takes no more.
fn send(stream: TcpStream, hub: &Hub, id: Id) {
    let mut seen = Seen::default();
    let end = stream.try_clone();
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, None);
    loop {
        let message = match hub.news(id, &mut seen) {
            News::Text(text) => Message::text(text),
            News::Pong(ping) => Message::Pong(ping.into()),
            News::Frame(frame) => Message::binary(frame.as_slice().to_vec()),
            News::End => {
                let _ = socket.close(None);
                let _ = socket.flush();
                break;
            }
        };
        if socket.send(message).is_err() {
            break;
        }
    }
    if let Ok(end) = end {
        let _ = end.shutdown(Shutdown::Both);
    }
}

/// A stream that is read alone: another thread writes to it, whole messages at a time.
struct Reads<'a>(&'a mut TcpStream);

impl Read for Reads<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.read(buffer)
    }
}

impl Write for Reads<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Reads what a viewer asks for, until it closes or sends what is no message.
fn receive(mut socket: WebSocket<Reads<'_>>, hub: &Hub, id: Id) {
    while let Ok(message) = socket.read() {
        let asked = match message {
            Message::Text(text) => Command::read(&text).and_then(|command| hub.ask(id, command).map_err(str::to_owned)),
            Message::Binary(_) => Err("commands are text".to_owned()),
            Message::Close(_) => return,
            Message::Ping(ping) => {
                hub.pong(id, ping.to_vec());
                Ok(())
            }
            _ => Ok(()),
        };
        if let Err(why) = asked {
            hub.tell(id, serde_json::json!({ "refused": why }).to_string());
        }
    }
}
