//! Debian's `chromium`, without a window, over its DevTools protocol.

use super::server::{PATIENCE, address_of};
use serde_json::{Value, json};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// A running browser; it ends with this value.
pub struct Browser {
    child: Child,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    next: u64,
    /// Errors and warnings of all pages.
    pub complaints: Vec<String>,
    _folder: tempfile::TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A page: its session and its target.
#[derive(Clone, Debug)]
pub struct Tab {
    session: String,
    target: String,
}

impl Browser {
    /// Starts a browser. Without one, returns none and a message, or fails where one is required.
    pub fn start() -> Option<Self> {
        let folder = tempfile::tempdir().expect("a folder");
        let mut command = Command::new("chromium");
        command.args([
            "--headless",
            "--no-sandbox",
            "--remote-debugging-port=0",
            "--hide-scrollbars",
            "--no-first-run",
        ]);
        command.args(["--disable-background-networking", "--mute-audio"]);
        // WebGL without a graphics card.
        command.args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]);
        command.arg(format!("--user-data-dir={}", folder.path().display())).arg("about:blank");
        let started = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
        let mut child = match started {
            Ok(child) => child,
            Err(error) => {
                assert!(std::env::var_os("LABELGS_REQUIRE_CHROMIUM").is_none(), "chromium is required: {error}");
                eprintln!("skipped: chromium does not start: {error}");
                return None;
            }
        };
        let address = address_of(&mut child, "ws://");
        let (socket, _) = tungstenite::connect(address).expect("a connection");
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(PATIENCE)).expect("a time");
        }
        Some(Self { child, socket, next: 0, complaints: Vec::new(), _folder: folder })
    }

    /// Calls a method of the browser, or of a page.
    pub fn call(&mut self, tab: Option<&Tab>, method: &str, params: Value) -> Value {
        self.next += 1;
        let mut message = json!({ "id": self.next, "method": method, "params": params });
        if let Some(tab) = tab {
            message["sessionId"] = tab.session.as_str().into();
        }
        self.socket.send(Message::text(message.to_string())).expect("sent");
        loop {
            let Message::Text(text) = self.socket.read().unwrap_or_else(|error| panic!("{method}: {error}")) else {
                continue;
            };
            let mut answer: Value = serde_json::from_str(&text).expect("JSON");
            if answer["id"] == self.next {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].take();
            }
            self.note(&answer);
        }
    }

    fn note(&mut self, event: &Value) {
        let params = &event["params"];
        let is_bad = match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => true,
            Some("Runtime.consoleAPICalled") => {
                ["error", "warning", "assert"].contains(&params["type"].as_str().unwrap_or(""))
            }
            Some("Log.entryAdded") => ["error", "warning"].contains(&params["entry"]["level"].as_str().unwrap_or("")),
            _ => false,
        };
        if is_bad {
            self.complaints.push(params.to_string().chars().take(800).collect());
        }
    }

    /// Opens a page of this size.
    pub fn open(&mut self, address: &str, size: (u32, u32)) -> Tab {
        let made = self.call(None, "Target.createTarget", json!({ "url": "about:blank" }));
        let target = made["targetId"].as_str().expect("a target").to_owned();
        let attached = self.call(None, "Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        let tab = Tab { session: attached["sessionId"].as_str().expect("a session").to_owned(), target };
        for domain in ["Page", "Runtime", "Log"] {
            self.call(Some(&tab), &format!("{domain}.enable"), json!({}));
        }
        self.resize(&tab, size);
        self.call(Some(&tab), "Page.navigate", json!({ "url": address }));
        tab
    }

    pub fn resize(&mut self, tab: &Tab, (width, height): (u32, u32)) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call(Some(tab), "Emulation.setDeviceMetricsOverride", size);
    }

    /// Ends a page at once.
    pub fn kill(&mut self, tab: &Tab) {
        self.call(None, "Target.closeTarget", json!({ "targetId": tab.target }));
    }

    /// The value of an expression, awaited.
    #[track_caller]
    pub fn js(&mut self, tab: &Tab, expression: &str) -> Value {
        let how = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let mut result = self.call(Some(tab), "Runtime.evaluate", how);
        assert!(result["exceptionDetails"].is_null(), "{expression}: {}", result["exceptionDetails"]);
        result["result"]["value"].take()
    }

    /// Waits until an expression is true.
    #[track_caller]
    pub fn until(&mut self, tab: &Tab, expression: &str) {
        let end = Instant::now() + PATIENCE;
        while self.js(tab, &format!("Boolean({expression})")) != true {
            if Instant::now() >= end {
                let text = self.js(tab, "document.body.innerText").to_string();
                panic!("never: {expression}; the page has {text}; {:?}", self.complaints);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// An event of the mouse; `modifiers`: 1 Alt, 2 Ctrl, 8 Shift.
    pub fn mouse(&mut self, tab: &Tab, kind: &str, (x, y): (f64, f64), modifiers: u32) {
        let buttons = u32::from(kind != "mouseReleased");
        let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1, "modifiers": modifiers });
        self.call(Some(tab), "Input.dispatchMouseEvent", event);
    }

    pub fn click(&mut self, tab: &Tab, at: (f64, f64), modifiers: u32) {
        self.mouse(tab, "mousePressed", at, modifiers);
        self.mouse(tab, "mouseReleased", at, modifiers);
    }

    /// Clicks in the middle of an element.
    #[track_caller]
    pub fn click_on(&mut self, tab: &Tab, selector: &str) {
        let place = format!(
            "(() => {{ const e = document.querySelector({selector:?}); e.scrollIntoView({{ block: 'nearest' }}); \
             const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; }})()"
        );
        let at = self.js(tab, &place);
        let at = (at[0].as_f64().expect("x"), at[1].as_f64().expect("y"));
        self.click(tab, at, 0);
    }

    pub fn drag(&mut self, tab: &Tab, from: (f64, f64), to: (f64, f64)) {
        self.mouse(tab, "mousePressed", from, 0);
        for part in 1..=6 {
            let share = f64::from(part) / 6.0;
            self.mouse(tab, "mouseMoved", (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share), 0);
        }
        self.mouse(tab, "mouseReleased", to, 0);
    }

    /// Presses a key by its place on the keyboard, such as `KeyV`, and its meaning, such as `v`.
    pub fn key(&mut self, tab: &Tab, code: &str, key: &str, modifiers: u32) {
        let text = if key.chars().count() == 1 && modifiers & 2 == 0 {
            key
        } else if key == "Enter" {
            "\r"
        } else {
            ""
        };
        for kind in ["keyDown", "keyUp"] {
            let mut event = json!({ "type": kind, "code": code, "key": key, "modifiers": modifiers });
            if kind == "keyDown" && !text.is_empty() {
                event["text"] = text.into();
            }
            if let Some(number) = virtual_key(key) {
                event["windowsVirtualKeyCode"] = number.into();
            }
            self.call(Some(tab), "Input.dispatchKeyEvent", event);
        }
    }

    /// Types text into what has the focus.
    pub fn write(&mut self, tab: &Tab, text: &str) {
        self.call(Some(tab), "Input.insertText", json!({ "text": text }));
    }
}

/// Keys that Chromium handles by number: it moves the focus, or presses a button.
fn virtual_key(key: &str) -> Option<u32> {
    [
        ("Tab", 9),
        ("Enter", 13),
        ("Escape", 27),
        (" ", 32),
        ("ArrowLeft", 37),
        ("ArrowUp", 38),
        ("ArrowRight", 39),
        ("ArrowDown", 40),
    ]
    .iter()
    .find(|(name, _)| *name == key)
    .map(|(_, number)| *number)
}
