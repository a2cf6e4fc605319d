//! The tool that finds an object from clicks.

use super::browser::{SETTLED, WIDE};
use super::chromium::{Browser, Tab};
use super::protocol::{has, same_by_command};
use super::server::{Page, Place};
use crate::support::device;
use crate::support::segmenter::{largest_object, paint, pixel_of, tiny};
use labelgs::formats::read_model;
use serde_json::{Value, json};

/// The label that an object gets: the first one after those of the model and its names.
const NEW_LABEL: u64 = 4;

/// Gives a place a network, and photos that it can read.
fn prepare(place: &Place) {
    paint(&place.path("scene"));
    tiny::write(&place.path("net"));
}

/// Replaces the model of a place by a trained one, whose labels are those of the masks.
fn train(place: &Place) {
    place.succeeds(&["train", "scene", "--iterations", "200", "--set", "preview_every=0", "-o", "run"]);
    place.succeeds(&["label", "run", "--scene", "scene", "--masks", "scene/masks", "-o", "model.ply"]);
}

/// Points at an object, and waits for the last answer that has so many hints.
fn point(page: &mut Page, what: &Value, hints: usize) -> Value {
    page.send(&json!({ "kind": "object", "what": what }));
    page.until("object", |object| {
        object["asked"].is_null() && object["flags"].as_array().is_some_and(|flags| flags.len() == hints)
    })
}

#[test]
fn an_object_is_found_grows_and_becomes_a_label() {
    if device().is_none() {
        return;
    }
    let place = Place::new();
    train(&place);
    prepare(&place);
    let (object, pixel) = largest_object(&place.path("scene"), "000");
    let server = place.view(&["--network", "net"]);
    let mut page = server.page();
    let scene = page.hear("scene");
    assert_eq!(scene["finds"], true);
    let before = page.hear("labels");

    // A photo is asked where it was clicked; the object is drawn with a label that no list has yet.
    let first = point(&mut page, &json!({ "object": "click", "from": { "view": 0 }, "pixel": pixel, "on": true }), 1);
    let click = format!("000.png:{},{}", pixel[0], pixel[1]);
    assert_eq!((&first["label"], &first["flags"]), (&json!(NEW_LABEL), &json!([["click", click]])));
    assert!(first["count"].as_u64().is_some_and(|count| count > 10), "{first}");
    assert_eq!(page.pick(&json!({ "view": 0 }), pixel)["label"], NEW_LABEL, "it is drawn");

    // A free camera: the photo that looks most alike is asked. Then what does not belong to it.
    let other = pixel_of(&place.path("scene"), "001", object);
    let camera = scene["views"][1]["camera"].clone();
    let second =
        point(&mut page, &json!({ "object": "click", "from": { "camera": camera }, "pixel": other, "on": true }), 2);
    assert_eq!(second["flags"][1], json!(["click", format!("001.png:{},{}", other[0], other[1])]));
    let rest = (0..3072_u32).map(|at| [at * 37 % 64, at * 29 % 48]);
    let mut is_other = |pixel: &[u32; 2]| {
        let found = page.pick(&json!({ "view": 0 }), *pixel);
        found["label"] != NEW_LABEL && found["opacity"].as_f64().is_some_and(|opacity| opacity > 0.7)
    };
    let [x, y] = rest.into_iter().find(|pixel| is_other(pixel)).expect("a pixel of something else");
    let third = point(&mut page, &json!({ "object": "click", "from": { "view": 0 }, "pixel": [x, y], "on": false }), 3);
    assert_eq!(third["flags"][2], json!(["not", format!("000.png:{x},{y}")]));

    // It becomes a label by the command that is shown, and most of it is the object.
    page.send(&json!({ "kind": "object", "what": { "object": "keep", "name": "it's one" } }));
    assert_eq!(page.hear("kept")["label"], NEW_LABEL);
    let kept = json!([NEW_LABEL, "it's one", third["count"]]);
    page.until("labels", |labels| {
        let rows = labels["rows"].as_array();
        rows.is_some_and(|rows| rows.iter().any(|row| json!([row["id"], row["name"], row["count"]]) == kept))
    });
    page.send(&json!({ "kind": "write" }));
    let done = page.until("edits", |edits| has(edits, 1, true));
    let command = done["command"].as_str().expect("a command").to_owned();
    assert_eq!(
        command,
        "labelgs edit model.ply --replay model-edits/001.edits.json --scene scene -o model-edits/001.ply"
    );
    let labels = |name: &str| read_model(place.path(name)).expect("a model").gaussians.labels.expect("labels");
    let (found, truth) = (labels("model-edits/001.ply"), labels("model.ply"));
    let of = |label: u32| found.iter().zip(&truth).filter(|(a, b)| u64::from(**a) == NEW_LABEL && **b == label).count();
    let (own, others) = (of(u32::from(object)), (1..=3).map(of).sum::<usize>());
    assert!(own > 10 && 10 * own >= 8 * others, "{own} of {others}");
    same_by_command(&place, &command, "model-edits/001");

    // It is taken back; a box is dropped; what cannot be done is said.
    page.send(&json!({ "kind": "undo" }));
    assert_eq!(page.until("labels", |labels| labels == &before), before);
    let [x, y] = pixel;
    let corners = [x.saturating_sub(4), y.saturating_sub(4), x + 4, y + 4];
    let boxed = point(&mut page, &json!({ "object": "box", "from": { "view": 0 }, "corners": corners }), 1);
    assert_eq!(boxed["flags"][0][0], "box");
    page.send(&json!({ "kind": "object", "what": { "object": "drop" } }));
    page.until("object", |object| object["count"].is_null() && object["asked"].is_null());
    for (what, word) in [
        (json!({ "object": "keep", "name": "x" }), "no object was found"),
        (json!({ "object": "click", "from": { "view": 0 }, "pixel": pixel, "on": false }), "the object first"),
        (json!({ "object": "click", "from": { "view": 17 }, "pixel": pixel, "on": true }), "no view 17"),
    ] {
        page.send(&json!({ "kind": "object", "what": what }));
        let problem = page.hear("problem")["text"].to_string();
        assert!(problem.contains(word), "{what}: {problem}");
    }
}

