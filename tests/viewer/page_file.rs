//! The page that `labelgs convert MODEL PAGE.html` writes, in a browser.

use super::chromium::{Browser, Tab};
use super::server::{HOSTILE, Picture, Place, model};
use labelgs::formats::write_model;
use labelgs::scene::Gaussians;
use labelgs::scenes::LoadOptions;
use labelgs::scenes::camera_json::CameraFile;
use std::fmt::Write;

/// Pictures of a page are blended in 8 bits: their error is a few steps of 1/256 where many Gaussians overlap.
const PSNR_MIN: f64 = 44.0;

/// The pixels of the page's picture.
fn pixels(browser: &mut Browser, tab: &Tab) -> Picture {
    let read = "(() => { const c = document.getElementById('picture'); const gl = c.getContext('webgl2'); \
                const p = new Uint8Array(4 * c.width * c.height); \
                gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, p); \
                return [c.width, c.height, [...p].filter((_, i) => i % 4 < 3)]; })()";
    let found = browser.js(tab, read);
    let number = |value: &serde_json::Value| value.as_u64().expect("a number");
    let (width, height) = (number(&found[0]) as usize, number(&found[1]) as usize);
    let bytes: Vec<u16> = found[2].as_array().expect("bytes").iter().map(|value| number(value) as u16).collect();
    // The first row is the lowest.
    let values = bytes.chunks_exact(3 * width).rev().flatten().copied().collect();
    Picture { size: (width as u32, height as u32), values }
}

fn psnr(a: &Picture, b: &Picture) -> f64 {
    assert_eq!(a.size, b.size);
    let squares: f64 = a.values.iter().zip(&b.values).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    -10.0 * (squares / a.values.len() as f64 / 255.0 / 255.0).log10()
}

/// Colours of degree 3 that change with the direction.
fn rich(place: &Place) -> Gaussians {
    let plain = model(&place.path("scene"));
    let value = |at: usize| 0.3 * ((at * 7919 % 101) as f32 / 50.0 - 1.0);
    let sh_rest = (0..15 * plain.len()).map(|at| [value(at), value(at + 31), value(at + 67)]).collect();
    Gaussians { sh_rest, sh_degree: 3, ..plain }
}

/// Clicks on pixels inside of objects: the object of the label map is chosen and named. Twice, it is alone. Escape goes
/// back.
fn clicks_choose_objects(browser: &mut Browser, tab: &Tab, map: &Picture) {
    let (width, height) = (map.size.0 as usize, map.size.1 as usize);
    let id = |x: usize, y: usize| map.values[y * width + x];
    let is_inside =
        |x: usize, y: usize| id(x, y) != 0 && (0..9).all(|step| id(x + step % 3 - 1, y + step / 3 - 1) == id(x, y));
    let inner = (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y)));
    let inside: Vec<(usize, usize)> = inner.filter(|&(x, y)| is_inside(x, y)).collect();
    let stage = browser
        .js(tab, "[document.getElementById('picture').clientWidth, document.getElementById('picture').clientHeight]");
    let side = |index: usize| stage[index].as_f64().expect("a number");
    let place = |(x, y): (usize, usize)| {
        ((x as f64 + 0.5) * side(0) / width as f64, (y as f64 + 0.5) * side(1) / height as f64)
    };
    // Not below the cards of the page.
    let free = "(([x, y]) => document.elementFromPoint(x, y)?.id === 'picture')";
    let mut clicked = Vec::new();
    for &pixel in inside.iter().step_by(inside.len() / 60 + 1) {
        let (x, y) = place(pixel);
        if browser.js(tab, &format!("{free}([{x}, {y}])")) == true && clicked.len() < 20 {
            clicked.push(pixel);
        }
    }
    let mut right = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for &(x, y) in &clicked {
        browser.click(tab, place((x, y)), 0);
        let chosen = "(() => { const at = [...document.querySelectorAll('#labels .name')].findIndex((one) => one.ariaPressed === 'true'); \
                      return at < 0 ? null : [about.labels[at].id, document.getElementById('chosen-name').textContent === (about.labels[at].name ?? `label ${about.labels[at].id}`)]; })()";
        let found =
            browser.js(tab, &chosen.replace("about", "JSON.parse(document.getElementById('about').textContent)"));
        if found == serde_json::json!([id(x, y), true]) {
            right.push((x, y));
            seen.insert(id(x, y));
        }
        browser.key(tab, "Escape", "Escape", 0);
        assert_eq!(browser.js(tab, "document.getElementById('chosen').hidden"), true);
    }
    // Bytes of SPZ and centres in depth order move borders.
    assert!(
        clicked.len() > 8 && right.len() * 10 >= clicked.len() * 9 && seen.len() > 1,
        "{} of {}",
        right.len(),
        clicked.len()
    );

    let frame = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))";
    browser.js(tab, frame);
    let before = pixels(browser, tab);
    let at = place(right[0]);
    // Both clicks in one go: a busy machine may take too long between two of a protocol. The mouse is pointer 1.
    let twice = format!(
        "(() => {{ const canvas = document.getElementById('picture'); \
         const at = {{ clientX: {}, clientY: {}, pointerId: 1, pointerType: 'mouse', button: 0, bubbles: true }}; \
         for (const kind of ['down', 'up', 'down', 'up']) canvas.dispatchEvent(new PointerEvent(`pointer${{kind}}`, at)); }})()",
        at.0, at.1
    );
    browser.js(tab, &twice);
    assert_eq!(browser.js(tab, "document.getElementById('alone').ariaPressed"), "true");
    browser.js(tab, frame);
    let alone = pixels(browser, tab);
    let changed = alone.values.iter().zip(&before.values).filter(|(a, b)| a != b).count();
    assert!(changed * 3 > before.values.len(), "the other objects are gone");
    browser.key(tab, "Escape", "Escape", 0);
    browser.until(
        tab,
        "document.getElementById('alone').ariaPressed === 'false' && !document.getElementById('chosen').hidden",
    );
    browser.key(tab, "Escape", "Escape", 0);
    browser.until(tab, "document.getElementById('chosen').hidden");
    browser.js(tab, frame);
    assert!(pixels(browser, tab).values == before.values, "everything is back");

    // Numbers on demand, and words for the hand at hand.
    let shown = "getComputedStyle(document.querySelector('#labels .number')).display";
    assert_eq!(browser.js(tab, shown), "none");
    browser.js(tab, "document.getElementById('counts').click()");
    assert_ne!(browser.js(tab, shown), "none");
    assert_eq!(browser.js(tab, "document.getElementById('full').hidden"), false);
    let hint = "document.getElementById('hint').textContent";
    assert!(browser.js(tab, hint).as_str().is_some_and(|text| text.contains("Click an object")), "a mouse");
    browser.js(tab, "window.dispatchEvent(new PointerEvent('pointerdown', { pointerType: 'touch' }))");
    assert!(browser.js(tab, hint).as_str().is_some_and(|text| text.contains("Tap an object")), "a finger");
}

