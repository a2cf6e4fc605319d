//! The server, by a page that only speaks the protocol.

use super::server::{Page, Place, Server};
use crate::support::device;
use crate::support::runs::history;
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::time::{Duration, Instant};

/// Names of the views of the scene, in the order of the server.
const VIEW_NAMES: [&str; 6] = ["000", "001", "002", "003", "004", "005"];

fn status(answer: &str) -> &str {
    answer.split(' ').nth(1).unwrap_or_default()
}

#[test]
fn requests_of_strangers_are_refused() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let server = place.view(&[]);
    let cookie = server.cookie();
    let own = format!("http://{}", server.host());
    let with = ("Cookie", cookie.as_str());
    assert_eq!(status(&server.get("/", &[with])), "200");
    assert_eq!(status(&server.get("/main.js", &[with, ("Origin", &own)])), "200");

    // Another name or port, as of a tunnel, needs the token; a page that points its name at loopback has none. The page
    // of such a name is its own origin, and no other page is.
    let port = server.port();
    for host in [format!("rebind.test:{port}"), "127.0.0.1".into(), format!("127.0.0.1:{}", port ^ 1), String::new()] {
        assert_eq!(status(&server.get("/", &[("Host", &host)])), "403", "{host}");
        assert_eq!(status(&server.get("/", &[("Host", &host), ("Cookie", "labelgs=0")])), "403", "{host}");
        let expected = if host.is_empty() { "403" } else { "200" };
        assert_eq!(status(&server.get("/", &[with, ("Host", &host)])), expected, "{host}");
        let pages = [(format!("http://{host}"), expected), (own.clone(), "403"), ("http://evil.test".into(), "403")];
        for (origin, expected) in pages {
            let headers = [with, ("Host", host.as_str()), ("Origin", origin.as_str())];
            assert_eq!(status(&server.get("/main.js", &headers)), expected, "{host} from {origin}");
        }
    }
    assert_eq!(status(&server.raw(format!("GET / HTTP/1.1\r\nCookie: {cookie}\r\n\r\n").as_bytes())), "403");
    for origin in ["http://evil.test", "null", "http://127.0.0.1:1", "https://127.0.0.1"] {
        assert_eq!(status(&server.get("/", &[with, ("Origin", origin)])), "403", "{origin}");
        assert!(server.try_page(origin, &cookie).is_none(), "{origin}");
    }
    let upgrade = [("Connection", "Upgrade"), ("Upgrade", "websocket"), ("Sec-WebSocket-Version", "13")];
    let key = ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==");
    assert_eq!(status(&server.get("/socket", &[&upgrade[..], &[key, with]].concat())), "403", "no origin at all");

    // The token.
    for path in ["/", "/main.js", "/photo/0", "/socket"] {
        assert_eq!(status(&server.get(path, &[("Origin", &own)])), "401", "{path}");
        assert_eq!(status(&server.get(path, &[("Origin", &own), ("Cookie", "labelgs=0")])), "401", "{path}");
    }
    assert!(server.try_page(&own, "").is_none());
    assert_eq!(status(&server.get("/?token=00000000000000000000000000000000", &[])), "401");
    let entered = server.get(server.address.split(server.host()).nth(1).expect("a path"), &[]);
    assert_eq!(status(&entered), "303");
    assert!(entered.contains(&format!("Set-Cookie: {cookie}; Path=/; HttpOnly; SameSite=Strict\r\n")), "{entered}");
    assert!(entered.contains("\r\nLocation: /\r\n"), "the token leaves the address: {entered}");

    // Nothing is allowed to others, and no path reaches the disk.
    let page = server.get("/", &[with]);
    assert!(!page.to_lowercase().contains("access-control"), "{page}");
    for rule in ["default-src 'none'", "script-src 'self'", "frame-ancestors 'none'"] {
        assert!(page.contains(rule), "{rule}");
    }
    for path in ["/../Cargo.toml", "/model.ply", "/photo/../0", "/photo/6", "/photo/-1", "/photo/99999999999999999999"]
    {
        assert_eq!(status(&server.get(path, &[with])), "404", "{path}");
    }
    let post = format!("POST / HTTP/1.1\r\nHost: {}\r\nCookie: {cookie}\r\n\r\n", server.host());
    assert_eq!(status(&server.raw(post.as_bytes())), "405");

    let open = place.run(&["view", "model.ply", "--view-no-token", "--view-host", "0.0.0.0"]);
    assert_eq!(open.status.code(), Some(2), "{}", String::from_utf8_lossy(&open.stderr));
    assert!(String::from_utf8_lossy(&open.stderr).contains("--view-no-token"));
}

