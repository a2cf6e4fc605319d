//! The WebSocket of a page: a thread reads, another writes.

use super::http::{Head, WRITE_TIME};
use super::hub::{ClientId, Hub, Outgoing};
use super::message::{BYTES_MAX, Message, RATE_MAX};
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message as Packet, WebSocket};

/// A page that is silent for this long is disconnected. Pages send a sign of life three times as often.
const SILENCE_MAX: Duration = Duration::from_secs(60);

/// The reading half. What the protocol would answer by itself is dropped: it could fall into the middle of a frame.
struct ReadHalf(TcpStream);

impl Read for ReadHalf {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.0.read(bytes)
    }
}

impl Write for ReadHalf {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Returns the answer that opens a WebSocket; none if the request does not ask for one.
pub(super) fn handshake(head: &Head) -> Option<String> {
    let is = |name: &str, word: &str| {
        head.header(name).is_some_and(|value| value.split(',').any(|part| part.trim().eq_ignore_ascii_case(word)))
    };
    let key = head.header("Sec-WebSocket-Key")?;
    if !is("Upgrade", "websocket") || !is("Connection", "upgrade") || !is("Sec-WebSocket-Version", "13") {
        return None;
    }
    Some(format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {}\r\n\r\n",
        derive_accept_key(key.as_bytes())
    ))
}

/// Serves a page until it or the server ends.
pub(super) fn serve(stream: TcpStream, hub: &Arc<Hub>, id: ClientId) {
    if let Some(writer) = start_writer(&stream, hub, id) {
        read(stream, hub, id);
        hub.leave(id);
        // Ends within the time of a write.
        let _ = writer.join();
    }
    hub.leave(id);
}

fn config() -> WebSocketConfig {
    WebSocketConfig::default().max_message_size(Some(BYTES_MAX)).max_frame_size(Some(BYTES_MAX))
}

fn start_writer(stream: &TcpStream, hub: &Arc<Hub>, id: ClientId) -> Option<std::thread::JoinHandle<()>> {
    stream.set_read_timeout(Some(SILENCE_MAX)).ok()?;
    stream.set_write_timeout(Some(WRITE_TIME)).ok()?;
    stream.set_nodelay(true).ok()?;
    let (out, hub) = (stream.try_clone().ok()?, Arc::clone(hub));
    let write = move || {
        let end = out.try_clone();
        let mut socket = WebSocket::from_raw_socket(out, Role::Server, Some(config()));
        loop {
            let sent = match hub.outgoing(id) {
                Outgoing::Text(text) => socket.send(Packet::text(&*text)),
                Outgoing::Frame(bytes) => socket.send(Packet::binary(bytes)),
                Outgoing::Close => {
                    let _ = socket.close(None);
                    break;
                }
            };
            if sent.is_err() {
                break;
            }
        }
        // Wakes the reader.
        let _ = end.map(|end| end.shutdown(Shutdown::Both));
    };
    std::thread::Builder::new().name("viewer-write".into()).spawn(write).ok()
}

fn read(stream: TcpStream, hub: &Hub, id: ClientId) {
    let mut socket = WebSocket::from_raw_socket(ReadHalf(stream), Role::Server, Some(config()));
    let (mut allowance, mut last) = (RATE_MAX, Instant::now());
    while let Ok(packet) = socket.read() {
        allowance = (allowance + last.elapsed().as_secs_f64() * RATE_MAX).min(RATE_MAX) - 1.0;
        last = Instant::now();
        if allowance < 0.0 {
            tracing::warn!("a page sent more than {RATE_MAX} messages per second and was disconnected");
            break;
        }
        match packet {
            Packet::Text(text) => match serde_json::from_str::<Message>(&text) {
                Ok(message) => hub.receive(id, message),
                Err(error) => {
                    let text = format!("The server did not understand the page: {error}");
                    hub.reply(id, &serde_json::json!({ "kind": "problem", "text": text }));
                }
            },
            Packet::Close(_) => break,
            _ => {}
        }
    }
}