/// Converts a model with labels and looks at it from the camera of a photo.
pub fn a_page_shows_its_model(browser: &mut Browser, place: &Place) {
    write_model(place.path("rich.ply"), &rich(place)).expect("written");
    std::fs::copy(place.path("model.labels.json"), place.path("rich.labels.json")).expect("copied");
    place.succeeds(&["convert", "rich.ply", "page.html"]);
    let scene = labelgs::scenes::open(&place.path("scene"), &LoadOptions::default()).expect("a scene");
    let camera = serde_json::to_string(&CameraFile::from(&scene.train[0].camera)).expect("JSON");
    std::fs::write(place.path("camera.json"), &camera).expect("written");
    for (name, more) in [("all", &[][..]), ("some", &["--without", "3"])] {
        let what = "rgb,labels";
        let typed = ["render", "page.html", "--camera", "camera.json", "--near", "0.01", "--what", what, "-o", name];
        place.succeeds(&[&typed[..], more].concat());
    }
    let encoded = camera.bytes().fold(String::new(), |mut text, byte| {
        write!(text, "%{byte:02x}").expect("text");
        text
    });
    let file = place.path("page.html");
    let tab = browser.open(&format!("file://{}#camera={encoded}", file.display()), (900, 600));
    browser.until(&tab, "window.ready");
    assert_eq!(browser.js(&tab, "ready"), true, "{}", browser.js(&tab, "document.body.innerText"));

    let whole = psnr(&pixels(browser, &tab), &place.picture("all/camera.rgb.png"));
    assert_eq!(browser.js(&tab, "[...document.querySelectorAll('.name')].map((n) => n.textContent)[2]"), HOSTILE);
    browser.js(&tab, "document.querySelectorAll('#labels input')[3].click()");
    browser.js(&tab, "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
    let hidden = psnr(&pixels(browser, &tab), &place.picture("some/camera.rgb.png"));
    println!("a page in a browser against `render`: {whole:.1} dB, {hidden:.1} dB with a label hidden");
    assert!(whole > PSNR_MIN && hidden > PSNR_MIN, "{whole} dB, {hidden} dB with a label hidden");

    browser.js(&tab, "document.querySelectorAll('#labels input')[3].click()");
    assert_eq!(browser.js(&tab, "document.title"), "page – labelgs", "the name of the file");
    clicks_choose_objects(browser, &tab, &place.picture("all/camera.labels.png"));

    // Tinted, turned by mouse and keys, and back.
    browser.click_on(&tab, "#tint-all");
    browser.drag(&tab, (500.0, 300.0), (600.0, 340.0));
    browser.key(&tab, "ArrowLeft", "ArrowLeft", 0);
    browser.js(&tab, "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
    let turned = pixels(browser, &tab);
    assert_eq!(turned.size, (900, 600), "a free camera fills the window");
    assert!(turned.values.iter().any(|&value| value > 60), "something is drawn");
    assert!(browser.js(&tab, "window.hacked === undefined").as_bool().expect("a truth"));
    browser.kill(&tab);
}
