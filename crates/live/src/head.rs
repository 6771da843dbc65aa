//! The head of an HTTP/1.1 request (RFC 9112), and who may ask.

use std::io::{self, Read};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Longest head [bytes].
const LONGEST: usize = 8192;
/// Most fields in it.
const FIELDS: usize = 64;
/// A head must be there within this time.
const PATIENCE: Duration = Duration::from_secs(5);

/// What is asked for.
#[derive(Debug)]
pub(crate) struct Head {
    pub(crate) method: String,
    pub(crate) path: String,
    fields: Vec<(String, String)>,
}

impl Head {
    /// Reads one, and nothing beyond it: a page sends nothing more before it has an answer.
    ///
    /// # Errors
    /// If it is none, too long, or does not come.
    pub(crate) fn read(stream: &mut TcpStream) -> io::Result<Self> {
        let until = Instant::now() + PATIENCE;
        let mut bytes = Vec::new();
        let mut part = [0; 1024];
        let wrong = |what: &str| io::Error::new(io::ErrorKind::InvalidData, what.to_owned());
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(io::ErrorKind::TimedOut.into());
            }
            stream.set_read_timeout(Some(left))?;
            let count = stream.read(&mut part)?;
            if count == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            bytes.extend_from_slice(&part[..count]);
            if let Some(head) = Self::parse(&bytes).map_err(|error| wrong(&error.to_string()))? {
                return Ok(head);
            }
            if bytes.len() > LONGEST {
                return Err(wrong("the head is too long"));
            }
        }
    }

    /// The head in these bytes; `None` where it goes on.
    fn parse(bytes: &[u8]) -> Result<Option<Self>, httparse::Error> {
        let mut fields = [httparse::EMPTY_HEADER; FIELDS];
        let mut request = httparse::Request::new(&mut fields);
        if request.parse(bytes)?.is_partial() {
            return Ok(None);
        }
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Ok(Some(Self {
            method: request.method.unwrap_or_default().to_owned(),
            path: request.path.unwrap_or_default().to_owned(),
            fields: request.headers.iter().map(|f| (f.name.to_ascii_lowercase(), text(f.value))).collect(),
        }))
    }

    /// The field of this name, in small letters; `None` where there is none or more than one.
    pub(crate) fn field(&self, name: &str) -> Option<&str> {
        let mut all = self.fields.iter().filter(|(own, _)| own == name);
        let first = all.next().map(|(_, value)| value.trim());
        first.filter(|_| all.next().is_none())
    }

    fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|(own, _)| own == name)
    }

    /// Whether it is for this machine by a name of its own, which no name server gives (against DNS rebinding), and from a page of
    /// this server, if from any.
    pub(crate) fn is_local(&self, port: u16) -> bool {
        let own = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{port}"));
        // Browsers leave out the usual port.
        let is_own =
            |host: &str| own.iter().any(|own| own == host || (port == 80 && own.strip_suffix(":80") == Some(host)));
        let comes_from_here = |origin: &str| origin.strip_prefix("http://").is_some_and(is_own);
        self.field("host").is_some_and(is_own)
            && (!self.has("origin") || self.field("origin").is_some_and(comes_from_here))
    }

    /// Whether it asks for a WebSocket, from a page of this server.
    pub(crate) fn is_socket(&self) -> bool {
        let is = |name, value: &str| self.field(name).is_some_and(|own| own.eq_ignore_ascii_case(value));
        is("upgrade", "websocket") && is("sec-websocket-version", "13") && self.has("origin")
    }
}

/// Whether two texts are the same, in a time that does not tell where they differ.
pub(crate) fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(text: &str) -> Head {
        Head::parse(text.as_bytes()).expect("a head").expect("all of it")
    }

    #[test]
    fn only_this_machine_and_this_page_may_ask() {
        let local = |fields: &str| head(&format!("GET / HTTP/1.1\r\n{fields}\r\n")).is_local(8000);
        assert!(local("Host: 127.0.0.1:8000\r\n"));
        assert!(local("Host: localhost:8000\r\nOrigin: http://localhost:8000\r\n"));
        assert!(!local(""));
        let usual = head("GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
        assert!(usual.is_local(80) && !usual.is_local(8000));
        assert!(!local("Host: evil.example:8000\r\n"));
        assert!(!local("Host: 127.0.0.1:8001\r\n"));
        assert!(!local("Host: 127.0.0.1:8000\r\nHost: evil.example\r\n"));
        assert!(!local("Host: 127.0.0.1:8000\r\nOrigin: http://evil.example\r\n"));
        assert!(!local("Host: 127.0.0.1:8000\r\nOrigin: null\r\n"));
        assert!(!local("Host: 127.0.0.1:8000\r\nOrigin: https://127.0.0.1:8000\r\n"));
    }

    #[test]
    fn heads_that_are_none_are_refused() {
        assert!(Head::parse(b"GET / HTTP/1.1\r\nHost: 127").expect("a beginning").is_none());
        assert!(Head::parse(b"\x16\x03\x01\x02\x00\x01").is_err());
        assert!(same("abc", "abc") && !same("abc", "abd") && !same("abc", "ab"));
    }
}
