//! Heads of HTTP requests, read with limits on size and time, and answers.

use crate::error::Error;
use crate::files::{atomic, read};
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time for a whole head, however slowly its bytes come.
pub(super) const HEAD_TIME: Duration = Duration::from_secs(5);
/// Time for the other side to take an answer.
pub(super) const WRITE_TIME: Duration = Duration::from_secs(10);
/// Longest time between bytes of a body.
const BODY_TIME: Duration = Duration::from_secs(30);
/// Largest body, bytes.
const BODY_BYTES_MAX: u64 = 16 << 30;
/// Largest head, bytes.
const HEAD_BYTES_MAX: usize = 16 << 10;
const HEADERS_MAX: usize = 64;

/// Nothing is loaded from other servers, no inline script or style is run, and no page may frame this page.
const CONTENT_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src \
                      'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The head of a request.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Head {
    pub(super) method: String,
    pub(super) path: String,
    pub(super) query: String,
    headers: Vec<(String, String)>,
    /// The part of the body that was read with the head.
    pub(super) body: Vec<u8>,
}

impl Head {
    /// Returns the value of a header that occurs once.
    pub(super) fn header(&self, name: &str) -> Option<&str> {
        let mut found = self.headers.iter().filter(|(own, _)| own.eq_ignore_ascii_case(name));
        let first = found.next()?;
        found.next().is_none().then_some(&first.1)
    }

    pub(super) fn value(&self, name: &str) -> Option<&str> {
        self.query
            .split('&')
            .filter_map(|pair| pair.split_once('='))
            .find(|(key, _)| *key == name)
            .map(|(_, value)| value)
    }
}

/// Why there is no head, as the status to answer with.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum HeadError {
    /// The other side is gone.
    Gone,
    /// A status and its name.
    Status(&'static str),
}

/// Reads a head. Only a POST has bytes after it.
pub(super) fn read_head(stream: &mut TcpStream) -> Result<Head, HeadError> {
    let end = Instant::now() + HEAD_TIME;
    let mut bytes = Vec::new();
    let mut chunk = [0_u8; 2048];
    loop {
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(HeadError::Status("408 Request Timeout"));
        }
        stream.set_read_timeout(Some(left)).map_err(|_| HeadError::Gone)?;
        match stream.read(&mut chunk) {
            Ok(0) => return Err(HeadError::Gone),
            Ok(count) => bytes.extend_from_slice(&chunk[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                return Err(HeadError::Status("408 Request Timeout"));
            }
            Err(_) => return Err(HeadError::Gone),
        }
        if bytes.len() > HEAD_BYTES_MAX {
            return Err(HeadError::Status("431 Request Header Fields Too Large"));
        }
        if let Some(head) = parse(&bytes)? {
            return Ok(head);
        }
    }
}

/// Parses a head; none while it is incomplete.
fn parse(bytes: &[u8]) -> Result<Option<Head>, HeadError> {
    const BAD: HeadError = HeadError::Status("400 Bad Request");
    let mut headers = [httparse::EMPTY_HEADER; HEADERS_MAX];
    let mut request = httparse::Request::new(&mut headers);
    let length = match request.parse(bytes) {
        Ok(httparse::Status::Partial) => return Ok(None),
        Ok(httparse::Status::Complete(length)) if length == bytes.len() || request.method == Some("POST") => length,
        Ok(httparse::Status::Complete(_)) | Err(_) => return Err(BAD),
    };
    let target = request.path.ok_or(BAD)?;
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let text = |value: &[u8]| String::from_utf8(value.to_vec()).map_err(|_| BAD);
    let headers = request.headers.iter().map(|header| Ok((header.name.to_owned(), text(header.value)?)));
    Ok(Some(Head {
        method: request.method.ok_or(BAD)?.to_owned(),
        path: path.to_owned(),
        query: query.to_owned(),
        headers: headers.collect::<Result<_, _>>()?,
        body: bytes[length..].to_vec(),
    }))
}

/// Writes an answer and ends the connection.
pub(super) fn answer(stream: &mut TcpStream, status: &str, kind: &str, more: &str, body: &[u8]) {
    send_all(stream, &head(status, kind, more, body.len() as u64), body);
}

/// Sends a file to be kept, under its own name.
pub(super) fn send(stream: &mut TcpStream, path: &Path) {
    let opened = read::open(path).and_then(|file| Ok((file.get_ref().length().map_err(Error::read(path))?, file)));
    let Ok((length, file)) = opened else { return say(stream, "404 Not Found", "The file no longer exists.") };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let coded: String = name.bytes().map(|byte| format!("%{byte:02X}")).collect();
    let more = format!("Content-Disposition: attachment; filename*=UTF-8''{coded}\r\n");
    send_all(stream, &head("200 OK", "application/octet-stream", &more, length), file);
}

/// Writes the body of a request to a file, with every byte or not at all.
pub(super) fn receive(stream: &mut TcpStream, head: &Head, path: &Path) -> crate::Result<()> {
    let length = head.header("Content-Length").and_then(|length| length.parse::<u64>().ok());
    let none = || Error::usage("file", format!("has no length, or more than {BODY_BYTES_MAX} bytes"));
    let length = length.filter(|length| *length <= BODY_BYTES_MAX).ok_or_else(none)?;
    let waits = stream.set_read_timeout(Some(BODY_TIME));
    atomic::write(path, |out| {
        waits?;
        let mut body = head.body.chain(&mut *stream).take(length);
        let copied = io::copy(&mut body, out)?;
        if copied == length { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    })
}

fn head(status: &str, kind: &str, more: &str, length: u64) -> String {
    format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{more}Cache-Control: no-store\r\n\
         Content-Security-Policy: {CONTENT_POLICY}\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nCross-Origin-Opener-Policy: same-origin\r\n\
         Connection: close\r\n\r\n"
    )
}

/// A write error means that the browser has disconnected; ignore it.
fn send_all(stream: &mut TcpStream, head: &str, mut body: impl Read) {
    let sent = stream.write_all(head.as_bytes()).and_then(|()| std::io::copy(&mut body, stream));
    let _ = sent.and_then(|_| stream.flush());
    let _ = stream.shutdown(std::net::Shutdown::Write);
}

pub(super) fn say(stream: &mut TcpStream, status: &str, text: &str) {
    answer(stream, status, "text/plain; charset=utf-8", "", format!("{text}\n").as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_are_read_whole_or_not_at_all() {
        let head =
            parse(b"GET /a?token=7&b=c HTTP/1.1\r\nHost: h\r\nX: 1\r\nx: 2\r\n\r\n").expect("whole").expect("whole");
        assert_eq!((&*head.path, head.value("token"), head.header("host")), ("/a", Some("7"), Some("h")));
        assert_eq!(head.header("x"), None, "a header that occurs twice has no value");
        assert_eq!(parse(b"GET / HTTP/1.1\r\nHost"), Ok(None));
        for bad in [&b"\x00\x01\r\n\r\n"[..], b"GET / HTTP/1.1\r\n\r\nmore", b"GET / HTTP/1.1\r\nA: \xff\r\n\r\n"] {
            assert_eq!(parse(bad), Err(HeadError::Status("400 Bad Request")));
        }
    }
}