#[test]
fn a_server_on_every_address_prints_one_that_opens() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let server = place.view(&["--view-host", "0.0.0.0"]);
    assert!(server.address.starts_with("http://127.0.0.1:"), "{}", server.address);
    let cookie = server.cookie();
    let name = format!("machine.test:{}", server.port());
    assert_eq!(status(&server.get("/", &[("Host", &name), ("Cookie", &cookie)])), "200");
    assert_eq!(status(&server.get("/", &[("Host", &name)])), "403");

    let taken = place.run(&["view", "model.ply", "--view-port", &server.port().to_string(), "--view-host", "0.0.0.0"]);
    let text = String::from_utf8_lossy(&taken.stderr);
    assert_eq!(taken.status.code(), Some(2), "{text}");
    assert!(text.contains("--view-port") && text.contains("in use") && text.contains("0 for a free one"), "{text}");
}

#[test]
fn broken_requests_cost_the_server_nothing() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let server = place.view(&["--view-no-token"]);
    // Half a head, byte by byte, ends within the time of a head.
    let mut slow = server.connect();
    let start = Instant::now();
    for byte in b"GET / HTTP/1.1\r\nHost: 127" {
        if slow.write_all(&[*byte]).is_err() {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(status(&server.raw(b"\x16\x03\x01 nonsense\r\n\r\n")), "400");
    let long = format!("GET / HTTP/1.1\r\nHost: {}\r\nX: {}", server.host(), "x".repeat(20_000));
    assert!(["431", ""].contains(&status(&server.raw(long.as_bytes()))));
    assert_eq!(status(&server.get("/socket", &[("Origin", &format!("http://{}", server.host()))])), "400");

    // Connections in a row, and more at once than are served.
    (0..300).for_each(|_| drop(server.connect()));
    let held: Vec<_> = (0..80).map(|_| server.connect()).collect();
    drop(held);
    let mut answer = String::new();
    let _ = slow.read_to_string(&mut answer);
    assert_eq!(status(&answer), "408");
    assert!(start.elapsed() < Duration::from_secs(15), "{:?}", start.elapsed());

    // Too many pages.
    let origin = format!("http://{}", server.host());
    let pages: Vec<Page> = std::iter::from_fn(|| server.try_page(&origin, "")).take(20).collect();
    assert!((4..20).contains(&pages.len()), "{}", pages.len());
    drop(pages);

    // Messages: nonsense, a frame that claims a gigabyte, a flood.
    let mut page = wait_for_page(&server, &origin);
    for text in ["{", "[]", "7", r#"{"kind":"x"}"#, r#"{"kind":"look"}"#] {
        page.socket.send(tungstenite::Message::text(text)).expect("sent");
        page.hear("problem");
    }
    let from = json!({ "camera": { "w2c": [[1, 0], [0, 1]], "fx": 1, "fy": 1, "cx": 0, "cy": 0, "W": 4, "H": 4 } });
    for from in [from, json!({ "view": 17 })] {
        let seq = page.ask(&from, &["colour"], false);
        assert_eq!(page.hear("lost")["seq"], seq);
    }
    let huge = json!({ "camera": { "w2c": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "fx": 100, "fy": 100,
        "cx": 0, "cy": 0, "W": 100_000, "H": 100_000 } });
    page.ask(&huge, &["colour"], false);
    page.hear("lost");
    let stream = page.socket.get_mut();
    stream.write_all(&[0x81, 0xff, 0, 0, 0, 0, 0x40, 0, 0, 0, 1, 2, 3, 4]).expect("sent");
    assert!(ends(&mut page), "a gigabyte is refused by its header");
    let mut page = wait_for_page(&server, &origin);
    let flood = (0..5000).try_for_each(|_| page.socket.send(tungstenite::Message::text(r#"{"kind":"alive"}"#)));
    assert!(flood.is_err() || ends(&mut page), "a flood is cut off");

    // After all that it serves as before.
    let mut page = wait_for_page(&server, &origin);
    assert!(page.still(&json!({ "view": 0 }), &["colour"]).exact);
}

/// The place of a page that has just gone becomes free when its threads have ended.
fn wait_for_page(server: &Server, origin: &str) -> Page {
    let end = Instant::now() + Duration::from_secs(20);
    loop {
        if let Some(page) = server.try_page(origin, "") {
            return page;
        }
        assert!(Instant::now() < end, "no page can be opened");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// True if the server ends the connection.
fn ends(page: &mut Page) -> bool {
    let stream = page.socket.get_mut();
    stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a time");
    let mut bytes = [0; 4096];
    loop {
        match stream.read(&mut bytes) {
            Ok(0) => return true,
            Ok(_) => {}
            Err(error) => return error.kind() == std::io::ErrorKind::ConnectionReset,
        }
    }
}

#[test]
fn pictures_are_those_of_render() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    place.succeeds(&[
        "render",
        "model.ply",
        "--scene",
        "scene",
        "--views",
        "all",
        "--what",
        "rgb,labels,depth,alpha",
        "-o",
        "all",
    ]);
    place.succeeds(&["render", "model.ply", "--scene", "scene", "--views", "000", "--without", "1,3", "-o", "without"]);
    place.succeeds(&["render", "model.ply", "--scene", "scene", "--views", "000", "--only", "2", "-o", "only"]);
    let server = place.view(&[]);
    let mut page = server.page();
    let scene = page.hear("scene");
    for (index, name) in VIEW_NAMES.iter().enumerate() {
        let frame = page.still(&json!({ "view": index }), &["colour", "labels"]);
        assert!(frame.exact && frame.size == (64, 48) && frame.step == 0);
        assert_eq!(frame.pictures[0], place.picture(&format!("all/{name}.rgb.png")), "{name}");
        assert_eq!(frame.pictures[1], place.picture(&format!("all/{name}.labels-colour.png")), "{name}");
        let frame = page.still(&json!({ "view": index }), &["depth", "opacity"]);
        assert_eq!(frame.pictures[0], place.picture(&format!("all/{name}.depth.png")), "{name}");
        assert_eq!(frame.pictures[1], place.picture(&format!("all/{name}.alpha.png")), "{name}");
    }

    // The camera of the wire is the file of --camera, also at another size.
    let mut camera = scene["views"][2]["camera"].clone();
    (camera["W"], camera["H"]) = (101.into(), 67.into());
    std::fs::write(place.path("camera.json"), camera.to_string()).expect("a file");
    place.succeeds(&["render", "model.ply", "--camera", "camera.json", "-o", "free"]);
    let free = page.still(&json!({ "camera": camera }), &["colour"]);
    assert_eq!(free.pictures[0], place.picture("free/camera.rgb.png"));

    // Every pixel that is asked for has the label of the map; so has the main Gaussian's depth a place.
    let ids = place.picture("all/000.labels.png");
    let mut found = std::collections::BTreeSet::new();
    for n in 0..50_u32 {
        let [x, y] = [n * 37 % 64, n * 29 % 48];
        let picked = page.pick(&json!({ "view": 0 }), [x, y]);
        assert_eq!(picked["label"], ids.values[(y * 64 + x) as usize], "{x}, {y}");
        assert_eq!(picked["gaussian"].is_null(), picked["weight"] == 0.0, "{picked}");
        found.insert(picked["label"].to_string());
    }
    assert!(found.len() >= 3, "the pixels tell labels apart: {found:?}");

    // Hidden labels, one alone, nothing, and all again.
    page.send(&json!({ "kind": "show", "hidden": [1, 3], "solo": [] }));
    assert_eq!(page.still(&json!({ "view": 0 }), &["colour"]).pictures[0], place.picture("without/000.rgb.png"));
    page.send(&json!({ "kind": "show", "hidden": [], "solo": [2] }));
    assert_eq!(page.still(&json!({ "view": 0 }), &["colour"]).pictures[0], place.picture("only/000.rgb.png"));
    page.send(&json!({ "kind": "show", "hidden": [0, 1, 2, 3, 4], "solo": [] }));
    let nothing = page.still(&json!({ "view": 0 }), &["colour"]);
    assert!(nothing.pictures[0].values.iter().all(|&value| value == 0));
    page.send(&json!({ "kind": "show", "hidden": [], "solo": [] }));
    assert_eq!(page.still(&json!({ "view": 0 }), &["colour"]).pictures[0], place.picture("all/000.rgb.png"));

    // Scores come while nothing else is to do.
    let scores = page.until("scores", |scores| scores["rows"].as_array().is_some_and(|rows| rows.len() == 6));
    assert!(scores["rows"].as_array().expect("rows").iter().all(|row| row[0].is_number()), "{scores}");
}

#[test]
fn the_newest_camera_wins_and_one_frame_is_on_the_wire() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let server = place.view(&[]);
    let mut page = server.page();
    page.hear("scene");
    let asked: Vec<u32> = (0..40).map(|n| page.ask(&json!({ "view": n % 6 }), &["colour"], true)).collect();
    let first = page.frame_within(super::server::PATIENCE).expect("a frame");
    assert!(page.frame_within(Duration::from_millis(300)).is_none(), "the first one is not acknowledged");
    page.ack(first.seq);
    let mut frames = vec![first];
    while frames.last().expect("frames").seq != asked[39] {
        let frame = page.frame_within(super::server::PATIENCE).expect("a frame");
        page.ack(frame.seq);
        frames.push(frame);
    }
    let seqs: Vec<u32> = frames.iter().map(|frame| frame.seq).collect();
    assert!(seqs.windows(2).all(|pair| pair[0] < pair[1]) && seqs.len() < 20, "{seqs:?}");
}

/// A list of changes with so many, which is saved or not.
pub(super) fn has(edits: &Value, count: usize, is_saved: bool) -> bool {
    edits["changes"].as_array().is_some_and(|all| all.len() == count) && edits["saved"] == is_saved
}

#[test]
fn edits_are_told_saved_and_made_again_by_a_command() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let server = place.view(&[]);
    let mut page = server.page();
    let before = page.hear("labels");
    page.hear("edits");
    let edits = [
        (json!({ "edit": "rename", "label": 1, "name": "it's a $(cup)" }), "Renamed cup to it's a $(cup)"),
        (
            json!({ "edit": "recolour", "labels": [3], "colour": [0.85, 0.1, 0.05], "mix": 0.7 }),
            "Recoloured box of tea",
        ),
        (json!({ "edit": "merge", "labels": [1, 4] }), "Merged it's a $(cup), label 4"),
        (
            json!({ "edit": "remove", "labels": [2], "fill": true }),
            "Removed <img src=x onerror=window.hacked=1>, filled",
        ),
    ];
    for (before, (edit, told)) in edits.iter().enumerate() {
        page.edit(edit);
        let edits = page.until("edits", |edits| has(edits, before + 1, false));
        assert_eq!(edits["changes"][before], *told);
    }
    page.send(&json!({ "kind": "write" }));
    page.hear("said");
    let done = page.until("edits", |edits| has(edits, 4, true));
    assert_eq!(done["file"], "model-edits/001.ply");
    same_by_command(&place, done["command"].as_str().expect("a command"), "model-edits/001");

    // Taken back one by one: the model as it was, rows and names. Then all are made again.
    for left in (0..4).rev() {
        page.send(&json!({ "kind": "undo" }));
        page.until("edits", |edits| has(edits, left, left == 0));
    }
    assert_eq!(page.until("labels", |labels| labels == &before), before);
    for there in 1..=4 {
        page.send(&json!({ "kind": "redo" }));
        page.until("edits", |edits| has(edits, there, false));
    }
    page.send(&json!({ "kind": "write" }));
    let again = page.until("edits", |edits| has(edits, 4, true));
    assert_eq!(again["file"], "model-edits/002.ply");
    let read = |name: &str| std::fs::read(place.path(name)).expect("a file");
    for ending in ["ply", "labels.json", "edits.json"] {
        let [first, second] = ["001", "002"].map(|number| read(&format!("model-edits/{number}.{ending}")));
        assert!(first == second, "{ending}");
    }
    (0..4).for_each(|_| page.send(&json!({ "kind": "undo" })));
    page.until("edits", |edits| has(edits, 0, true));
    page.edit(&json!({ "edit": "rename", "label": 1, "name": "cup" }));
    page.until("edits", |edits| has(edits, 1, false));
    page.send(&json!({ "kind": "write" }));
    let last = page.until("edits", |edits| has(edits, 1, true))["file"].as_str().expect("a file").to_owned();
    assert_eq!(read(&last), read("model.ply"), "undo gives the bytes of the start");
    assert_eq!(read(&last.replace(".ply", ".labels.json")), read("model.labels.json"));

    // What cannot be done is said, and changes nothing.
    for (edit, word) in [
        (json!({ "edit": "rename", "label": 1, "name": "box of tea" }), "unique"),
        (json!({ "edit": "rename", "label": 9, "name": "x" }), "no Gaussian has label 9"),
        (json!({ "edit": "remove", "labels": [0, 1, 2, 3, 4] }), "no Gaussian would be left"),
        (json!({ "edit": "merge", "labels": [1] }), "two"),
    ] {
        page.edit(&edit);
        let problem = page.hear("problem")["text"].to_string();
        assert!(problem.contains(word), "{edit}: {problem}");
    }
}

/// What was not saved is in a file after Ctrl-C, which the program names; a second start has the same token if it is
/// given.
#[test]
fn an_interrupted_viewer_loses_no_change() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let view = || {
        let mut command = place.command(&["view", "model.ply"]);
        command.env("LABELGS_VIEW_TOKEN", "a-token_of-22-letters");
        Server::start(command)
    };
    let server = view();
    assert!(server.address.ends_with("/?token=a-token_of-22-letters"), "{}", server.address);
    let mut page = server.page();
    page.hear("labels");
    page.edit(&json!({ "edit": "rename", "label": 1, "name": "mug" }));
    page.until("edits", |edits| has(edits, 1, false));
    // The list of changes is there before it is asked for, in case the program is killed.
    assert!(place.path("model-edits/001.edits.json").is_file() && !place.path("model-edits/001.ply").exists());
    let (status, said) = server.interrupt();
    assert_eq!(status, Some(130), "{said}");
    let line = said.lines().find(|line| line.contains("unsaved edits are saved in")).expect("a line");
    assert!(line.contains("model-edits/001.ply") && line.contains("labelgs view model-edits/001.ply"), "{line}");
    let table = std::fs::read_to_string(place.path("model-edits/001.labels.json")).expect("a table");
    assert!(table.contains("mug"), "{table}");
    // Nothing to save: nothing is said, and nothing is written.
    let server = view();
    server.page().hear("labels");
    let (status, said) = server.interrupt();
    assert!(status == Some(130) && !said.contains("unsaved"), "{said}");
    assert!(!place.path("model-edits/002.ply").exists());
    // Changes that cannot be saved keep the server up, until they can.
    let mut server = view();
    let mut page = server.page();
    page.hear("labels");
    page.edit(&json!({ "edit": "rename", "label": 1, "name": "mug" }));
    page.until("edits", |edits| has(edits, 1, false));
    std::fs::rename(place.path("model-edits"), place.path("kept")).expect("moved");
    std::fs::write(place.path("model-edits"), "no folder").expect("written");
    server.signal();
    std::thread::sleep(std::time::Duration::from_secs(1));
    assert!(server.child.try_wait().expect("a status").is_none(), "it waits for the change to be saved");
    std::fs::remove_file(place.path("model-edits")).expect("removed");
    let (status, said) = server.ended();
    assert!(status == Some(130) && said.contains("cannot save the edits"), "{said}");
    assert!(place.path("model-edits/002.ply").is_file(), "{said}");
}

/// Takes what the viewer wrote away, runs the command that it showed, and compares the bytes.
pub(super) fn same_by_command(place: &Place, command: &str, stem: &str) {
    let read = |ending: &str| std::fs::read(place.path(&format!("{stem}.{ending}"))).expect("a file");
    let own = (read("ply"), read("labels.json"));
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_labelgs")).parent().expect("a folder");
    for ending in ["ply", "labels.json"] {
        std::fs::remove_file(place.path(&format!("{stem}.{ending}"))).expect("a file");
    }
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", command]).env("PATH", path).env("LABELGS_VALIDATION", "off");
    let output = shell.current_dir(place.path("")).output().expect("it runs");
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
    assert!(own == (read("ply"), read("labels.json")), "{stem} differs from that of {command}");
}

const TRAIN_FLAGS: [&str; 10] = [
    "train",
    "scene",
    "--masks",
    "scene/masks",
    "--checkpoint-every",
    "0",
    "--set",
    "preview_every=0",
    "--set",
    "label_from=20",
];

fn train(place: &Place, out: &str, flags: &[&str]) -> std::process::Command {
    place.command(&[&TRAIN_FLAGS[..], &["-o", out], flags].concat())
}

#[test]
fn a_watched_and_paused_training_keeps_its_bits() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let alone = train(&place, "alone", &["--iterations", "120"]).output().expect("it runs");
    assert!(alone.status.success(), "{}", String::from_utf8_lossy(&alone.stderr));
    let mut server = Server::train(train(&place, "watched", &["--iterations", "120", "--view", "--view-share", "0.9"]));
    let mut page = server.page();
    let scene = page.hear("scene");
    assert_eq!(scene["views"].as_array().map(Vec::len), Some(6));
    page.send(&json!({ "kind": "train", "what": "pause" }));
    let step = page.until("training", |state| state["paused"] == true)["step"].as_u64().expect("a step");
    // A pause holds the step, while pictures are drawn, labels refused, and a checkpoint written, twice.
    for view in 0..6 {
        let frame = page.still(&json!({ "view": view }), &["tinted", "depth"]);
        assert_eq!((u64::from(frame.step), frame.exact), (step, true));
    }
    page.edit(&json!({ "edit": "merge", "labels": [1, 2] }));
    assert!(page.hear("problem")["text"].to_string().contains("while training is running"));
    for _ in 0..2 {
        page.send(&json!({ "kind": "train", "what": "save" }));
        std::thread::sleep(Duration::from_millis(150));
    }
    page.until("notice", |notice| notice["text"].as_str().is_some_and(|text| text.contains("checkpoint")));
    page.forget();
    assert_eq!(u64::from(page.still(&json!({ "view": 0 }), &["colour"]).step), step);
    page.send(&json!({ "kind": "train", "what": "resume" }));
    // Moving pictures until the end.
    let mut last = 0;
    loop {
        page.ask(&json!({ "view": last % 6 }), &["colour", "labels"], true);
        let Some(frame) = page.frame_within(Duration::from_secs(20)) else { break };
        page.ack(frame.seq);
        last = frame.step;
        if last >= 110 {
            break;
        }
    }
    assert!(u64::from(last) > step, "{last} after {step}");
    let over = page.hear("over");
    assert_eq!((&over["stopped"], &over["steps"]), (&json!(false), &json!(120)));
    assert!(server.child.wait().expect("it ends").success());
    let model =
        |run: &str| std::fs::read(place.path(run).join("point_cloud/iteration_120/point_cloud.ply")).expect("a model");
    assert!(model("alone") == model("watched"), "watching changed the model");
    assert_eq!(history(&place.path("alone")), history(&place.path("watched")));
}

#[test]
fn a_training_can_be_stopped_from_the_page() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let mut server = Server::train(train(&place, "out", &["--iterations", "100000", "--view"]));
    let mut page = server.page();
    page.until("training", |state| state["step"].as_u64() > Some(3));
    page.until("curve", |curve| curve["steps"].as_array().is_some_and(|steps| steps.len() > 1));
    page.send(&json!({ "kind": "train", "what": "stop" }));
    let over = page.hear("over");
    assert_eq!(over["stopped"], true);
    let command = over["command"].as_str().expect("a command");
    assert!(
        command.starts_with("labelgs view out/point_cloud/") && command.contains("--masks scene/masks"),
        "{command}"
    );
    assert!(server.child.wait().expect("it ends").success());
}
