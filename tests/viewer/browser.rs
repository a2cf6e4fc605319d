//! The page in a browser, driven by mouse and keys. One browser and one small model serve all of it.

use super::chromium::{Browser, Tab};
use super::server::{HOSTILE, Picture, Place, Server, model};
use super::{choose, events, object, page_file};
use crate::support::device;
use labelgs::formats::write_model;
use labelgs::scenes::LoadOptions;
use labelgs::scenes::camera_json::write_cameras;
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};
use serde_json::Value;
use std::time::Duration;

pub const WIDE: (u32, u32) = (1280, 800);

/// The picture of the still camera is there.
pub const SETTLED: &str = "window.labelgs?.stage.frame?.exact && labelgs.stage.asked === null && labelgs.stage.isStill \
                       && !labelgs.stage.isDirty";

#[test]
fn the_page_works_in_a_browser() {
    if device().is_none() {
        return;
    }
    let Some(mut browser) = Browser::start() else { return };
    let place = Place::new();
    place.succeeds(&["render", "model.ply", "--scene", "scene", "--views", "all", "--what", "rgb,labels", "-o", "all"]);
    place.succeeds(&["render", "model.ply", "--scene", "scene", "--views", "000", "--without", "3", "-o", "without"]);
    let server = place.view(&[]);
    let tab = browser.open(&server.address, WIDE);
    browser.until(&tab, SETTLED);
    assert_eq!(browser.js(&tab, "location.search"), "", "the token has left the address");
    let size = browser.js(&tab, "[labelgs.stage.frame.width, labelgs.stage.frame.height]");
    assert!(size[0].as_u64().is_some_and(|width| width > 300), "a view is drawn as large as the stage: {size}");
    browser.js(&tab, "document.querySelector('#photo-pixels').click()");
    browser.until(&tab, &format!("labelgs.stage.frame.width === 64 && {SETTLED}"));
    views_are_their_renders(&mut browser, &tab, &place);
    clicks_choose_labels(&mut browser, &tab, &place);
    eyes_hide(&mut browser, &tab, &place);
    cameras_stay_rotations(&mut browser, &tab);
    edits_and_names(&mut browser, &tab, &place);
    choose::tools_choose_gaussians(&mut browser, &tab, &place);
    photos_are_compared(&mut browser, &tab);
    the_keyboard_is_enough(&mut browser, &tab);
    narrow_windows_hold_everything(&mut browser, &tab);
    two_tabs_and_a_killed_one(&mut browser, &tab, &server);
    events::random_events(&mut browser, &tab, &server);
    browser.kill(&tab);
    drop(server);
    page_file::a_page_shows_its_model(&mut browser, &place);
    assert_eq!(browser.complaints, Vec::<String>::new(), "complaints on the console");
    a_run_without_its_scene(&mut browser, &place);
    many_labels_and_none(&mut browser, &place);
    a_server_goes_away_and_comes_back(&mut browser, &place);
    a_training_in_the_page(&mut browser, &place);
    a_report_tells_the_values_of_the_step(&mut browser, &place);
    object::a_click_finds_an_object(&mut browser, &place);
}

/// The pixels of the last frame.
fn pixels(browser: &mut Browser, tab: &Tab) -> Picture {
    browser.until(tab, SETTLED);
    let found = browser.js(
        tab,
        "(() => { const [image] = labelgs.stage.images, { width, height } = image; \
         const context = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true }); \
         context.drawImage(image, 0, 0); \
         const { data } = context.getImageData(0, 0, width, height); \
         return [width, height, [...data].filter((_, i) => i % 4 < 3)]; })()",
    );
    let number = |value: &Value| u32::try_from(value.as_u64().expect("a number")).expect("a small one");
    let values = found[2].as_array().expect("bytes").iter().map(|value| number(value) as u16).collect();
    Picture { size: (number(&found[0]), number(&found[1])), values }
}

