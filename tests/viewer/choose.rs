//! Gaussians chosen by hand: by what is drawn over a picture, by places, by what is alike; and what becomes of them.

use super::browser::SETTLED;
use super::chromium::{Browser, Tab};
use super::protocol::{has, same_by_command};
use super::server::{Page, Place, Server};
use crate::support::device;
use glam::DVec3;
use labelgs::formats::read_model;
use serde_json::{Value, json};

/// Chooses, and returns how many are chosen then.
fn choose(page: &mut Page, what: &Value) -> u64 {
    page.forget();
    page.send(&json!({ "kind": "choose", "what": what }));
    // Something that is always answered follows, for choices that change no number.
    page.pick(&json!({ "view": 0 }), [0, 0]);
    page.newest("chosen")
        .map_or_else(|| panic!("nothing was said of {what}"), |chosen| chosen["count"].as_u64().expect("a count"))
}

fn draw(points: &Value, radius: f64, through: bool, how: &str) -> Value {
    let shape = if radius > 0.0 { "along" } else { "inside" };
    let region = json!({ "shape": shape, "points": points, "radius": radius });
    json!({ "select": "draw", "from": { "view": 0 }, "region": region, "through": through, "how": how })
}

#[test]
fn choices_join_and_become_labels() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let server = place.view(&[]);
    let mut page = server.page();
    page.hear("labels");
    let all = read_model(place.path("model.ply")).expect("a model").gaussians.len() as u64;
    let whole = json!([[0, 0], [64, 0], [64, 48], [0, 48]]);
    let left = json!([[0, 0], [32, 0], [32, 48], [0, 48]]);

    // Seen is less than through, and both halves together are the whole.
    let through = choose(&mut page, &draw(&whole, 0.0, true, "replace"));
    let seen = choose(&mut page, &draw(&whole, 0.0, false, "replace"));
    assert!(0 < seen && seen < through && through <= all, "{seen} {through} {all}");
    let one = choose(&mut page, &draw(&left, 0.0, true, "replace"));
    let other = choose(&mut page, &draw(&json!([[32, 0], [64, 0], [64, 48], [32, 48]]), 0.0, true, "replace"));
    assert_eq!(one + other, through);
    assert_eq!(choose(&mut page, &draw(&left, 0.0, true, "add")), through);
    assert_eq!(choose(&mut page, &draw(&left, 0.0, true, "take")), other);
    assert_eq!(choose(&mut page, &draw(&left, 0.0, true, "within")), 0);
    let brushed = choose(&mut page, &draw(&json!([[10, 24], [50, 24]]), 3.0, true, "replace"));
    assert!(0 < brushed && brushed < through);

    // Labels, what is hidden, what is locked; grown, shrunk, all others.
    let of_one = choose(&mut page, &json!({ "select": "labels", "labels": [1], "how": "replace" }));
    assert_eq!(choose(&mut page, &json!({ "select": "invert" })), all - of_one);
    page.send(&json!({ "kind": "show", "hidden": [1], "solo": [] }));
    assert_eq!(choose(&mut page, &json!({ "select": "labels", "labels": [1], "how": "replace" })), 0);
    page.send(&json!({ "kind": "show", "hidden": [], "solo": [] }));
    choose(&mut page, &json!({ "select": "labels", "labels": [1], "how": "replace" }));
    assert_eq!(choose(&mut page, &json!({ "select": "lock" })), 0);
    assert_eq!(
        choose(&mut page, &json!({ "select": "labels", "labels": [1, 2], "how": "replace" })) + of_one,
        choose_unlocked(&mut page)
    );
    choose(&mut page, &draw(&left, 0.0, true, "replace"));
    let more = choose(&mut page, &json!({ "select": "grow" }));
    assert!(more > one, "{more}");
    assert!(choose(&mut page, &json!({ "select": "shrink" })) < more);

    // A ball, a flood and a depth around what is at a pixel.
    let pixel = (0..48)
        .map(|y| [32, 47 - y])
        .find(|&pixel| page.pick(&json!({ "view": 0 }), pixel)["opacity"].as_f64() > Some(0.9));
    let at = json!({ "from": { "view": 0 }, "pixel": pixel.expect("something"), "how": "replace" });
    let with = |more: Value| {
        let mut what = at.clone();
        what.as_object_mut().expect("fields").extend(more.as_object().expect("fields").clone());
        what
    };
    let small = choose(&mut page, &with(json!({ "select": "ball", "radius": 6.0 })));
    let large = choose(&mut page, &with(json!({ "select": "ball", "radius": 20.0 })));
    assert!(large > small, "{small} {large}");
    let alike = choose(&mut page, &with(json!({ "select": "flood", "tolerance": 0.1 })));
    let any = choose(&mut page, &with(json!({ "select": "flood", "tolerance": 1.0 })));
    assert!(0 < alike && alike <= any && any <= all, "{alike} {any}");
    let front = choose(&mut page, &with(json!({ "select": "depth", "side": "front" })));
    let behind = choose(&mut page, &with(json!({ "select": "depth", "side": "behind" })));
    assert!(front + behind <= all && behind > 0, "{front} {behind}");

    // Strokes on it and on what is not it.
    let pixel = pixel.expect("something");
    let stroke = |points: &Value, on: bool| json!({ "select": "stroke", "from": { "view": 0 }, "points": points, "radius": 1.0, "on": on });
    choose(&mut page, &json!({ "select": "nothing" }));
    let alone = choose(&mut page, &stroke(&json!([pixel]), true));
    let row = page.pick(&json!({ "view": 0 }), pixel)["gaussian"].as_u64();
    assert!((1..=9).contains(&alone) && row.is_some(), "what a point hits: {alone}");
    let mut rest = (0..3072_u32).map(|at| [at * 37 % 64, at * 29 % 48]);
    let other = rest.find(|&at| {
        let gaussian = page.pick(&json!({ "view": 0 }), at)["gaussian"].as_u64();
        gaussian.is_some() && gaussian != row && at[0].abs_diff(pixel[0]) > 12
    });
    page.send(&json!({ "kind": "choose", "what": stroke(&json!([other.expect("something else")]), false) }));
    page.pick(&json!({ "view": 0 }), pixel);
    // The same number is not told twice, but to every new page.
    let cut = server.page().hear("chosen")["count"].as_u64().expect("a count");
    assert!(cut > 0 && cut < all, "the object without what is not it: {cut}");

    // What is chosen is drawn in a colour of its own, and becomes a label; the list makes the same bytes.
    page.send(&json!({ "kind": "choose", "what": { "select": "nothing" } }));
    let plain = page.still(&json!({ "view": 0 }), &["colour"]).pictures.remove(0);
    choose(&mut page, &draw(&left, 0.0, true, "replace"));
    assert_ne!(page.still(&json!({ "view": 0 }), &["colour"]).pictures[0], plain);
    page.edit(&json!({ "edit": "assign", "label": null, "name": "left half" }));
    page.until("edits", |edits| has(edits, 1, false));
    page.until("labels", |labels| {
        let row =
            labels["rows"].as_array().and_then(|rows| rows.iter().find(|row| row["name"] == "left half").cloned());
        row.is_some_and(|row| row["id"] == 5 && row["count"] == one)
    });
    let frame = page.still(&json!({ "view": 0 }), &["colour"]);
    assert_eq!(frame.pictures[0], plain, "nothing is chosen after a change");
    let map = &frame.pictures[1];
    assert!(map.values.chunks(3).all(|id| id[1] == 0 && id[2] == 0) && map.values.chunks(3).any(|id| id[0] == 5));
    choose(&mut page, &json!({ "select": "labels", "labels": [5], "how": "replace" }));
    page.edit(&json!({ "edit": "duplicate", "shift": [0.0, 0.0, 1.0], "name": "copy" }));
    page.until("edits", |edits| has(edits, 2, false));
    choose(&mut page, &json!({ "select": "labels", "labels": [2], "how": "replace" }));
    page.edit(&json!({ "edit": "delete" }));
    page.until("edits", |edits| has(edits, 3, false));
    page.edit(&json!({ "edit": "keep" }));
    assert!(page.hear("problem")["text"].to_string().contains("no Gaussian is chosen"));
    page.send(&json!({ "kind": "write" }));
    let done = page.until("edits", |edits| has(edits, 3, true));
    same_by_command(&place, done["command"].as_str().expect("a command"), "model-edits/001");

    // Nothing is here, no such pixel, no picture of that size.
    for (what, word) in [
        (json!({ "select": "ball", "from": { "view": 0 }, "pixel": [99, 0], "radius": 1.0, "how": "add" }), "outside"),
        (
            json!({ "select": "flood", "from": { "view": 9 }, "pixel": [9, 9], "tolerance": 1.0, "how": "add" }),
            "no view 9",
        ),
    ] {
        page.send(&json!({ "kind": "choose", "what": what }));
        let problem = page.hear("problem")["text"].to_string();
        assert!(problem.contains(word), "{what}: {problem}");
    }
}