/// A click, a name and Enter; a box and Escape.
pub fn a_click_finds_an_object(browser: &mut Browser, place: &Place) {
    prepare(place);
    // Pages of servers that have ended were refused.
    browser.complaints.clear();
    let server = place.view(&["--network", "net"]);
    let tab = browser.open(&server.address, WIDE);
    browser.until(&tab, SETTLED);
    browser.click_on(&tab, "#view-list li:nth-child(1) button");
    browser.until(&tab, "labelgs.rig.view === 0");
    browser.js(&tab, "document.querySelector('#stage').focus()");
    browser.js(&tab, "document.querySelector('#photo-pixels').click()");
    browser.key(&tab, "KeyO", "o", 0);
    browser.until(&tab, "labelgs.finding.isOn && !document.querySelector('#object').hidden");
    let (_, pixel) = largest_object(&place.path("scene"), "000");
    let at = on_stage(browser, &tab, pixel);
    browser.click(&tab, at, 0);
    browser.until(&tab, "labelgs.finding.state.count > 10 && !labelgs.finding.state.asked");
    browser.until(&tab, SETTLED);
    browser.until(&tab, "labelgs.stage.mark.includes(5) && labelgs.stage.overlay");
    assert_eq!(browser.js(&tab, "labelgs.rig.view"), 0, "a click does not move the camera");
    browser.js(&tab, "document.querySelector('#object-name').focus()");
    browser.write(&tab, "found");
    browser.key(&tab, "Enter", "Enter", 0);
    browser.until(&tab, "labelgs.labels.row(5)?.name === 'found' && labelgs.labels.selected.has(5)");
    assert_eq!(browser.js(&tab, "labelgs.finding.isThere"), false);
    browser.drag(&tab, (at.0 - 60.0, at.1 - 60.0), (at.0 + 60.0, at.1 + 60.0));
    assert_eq!(browser.js(&tab, "labelgs.rig.view"), 0, "a box does not turn the camera");
    browser.until(&tab, "labelgs.finding.state.flags?.[0][0] === 'box'");
    browser.key(&tab, "Escape", "Escape", 0);
    browser.until(&tab, "!labelgs.finding.isThere && document.querySelector('#object-box').hidden");
    browser.js(&tab, "labelgs.edits.undo()");
    browser.until(&tab, "labelgs.edits.state.changes.length === 0 && !labelgs.labels.row(5)");
    browser.kill(&tab);
    assert_eq!(browser.complaints, Vec::<String>::new(), "complaints on the console");
}

/// Returns where a pixel of view 0 is in the window.
fn on_stage(browser: &mut Browser, tab: &Tab, [x, y]: [u32; 2]) -> (f64, f64) {
    let place = format!(
        "(() => {{ const s = labelgs.stage, a = s.area(0), b = s.box.getBoundingClientRect(); \
         return [b.x + a.x + ({x} + .5) * a.width / 64, b.y + a.y + ({y} + .5) * a.height / 48]; }})()"
    );
    let at = browser.js(tab, &place);
    (at[0].as_f64().expect("x"), at[1].as_f64().expect("y"))
}