fn views_are_their_renders(browser: &mut Browser, tab: &Tab, place: &Place) {
    for view in 0..6 {
        browser.click_on(tab, &format!("#view-list li:nth-child({}) button", view + 1));
        browser.until(tab, &format!("labelgs.rig.view === {view}"));
        assert_eq!(pixels(browser, tab), place.picture(&format!("all/{view:03}.rgb.png")), "view {view}");
    }
    browser.key(tab, "Digit2", "2", 0);
    browser.until(tab, "labelgs.stage.panes[0] === 'labels'");
    assert_eq!(pixels(browser, tab), place.picture("all/005.labels-colour.png"));
    browser.key(tab, "Digit1", "1", 0);
    browser.key(tab, "BracketRight", "]", 0);
    browser.until(tab, "labelgs.rig.view === 0");
    browser.until(tab, "document.querySelector('#view-list .facts').textContent.includes('dB')");
}

fn clicks_choose_labels(browser: &mut Browser, tab: &Tab, place: &Place) {
    let ids = place.picture("all/000.labels.png");
    let mut found = std::collections::BTreeSet::new();
    for n in 0..50_u32 {
        let [x, y] = [n * 37 % 64, n * 29 % 48];
        let at = browser.js(
            tab,
            &format!(
                "(() => {{ const s = labelgs.stage, a = s.area(0), b = s.box.getBoundingClientRect(); \
                 const at = [b.x + a.x + ({x} + .5) * a.width / 64, b.y + a.y + ({y} + .5) * a.height / 48]; \
                 return document.elementFromPoint(...at).closest('.palette') ? null : at; }})()"
            ),
        );
        // A tool lies over this pixel.
        if at.is_null() {
            continue;
        }
        browser.click(tab, (at[0].as_f64().expect("x"), at[1].as_f64().expect("y")), 0);
        let id = ids.values[(y * 64 + x) as usize];
        let expected = if id == 0 { "[]".to_owned() } else { format!("[{id}]") };
        browser.until(tab, &format!("JSON.stringify([...labelgs.labels.selected]) === '{expected}'"));
        found.insert(id);
    }
    assert!(found.len() >= 3, "{found:?}");
    browser.key(tab, "Escape", "Escape", 0);
    browser.until(tab, "labelgs.labels.selected.size === 0");
}

fn eyes_hide(browser: &mut Browser, tab: &Tab, place: &Place) {
    browser.click_on(tab, "li[data-id='3'] .eye");
    browser.until(tab, "labelgs.labels.hidden.includes(3)");
    assert_eq!(pixels(browser, tab), place.picture("without/000.rgb.png"));
    browser.click_on(tab, "#label-all");
    browser.until(tab, "labelgs.labels.hidden.length === 0");
    assert_eq!(pixels(browser, tab), place.picture("all/000.rgb.png"));
}

fn cameras_stay_rotations(browser: &mut Browser, tab: &Tab) {
    let mut dice = SmallRng::seed_from_u64(7);
    for round in 0..12 {
        let mut at = || (dice.random_range(420.0..860.0), dice.random_range(200.0..600.0));
        let (from, to) = (at(), at());
        browser.drag(tab, from, to);
        if round % 4 == 3 {
            browser.key(tab, "KeyV", "v", 0);
        }
    }
    let worst = browser.js(
        tab,
        "(() => { const r = labelgs.rig.file().w2c.slice(0, 3).map((row) => row.slice(0, 3)); \
         const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; let worst = 0; \
         for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) worst = Math.max(worst, Math.abs(dot(r[i], r[j]) - (i === j))); \
         const det = dot(r[0], [r[1][1] * r[2][2] - r[1][2] * r[2][1], r[1][2] * r[2][0] - r[1][0] * r[2][2], r[1][0] * r[2][1] - r[1][1] * r[2][0]]); \
         return Math.max(worst, Math.abs(det - 1)); })()",
    );
    assert!(worst.as_f64().expect("a number") < 1e-12, "{worst}");
    browser.until(tab, SETTLED);
    let size = browser.js(tab, "[labelgs.stage.frame.width, labelgs.stage.frame.height, ...labelgs.rig.size]");
    assert_eq!((&size[0], &size[1]), (&size[2], &size[3]), "the still picture has every pixel of the stage");
}