/// Unlocks everything and returns the number of Gaussians of labels 1 and 2.
fn choose_unlocked(page: &mut Page) -> u64 {
    choose(page, &json!({ "select": "unlock" }));
    choose(page, &json!({ "select": "labels", "labels": [1, 2], "how": "replace" }))
}

#[test]
fn exports_have_names_and_can_be_fetched() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let server = place.view(&[]);
    let cookie = server.cookie();
    let mut page = server.page();
    let scene = page.hear("scene");
    assert!(scene["formats"].as_array().is_some_and(|all| all.contains(&json!(["PLY", ".ply"]))), "{scene}");
    place.succeeds(&["extract", "model.ply", "--labels", "3", "-o", "tea.ply"]);
    let read = |name: &str| read_model(place.path(name)).expect("a model");
    let up = DVec3::from_array([0, 1, 2].map(|axis| scene["up"][axis].as_f64().expect("a number")));
    let export = |labels: &[u32], name: &str, format: &str| json!({ "kind": "export", "what": { "labels": labels, "name": name, "format": format } });
    for (number, file) in ["tea box.ply", "tea box 2.ply"].into_iter().enumerate() {
        page.send(&export(&[3], "tea box", ".ply"));
        assert_eq!(page.hear("exported"), json!({ "kind": "exported", "file": number, "name": file }));
        let made = read(&format!("model-edits/{file}"));
        assert_eq!(made.gaussians, read("tea.ply").gaussians);
        assert!(made.first_view.is_some_and(|view| view.up.distance(up) < 1e-9), "{:?}", made.first_view);
    }
    for format in scene["formats"].as_array().expect("formats") {
        page.send(&export(&[], "all", format[1].as_str().expect("an ending")));
        page.hear("exported");
    }
    assert_eq!(read("model-edits/all.ply").gaussians, read("model.ply").gaussians);
    let fetched = server.get("/export/1", &[("Cookie", &cookie)]);
    assert!(fetched.starts_with("HTTP/1.1 200") && fetched.contains("filename*=UTF-8''%74%65%61"), "{fetched}");
    assert!(server.get("/export/99", &[("Cookie", &cookie)]).starts_with("HTTP/1.1 404"));
    assert!(server.get("/export/1", &[]).starts_with("HTTP/1.1 401"));
    for (name, format) in
        [("../x", ".ply"), ("", ".ply"), (".x", ".ply"), ("a/b", ".ply"), ("x", ".exe"), ("x", "/../y.ply")]
    {
        page.send(&export(&[3], name, format));
        page.hear("problem");
    }
    page.send(&json!({ "kind": "export", "what": { "labels": [], "chosen": true, "name": "x", "format": ".ply" } }));
    assert!(page.hear("problem")["text"].to_string().contains("no Gaussians are selected"));
}

