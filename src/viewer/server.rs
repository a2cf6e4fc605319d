//! The server: a thread per connection, fixed paths, and one WebSocket per page.

use super::exports::free_path;
use super::guard::Guard;
use super::http::{self, Head, HeadError, WRITE_TIME, answer, say};
use super::hub::Hub;
use super::message::Message;
use super::{Token, page, socket};
use crate::error::{Error, Result, Setting};
use std::io::{ErrorKind, Write};
use std::net::{TcpListener, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Maximum number of open connections, WebSockets included.
const CONNECTIONS_MAX: usize = 64;

/// Opens the port and starts to serve. Returns the rules, which know the address.
pub(super) fn start(host: &str, port: u16, token: &Token, hub: &Arc<Hub>) -> Result<Guard> {
    let failed = |error: &dyn std::fmt::Display| {
        Error::usage(
            Setting("view_host"),
            format!("cannot listen on {host}, port {port}: {error}; choose another address"),
        )
    };
    let address = (host, port).to_socket_addrs().map_err(|error| failed(&error))?.next();
    let address = address.ok_or_else(|| failed(&"the name has no address"))?;
    if *token == Token::Off && !address.ip().is_loopback() {
        let problem =
            format!("without a token, everyone who reaches {host} could view and edit the model; use a token");
        return Err(Error::usage(Setting("view_no_token"), problem));
    }
    let listener = TcpListener::bind(address).map_err(|error| match error.kind() {
        ErrorKind::AddrInUse => {
            let problem = format!("{port} is in use on {host}; choose another port, or 0 for a free one");
            Error::usage(Setting("view_port"), problem)
        }
        _ => failed(&error),
    })?;
    let address = listener.local_addr().map_err(|error| failed(&error))?;
    let guard = Guard::new(address, host, token)?;
    let (rules, hub) = (guard.clone(), Arc::clone(hub));
    let spawned = std::thread::Builder::new().name("viewer".into()).spawn(move || accept(&listener, &rules, &hub));
    spawned.map_err(|error| Error::Bug(format!("cannot start a thread for the viewer: {error}")))?;
    Ok(guard)
}

/// Counts an open connection.
struct ConnectionCount(Arc<AtomicUsize>);

impl Drop for ConnectionCount {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

fn accept(listener: &TcpListener, guard: &Guard, hub: &Arc<Hub>) {
    let open = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        if hub.is_closing() {
            return;
        }
        // Too many open files: the next one may do.
        let Ok(mut stream) = stream else {
            std::thread::sleep(std::time::Duration::from_millis(20));
            continue;
        };
        let counted = ConnectionCount(Arc::clone(&open));
        let is_full = open.fetch_add(1, Ordering::SeqCst) >= CONNECTIONS_MAX;
        if stream.set_write_timeout(Some(WRITE_TIME)).is_err() {
            continue;
        }
        if is_full {
            say(&mut stream, "503 Service Unavailable", "Too many connections are open.");
            continue;
        }
        let (guard, hub) = (guard.clone(), Arc::clone(hub));
        let serve = move || {
            let _counted = counted;
            connection(stream, &guard, &hub);
        };
        // Without a thread the connection closes.
        let _ = std::thread::Builder::new().name("viewer-page".into()).spawn(serve);
    }
}

fn connection(mut stream: TcpStream, guard: &Guard, hub: &Arc<Hub>) {
    let head = match http::read_head(&mut stream) {
        Ok(head) => head,
        Err(HeadError::Gone) => return,
        Err(HeadError::Status(status)) => return say(&mut stream, status, status),
    };
    let host = head.header("Host");
    let is_named = host.is_some_and(|host| !host.is_empty());
    let is_proven = is_named && guard.is_proven(head.value("token"), head.header("Cookie"));
    if !is_proven && !guard.knows_host(host) {
        let text = "This server does not accept this host name. Open the printed address, with its token.";
        return say(&mut stream, "403 Forbidden", text);
    }
    let is_socket = head.path == "/socket";
    if !Guard::is_same_origin(head.header("Origin"), host, is_socket) {
        return say(&mut stream, "403 Forbidden", "Requests from other pages are refused.");
    }
    let is_upload = head.method == "POST" && head.path == "/open";
    if head.method != "GET" && !is_upload {
        return say(&mut stream, "405 Method Not Allowed", "Only GET requests are allowed.");
    }
    if head.path == "/" && head.value("token").is_some() {
        return enter(&mut stream, guard, &head);
    }
    if !guard.knows_cookie(head.header("Cookie")) {
        return say(&mut stream, "401 Unauthorized", "Open the address with the token that labelgs printed last.");
    }
    if is_upload {
        return open_model(&mut stream, &head, hub);
    }
    if is_socket { open_socket(stream, &head, hub) } else { files(&mut stream, &head.path, hub) }
}

/// Turns the token of the address into a cookie and takes it out of the address.
fn enter(stream: &mut TcpStream, guard: &Guard, head: &Head) {
    if !guard.knows_token(head.value("token")) {
        return say(stream, "401 Unauthorized", "The token is wrong. Open the printed address.");
    }
    let more = format!("{}Location: /\r\n", guard.set_cookie().unwrap_or_default());
    answer(stream, "303 See Other", "text/plain; charset=utf-8", &more, b"");
}

fn open_socket(mut stream: TcpStream, head: &Head, hub: &Arc<Hub>) {
    let Some(text) = socket::handshake(head) else {
        return say(&mut stream, "400 Bad Request", "Expected a WebSocket request.");
    };
    let Some(id) = hub.join() else {
        return say(&mut stream, "503 Service Unavailable", "Too many pages are open. Close one.");
    };
    if stream.write_all(text.as_bytes()).is_err() {
        return hub.leave(id);
    }
    socket::serve(stream, hub, id);
}

/// Takes a model that was dropped on the page, and lets the engine's thread open it.
fn open_model(stream: &mut TcpStream, head: &Head, hub: &Hub) {
    let (name, ending) = head.value("name").and_then(|name| name.rsplit_once('.')).unwrap_or_default();
    let Some(folder) = hub.folder() else {
        return say(stream, "409 Conflict", "You cannot open another model during training.");
    };
    let received = free_path(&folder, name, &format!(".{}", ending.to_lowercase()))
        .and_then(|path| http::receive(stream, head, &path).map(|()| path));
    match received {
        Ok(path) => {
            hub.note(Message::Open { path });
            say(stream, "200 OK", "The model is open.");
        }
        Err(error) => say(stream, "400 Bad Request", &error.to_string()),
    }
}

/// Answers with a file of the page, or a photo or an exported model by its number. No path of the request reaches the
/// disk.
fn files(stream: &mut TcpStream, path: &str, hub: &Hub) {
    if let Some((kind, bytes)) = page::file(path) {
        return answer(stream, "200 OK", kind, "", bytes);
    }
    let number = path.strip_prefix("/export/").and_then(|number| number.parse().ok());
    if let Some(file) = number.and_then(|number| hub.file(number)) {
        return http::send(stream, &file);
    }
    let label = path.strip_prefix("/label/").and_then(|label| label.parse().ok());
    if let Some(png) = label.and_then(|label| hub.portrait(label)) {
        return answer(stream, "200 OK", "image/png", "", &png);
    }
    let photo = path.strip_prefix("/photo/").map(|number| (number, false));
    let asked = photo.or(path.strip_prefix("/thumb/").map(|number| (number, true)));
    let found = asked.and_then(|(number, small)| hub.views().picture(number.parse().ok()?, small));
    match found {
        Some((kind, bytes)) => answer(stream, "200 OK", kind, "", &bytes),
        None => say(stream, "404 Not Found", "Page not found."),
    }
}