fn edits_and_names(browser: &mut Browser, tab: &Tab, place: &Place) {
    assert_eq!(browser.js(tab, "document.querySelector('li[data-id=\"2\"] .name').textContent"), HOSTILE);
    // Rename in place, merge with another, take both back.
    browser.click_on(tab, "li[data-id='1'] .name");
    browser.key(tab, "F2", "F2", 0);
    browser.until(tab, "document.activeElement.matches('li.label input')");
    browser.write(tab, "<b onclick=alert(1)>mug</b>");
    browser.key(tab, "Enter", "Enter", 0);
    browser.until(tab, "labelgs.labels.row(1).name === '<b onclick=alert(1)>mug</b>'");
    browser.js(tab, "labelgs.labels.select([1, 4])");
    browser.click_on(tab, "#act-merge");
    browser.until(tab, "labelgs.edits.state.changes.length === 2");
    browser.click_on(tab, "#edit-save");
    browser.until(tab, "labelgs.edits.state.saved");
    let shown = browser.js(tab, "[...document.querySelectorAll('#edit-list li')].map((item) => item.textContent)");
    assert!(
        shown
            == serde_json::json!([
                "Renamed cup to <b onclick=alert(1)>mug</b>",
                "Merged <b onclick=alert(1)>mug</b>, label 4"
            ]),
        "{shown}"
    );
    place.succeeds(&[
        "merge",
        "model.ply",
        "--labels",
        "1",
        "--name",
        "<b onclick=alert(1)>mug</b>",
        "-o",
        "named.ply",
    ]);
    place.succeeds(&["merge", "named.ply", "--labels", "1,4", "-o", "merged.ply"]);
    let read = |name: &str| std::fs::read(place.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(read("model-edits/001.ply"), read("merged.ply"));
    assert_eq!(read("model-edits/001.labels.json"), read("merged.labels.json"));
    for left in [1, 0] {
        browser.key(tab, "KeyZ", "z", 2);
        browser.until(tab, &format!("labelgs.edits.state.changes.length === {left}"));
    }
    browser.until(tab, "labelgs.labels.row(1).name === 'cup' && labelgs.labels.row(4)");
    let made =
        browser.js(tab, "[document.querySelectorAll('#label-list img:not([src^=\"/label/\"]), #edit-list b').length, window.hacked ?? null]");
    assert_eq!(made, serde_json::json!([0, null]), "names are text");
    // Search and sort.
    browser.js(tab, "(() => { const s = document.querySelector('#label-search'); s.value = 'tea'; s.dispatchEvent(new Event('input')); })()");
    assert_eq!(
        browser.js(tab, "[...document.querySelectorAll('li.label')].map((row) => row.dataset.id)"),
        serde_json::json!(["3"])
    );
    browser.js(tab, "(() => { const s = document.querySelector('#label-search'); s.value = ''; s.dispatchEvent(new Event('input')); })()");
}

fn photos_are_compared(browser: &mut Browser, tab: &Tab) {
    browser.click_on(tab, "#view-list li:nth-child(1) button");
    browser.until(tab, SETTLED);
    browser.click_on(tab, "#photo-wipe");
    browser.until(tab, "!document.querySelector('#wipe').hidden && labelgs.stage.photos.has(0)");
    let before = browser.js(tab, "labelgs.stage.wipeAt");
    let bar = browser.js(tab, "(() => { const b = document.querySelector('#wipe').getBoundingClientRect(); return [b.x + b.width / 2, b.y + 40]; })()");
    let at = (bar[0].as_f64().expect("x"), bar[1].as_f64().expect("y"));
    browser.drag(tab, at, (at.0 + 120.0, at.1));
    assert_ne!(browser.js(tab, "labelgs.stage.wipeAt"), before);
    assert_eq!(browser.js(tab, "labelgs.rig.view"), 0, "the bar does not turn the camera");
    browser.click_on(tab, "#photo-error");
    browser.until(tab, SETTLED);
    browser.until(tab, "document.querySelector('#tag-a').textContent.startsWith('Error')");
    browser.click_on(tab, "#photo-off");
    browser.click_on(tab, "#layout-pair");
    browser.until(tab, SETTLED);
    browser.until(tab, "labelgs.stage.images.length === 2");
    browser.click_on(tab, "#layout-one");
    browser.until(tab, SETTLED);
}

fn the_keyboard_is_enough(browser: &mut Browser, tab: &Tab) {
    // Tab reaches every part of the page, and the focus is seen.
    browser.js(tab, "document.activeElement.blur()");
    let mut reached = std::collections::BTreeSet::new();
    for _ in 0..60 {
        browser.key(tab, "Tab", "Tab", 0);
        let at = browser.js(
            tab,
            "(() => { const e = document.activeElement; return e.id || e.closest('ul')?.id || e.className; })()",
        );
        reached.insert(at.as_str().unwrap_or_default().to_owned());
    }
    for id in [
        "pane-more",
        "layout-one",
        "act-export",
        "help-open",
        "label-search",
        "label-list",
        "stage",
        "views-all",
        "view-list",
    ] {
        assert!(reached.contains(id), "Tab does not reach {id}: {reached:?}");
    }
    // Arrows in the list, a name by F2, and the camera by keys.
    browser.js(tab, "document.querySelector('li[data-id=\"1\"]').focus()");
    browser.key(tab, "ArrowDown", "ArrowDown", 0);
    browser.key(tab, "Enter", "Enter", 0);
    assert_eq!(browser.js(tab, "[...labelgs.labels.selected]"), serde_json::json!([2]));
    browser.js(tab, "document.querySelector('#stage').focus()");
    browser.key(tab, "KeyF", "f", 0);
    browser.until(tab, "labelgs.rig.view === null");
    browser.until(tab, SETTLED);
    let before = browser.js(tab, "JSON.stringify(labelgs.rig.file())");
    browser.call(
        Some(tab),
        "Input.dispatchKeyEvent",
        serde_json::json!({ "type": "keyDown", "code": "KeyW", "key": "w" }),
    );
    let before = before.as_str().expect("a camera");
    browser.until(tab, &format!("JSON.stringify(labelgs.rig.file()) !== '{before}'"));
    browser.call(
        Some(tab),
        "Input.dispatchKeyEvent",
        serde_json::json!({ "type": "keyUp", "code": "KeyW", "key": "w" }),
    );
    browser.key(tab, "Slash", "?", 8);
    browser.until(tab, "document.querySelector('#help').open");
    browser.key(tab, "Escape", "Escape", 0);
    browser.until(tab, "!document.querySelector('#help').open");
    browser.key(tab, "KeyF", "F", 8);
    browser.until(tab, "labelgs.rig.view === 0");
    browser.key(tab, "Escape", "Escape", 0);
}

fn narrow_windows_hold_everything(browser: &mut Browser, tab: &Tab) {
    browser.resize(tab, (390, 780));
    for part in ["labels", "views", "stage"] {
        browser.click_on(tab, &format!("#tab-{part}"));
        let seen = browser.js(
            tab,
            "(() => { const wide = document.documentElement.scrollWidth; \
             const out = [...document.querySelectorAll('button, select, input')].filter((e) => e.checkVisibility() && \
             e.getBoundingClientRect().right > innerWidth + 1 && !e.closest('dialog')); return [wide, out.map((e) => e.id || e.textContent)]; })()",
        );
        assert_eq!(seen, serde_json::json!([390, []]), "{part}");
    }
    browser.until(tab, SETTLED);
    browser.resize(tab, WIDE);
    browser.until(tab, SETTLED);
}

fn two_tabs_and_a_killed_one(browser: &mut Browser, tab: &Tab, server: &Server) {
    let other = browser.open(&server.address, (900, 600));
    browser.until(&other, SETTLED);
    browser.js(&other, "labelgs.link.send({ kind: 'edit', what: { edit: 'rename', label: 4, name: 'by the other' } })");
    browser.until(tab, "labelgs.labels.row(4).name === 'by the other'");
    // It goes while frames are on the way.
    browser.drag(&other, (300.0, 200.0), (500.0, 300.0));
    browser.kill(&other);
    browser.drag(tab, (500.0, 300.0), (600.0, 340.0));
    browser.until(tab, SETTLED);
    browser.js(tab, "labelgs.edits.undo()");
    browser.until(tab, "labelgs.edits.state.changes.length === 0");
}

/// The cameras that a run has written stand in for its scene.
fn a_run_without_its_scene(browser: &mut Browser, place: &Place) {
    let scene = labelgs::scenes::open(&place.path("scene"), &LoadOptions::default()).expect("a scene");
    let cameras: Vec<_> = scene.all().into_iter().map(|view| (view.name.as_str(), &view.camera)).collect();
    let folder = place.path("run/point_cloud/iteration_1");
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::copy(place.path("model.ply"), folder.join("point_cloud.ply")).expect("copied");
    write_cameras(place.path("run/cameras.json"), &cameras).expect("written");
    let server = Server::start(place.command(&["view", "run"]));
    let tab = browser.open(&server.address, WIDE);
    browser.until(&tab, SETTLED);
    browser.js(&tab, "document.querySelector('#photo-pixels').click()");
    browser.until(&tab, "labelgs.stage.frame.width === 64");
    let picture = pixels(browser, &tab);
    assert_eq!(picture, place.picture("all/000.rgb.png"));
    assert_eq!(browser.js(&tab, "document.querySelectorAll('#view-list button').length"), 6);
    assert_eq!(browser.js(&tab, "document.getElementById('compare').hidden"), true);
    browser.kill(&tab);
}

fn many_labels_and_none(browser: &mut Browser, place: &Place) {
    let scene = place.path("scene");
    let mut many = model(&scene);
    many.labels = Some((0..many.len() as u32).map(|row| row % 201).collect());
    write_model(place.path("many.ply"), &many).expect("a model");
    let server = Server::start(place.command(&["view", "many.ply"]));
    let tab = browser.open(&server.address, WIDE);
    browser.until(&tab, SETTLED);
    assert_eq!(browser.js(&tab, "document.querySelectorAll('li.label').length"), 201);
    browser.kill(&tab);
    drop(server);
    many.labels = Some(vec![7; many.len()]);
    write_model(place.path("one.ply"), &many).expect("a model");
    let server = Server::start(place.command(&["view", "one.ply"]));
    let tab = browser.open(&server.address, WIDE);
    browser.until(&tab, SETTLED);
    assert_eq!(browser.js(&tab, "document.querySelector('#label-count').textContent"), "1 object");
    assert_eq!(browser.js(&tab, "document.querySelector('li.label').parentElement.getAttribute('role')"), "listbox");
    browser.kill(&tab);
    many.labels = None;
    many.label_confidence = None;
    write_model(place.path("none.ply"), &many).expect("a model");
    let server = Server::start(place.command(&["view", "none.ply"]));
    let tab = browser.open(&server.address, WIDE);
    browser.until(&tab, SETTLED);
    browser.until(&tab, "document.querySelector('#label-empty').textContent.includes('no labels')");
    browser.kill(&tab);
    assert_eq!(browser.complaints, Vec::<String>::new(), "complaints on the console");
}

/// Points at each step of each chart: the values are those of the history, of the curves that have one at that step.
fn a_report_tells_the_values_of_the_step(browser: &mut Browser, place: &Place) {
    place.succeeds(&["train", "scene", "--iterations", "12", "--set", "preview_every=4", "-o", "reported"]);
    let tab = browser.open(&format!("file://{}", place.path("reported/report.html").display()), WIDE);
    browser.until(&tab, "document.readyState === 'complete' && document.querySelector('figure.chart polyline')");
    let found = browser.js(
        &tab,
        "(() => { let partial = 0; const wrong = []; const told = {};
            for (const chart of document.querySelectorAll('figure.chart')) {
              const plot = chart.querySelector('.plot');
              const box = plot.getBoundingClientRect();
              const xs = (line) => line.getAttribute('points').split(' ').map((point) => Number(point.split(',')[0]));
              const curves = [...chart.querySelectorAll('polyline')].map(xs);
              const title = chart.querySelector('strong').textContent;
              for (const x of new Set(curves.flat())) {
                plot.dispatchEvent(new PointerEvent('pointermove', { clientX: box.left + (x * box.width) / 1000 }));
                const rows = [...chart.querySelector('.readout').children].map((row) => row.textContent);
                const shown = rows.length - 1;
                for (const row of rows.slice(1)) (told[title] ??= []).push(`${rows[0]}: ${row}`);
                const there = curves.filter((curve) => curve.includes(x)).length;
                partial += there < curves.length;
                if (shown !== there) wrong.push([chart.textContent.slice(0, 80), x, shown, there]);
              }
            }
            return { partial, wrong, told }; })()",
    );
    assert_eq!(found["wrong"], serde_json::json!([]), "{found}");
    let mut expected = std::collections::BTreeMap::<&str, Vec<String>>::new();
    for line in std::fs::read_to_string(place.path("reported/history.jsonl")).expect("a history").lines() {
        let entry: Value = serde_json::from_str(line).expect("JSON");
        let at = format!("step {}", entry["step"]);
        let score = |name: &str, of: &str| Some(format!("{at}: {of} {:.2}", entry[name].as_f64()?));
        match entry["kind"].as_str().expect("a kind") {
            "steps" => {
                expected.entry("Gaussians").or_default().push(format!("{at}: {}", entry["gaussians"]));
                expected
                    .entry("Loss")
                    .or_default()
                    .push(format!("{at}: Photo loss {:.3}", entry["loss"].as_f64().expect("loss")));
            }
            "preview" => expected
                .entry("PSNR")
                .or_default()
                .extend(score("psnr", &format!("view {}", entry["view"].as_str().expect("a view")))),
            "scores" => expected.entry("PSNR").or_default().extend(score("psnr", "all held-out views")),
            _ => {}
        }
    }
    assert!(expected["PSNR"].len() > 2, "{expected:?}");
    for (chart, lines) in &expected {
        let told: Vec<&str> =
            found["told"][chart].as_array().expect("lines").iter().filter_map(Value::as_str).collect();
        assert!(lines.iter().all(|line| told.contains(&line.as_str())), "{chart}: {lines:?} are not all in {told:?}");
    }
    assert!(found["partial"].as_u64().is_some_and(|count| count > 0), "a curve without a point at some step: {found}");
    browser.kill(&tab);
}