/// A model that is dropped on the page takes the place of the one before, whose changes are saved.
#[test]
fn a_dropped_model_is_opened() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    place.succeeds(&["extract", "model.ply", "--labels", "3", "-o", "tea.spz"]);
    let bytes = std::fs::read(place.path("tea.spz")).expect("a file");
    let server = place.view(&[]);
    let cookie = server.cookie();
    let mut page = server.page();
    page.hear("labels");
    page.edit(&json!({ "edit": "rename", "label": 1, "name": "mug" }));
    page.until("edits", |edits| has(edits, 1, false));
    let post = |name: &str, length: usize, origin: &str, cookie: &str, body: &[u8]| {
        let head = format!(
            "POST /open?name={name} HTTP/1.1\r\nHost: {}\r\nOrigin: {origin}\r\nCookie: {cookie}\r\nContent-Length: {length}\r\n\r\n",
            server.host()
        );
        server.raw(&[head.as_bytes(), body].concat())
    };
    let own = format!("http://{}", server.host());
    let length = bytes.len();
    for (answer, status) in [
        (post("tea.spz", length, &own, "labelgs=0", &bytes), "401"),
        (post("tea.spz", length, "http://evil.test", &cookie, &bytes), "403"),
        (post("../tea.spz", length, &own, &cookie, &bytes), "400"),
        (post("tea.exe", length, &own, &cookie, &bytes), "400"),
        (post("tea.spz", usize::MAX, &own, &cookie, &bytes), "400"),
        (post("tea.spz", length, &own, &cookie, &bytes), "200"),
    ] {
        assert_eq!(answer.split(' ').nth(1), Some(status), "{answer}");
    }
    let scene = page.until("scene", |scene| {
        scene["title"].as_str().is_some_and(|title| title.ends_with("model-edits/opened/tea.spz"))
    });
    assert_eq!(scene["views"].as_array().map(Vec::len), Some(6), "the views stay");
    page.until("labels", |labels| {
        labels["rows"].as_array().is_some_and(|rows| rows.len() == 1 && rows[0]["name"] == "box of tea")
    });
    assert!(std::fs::read_to_string(place.path("model-edits/001.labels.json")).expect("saved").contains("mug"));
    // What is no model is told, and the shown one stays.
    assert!(post("bad.ply", 4, &own, &cookie, b"none").starts_with("HTTP/1.1 200"));
    assert!(page.until("problem", |_| true)["text"].to_string().contains("bad.ply"));
    page.edit(&json!({ "edit": "rename", "label": 3, "name": "tin" }));
    page.until("edits", |edits| has(edits, 1, false));
}

#[test]
fn an_object_of_its_own_stands_upright_and_is_seen_from_its_front() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    let scene_of = |words: &[&str]| Server::start(place.command(&[&["view"], words].concat())).page().hear("scene");
    let vector = |value: &Value| DVec3::from_array([0, 1, 2].map(|axis| value[axis].as_f64().expect("a number")));
    let server = place.view(&[]);
    let mut page = server.page();
    let up = vector(&page.hear("scene")["up"]);
    page.send(&json!({ "kind": "export", "what": { "labels": [3], "name": "tea", "format": ".ply" } }));
    page.hear("exported");
    let alone = scene_of(&["model-edits/tea.ply"]);
    assert!(vector(&alone["up"]).distance(up) < 1e-9, "{alone}");
    let view = read_model(place.path("model-edits/tea.ply")).expect("a model").first_view.expect("a view");
    assert!(vector(&alone["from"]).distance(view.eye - vector(&alone["target"])) < 1e-9, "{alone}");
    // The whole without its views has no first view, and lies on its ground.
    let bare = scene_of(&["model.ply"]);
    assert!(bare["from"].is_null() && vector(&bare["up"]).length() > 0.999, "{bare}");
}

/// The tools by their keys and the mouse.
pub fn tools_choose_gaussians(browser: &mut Browser, tab: &Tab, place: &Place) {
    browser.click_on(tab, "#view-list li:nth-child(1) button");
    browser.until(tab, SETTLED);
    // A click is answered by the picture that is there.
    browser.js(tab, "window.asked = 0, window.send = labelgs.link.send.bind(labelgs.link), labelgs.link.send = (m) => { if (m.kind === 'pick') window.asked += 1; return window.send(m); }");
    let spot = browser.js(
        tab,
        "(() => { const s = labelgs.stage, a = s.area(0), b = s.box.getBoundingClientRect(), at = s.map.ids.findIndex((id) => id === 3); \
         return [b.x + a.x + (at % s.map.width + .5) * a.width / s.map.width, b.y + a.y + (Math.floor(at / s.map.width) + .5) * a.height / s.map.height]; })()",
    );
    let at = (spot[0].as_f64().expect("x"), spot[1].as_f64().expect("y"));
    browser.click(tab, at, 0);
    browser.until(tab, "labelgs.labels.selected.has(3) && labelgs.stage.overlay");
    assert_eq!(browser.js(tab, "window.asked"), 0, "requests of a click");
    browser.js(tab, "labelgs.link.send = window.send");
    browser.key(tab, "KeyG", "g", 0);
    browser.until(tab, "labelgs.selecting.state.count === labelgs.labels.row(3).count");
    browser.key(tab, "Escape", "Escape", 0);
    browser.until(tab, "labelgs.selecting.state.count === 0");
    let stage = browser.js(tab, "(() => { const b = labelgs.stage.box.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()");
    let middle = (stage[0].as_f64().expect("x"), stage[1].as_f64().expect("y"));
    for (code, key, tool) in
        [("KeyR", "r", "box"), ("KeyT", "t", "lasso"), ("KeyB", "b", "brush"), ("KeyN", "n", "ball")]
    {
        browser.key(tab, code, key, 0);
        browser.until(tab, &format!("labelgs.selecting.tool === '{tool}'"));
        browser.drag(tab, (middle.0 - 90.0, middle.1 - 60.0), (middle.0 + 90.0, middle.1 + 80.0));
        if tool != "lasso" {
            browser.until(tab, "labelgs.selecting.state.count > 0 && !document.querySelector('#chosen').hidden");
        }
        assert_eq!(browser.js(tab, "labelgs.rig.view"), 0, "{tool} does not turn the camera");
        browser.key(tab, "Escape", "Escape", 0);
        browser.until(tab, "labelgs.selecting.state.count === 0");
    }
    for (code, key, tool) in [("KeyU", "u", "flood"), ("KeyY", "y", "depth"), ("KeyZ", "z", "strokes")] {
        browser.key(tab, code, key, 0);
        browser.until(tab, &format!("labelgs.selecting.tool === '{tool}'"));
        if tool == "depth" {
            // As a right click does.
            let (x, y) = at;
            browser.js(tab, &format!("(() => {{ const b = labelgs.stage.box.getBoundingClientRect(); labelgs.selecting.click([{x} - b.x, {y} - b.y], false, null); }})()"));
        } else {
            browser.click(tab, at, 0);
        }
        browser.until(tab, "labelgs.selecting.state.count > 0");
        assert_eq!(browser.js(tab, "labelgs.rig.view"), 0, "{tool} does not turn the camera");
        browser.key(tab, "Escape", "Escape", 0);
        browser.until(tab, "labelgs.selecting.state.count === 0");
    }
    // A name and Enter make a label; the keyboard gives it up again.
    browser.key(tab, "KeyR", "r", 0);
    browser.drag(tab, (middle.0 - 90.0, middle.1 - 60.0), (middle.0 + 90.0, middle.1 + 80.0));
    browser.until(tab, "labelgs.selecting.state.count > 0");
    browser.js(tab, "document.querySelector('#chosen-name').focus()");
    browser.write(tab, "by hand");
    browser.key(tab, "Enter", "Enter", 0);
    browser.until(tab, "labelgs.labels.rows.some((row) => row.name === 'by hand')");
    browser.click_on(tab, "#edit-undo");
    browser.until(tab, "labelgs.edits.state.changes.length === 0 && labelgs.edits.state.redo === 1");
    browser.click_on(tab, "#edit-redo");
    browser.until(tab, "labelgs.edits.state.changes.length === 1");
    browser.click_on(tab, "#edit-undo");
    browser.until(tab, "labelgs.edits.state.changes.length === 0");
    browser.key(tab, "Escape", "Escape", 0);
    browser.until(tab, "!labelgs.selecting.isOn");
    // Pictures of the labels come by themselves.
    browser.until(tab, "document.querySelectorAll('#label-list .swatch img').length >= 3 && [...document.querySelectorAll('#label-list .swatch img')].every((image) => !image.complete || image.naturalWidth > 0)");
    // Distances between two points.
    browser.key(tab, "KeyJ", "j", 0);
    browser.click(tab, at, 0);
    browser.until(tab, "labelgs.measuring.points.length === 1");
    let ground = (middle.0, middle.1 + 60.0);
    browser.click(tab, ground, 0);
    browser.until(
        tab,
        "labelgs.measuring.distance > 0 && document.querySelector('#measure').textContent.includes('units')",
    );
    browser.key(tab, "KeyJ", "j", 0);
    // A way of the camera.
    browser.click_on(tab, "#camera-menu summary");
    browser.click_on(tab, "#path-add");
    browser.js(tab, "labelgs.rig.orbit(0.4, 0, false), labelgs.stage.change(true)");
    browser.click_on(tab, "#path-add");
    browser.until(tab, "labelgs.path.frames.length === 2 && !document.querySelector('#path-play').disabled");
    browser.click_on(tab, "#path-play");
    browser.until(tab, "labelgs.path.playing === null");
    browser.js(tab, "labelgs.path.take(0), labelgs.path.take(0), document.querySelector('#camera-menu').open = false");
    // A file by its name.
    browser.key(tab, "KeyE", "e", 2);
    browser.until(tab, "document.querySelector('#export').open");
    browser.js(tab, "document.querySelector('#export-name').value = 'from the page'");
    browser.click_on(tab, "#export button[value=yes]");
    browser.until(tab, "!document.querySelector('#export').open");
    let file = place.path("model-edits/from the page.ply");
    let end = std::time::Instant::now() + super::server::PATIENCE;
    while !file.exists() {
        assert!(std::time::Instant::now() < end, "no file");
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    browser.until(tab, SETTLED);
}