fn a_server_goes_away_and_comes_back(browser: &mut Browser, place: &Place) {
    let server = place.view(&["--view-no-token"]);
    let port = server.port().to_string();
    let tab = browser.open(&server.address, WIDE);
    browser.until(&tab, SETTLED);
    browser.drag(&tab, (600.0, 400.0), (700.0, 420.0));
    let camera = browser.js(&tab, "JSON.stringify(labelgs.rig.file())");
    drop(server);
    browser.until(
        &tab,
        "!document.querySelector('#veil').hidden && document.querySelector('#veil-head').textContent.includes('lost')",
    );
    let server = place.view(&["--view-no-token", "--view-port", &port]);
    browser.until(&tab, "document.querySelector('#veil').hidden");
    browser.until(&tab, SETTLED);
    assert_eq!(browser.js(&tab, "JSON.stringify(labelgs.rig.file())"), camera, "the camera stays");
    // Another server with a token: the page says what to do.
    drop(server);
    let server = place.view(&["--view-port", &port]);
    browser.until(&tab, "document.querySelector('#veil-head').textContent.includes('restarted')");
    drop(server);
    browser.kill(&tab);
    // Refused connections are complaints of the browser itself.
    browser.complaints.clear();
}

fn a_training_in_the_page(browser: &mut Browser, place: &Place) {
    let flags = ["train", "scene", "--masks", "scene/masks", "--iterations", "100000", "-o", "out", "--view"];
    let mut server = Server::train(place.command(&flags));
    let tab = browser.open(&server.address, WIDE);
    browser.until(&tab, "window.labelgs?.training.state?.step > 5");
    assert_eq!(browser.js(&tab, "document.querySelector('#training').hidden"), false);
    browser.key(&tab, "KeyK", "k", 0);
    browser.until(&tab, "labelgs.training.state.paused");
    let step = browser.js(&tab, "labelgs.training.state.step");
    browser.drag(&tab, (600.0, 400.0), (700.0, 420.0));
    std::thread::sleep(Duration::from_millis(600));
    assert_eq!(browser.js(&tab, "labelgs.training.state.step"), step, "a pause holds the step");
    browser.until(
        &tab,
        "document.querySelector('li.label .eye').disabled && document.querySelector('#act-merge').disabled",
    );
    browser.key(&tab, "KeyK", "k", 0);
    browser.until(&tab, &format!("labelgs.training.state.step > {step} + 3"));
    browser.js(&tab, "void labelgs.training.ask('stop')");
    browser.until(&tab, "document.querySelector('#ask').open");
    browser.click_on(&tab, "#ask-yes");
    browser.until(&tab, "document.querySelector('#veil-head').textContent.startsWith('Stopped')");
    assert!(server.child.wait().expect("it ends").success());
    browser.kill(&tab);
}
