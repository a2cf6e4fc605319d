//! The page that `labelgs convert MODEL PAGE.html` writes, in a browser.

use super::chromium::{Browser, Tab};
use super::server::{HOSTILE, Picture, Place, model};
use labelgs::formats::write_model;
use labelgs::scene::Gaussians;
use labelgs::scenes::LoadOptions;
use labelgs::scenes::camera_json::CameraFile;
use std::fmt::Write;

/// Pictures of a page are blended in 8 bits: their error is a few steps of 1/256 where many Gaussians overlap.
const LEAST: f64 = 44.0;

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

/// Converts a model with labels and looks at it from the camera of a photo.
pub fn a_page_shows_its_model(browser: &mut Browser, place: &Place) {
    write_model(place.path("rich.ply"), &rich(place)).expect("written");
    std::fs::copy(place.path("model.labels.json"), place.path("rich.labels.json")).expect("copied");
    place.succeeds(&["convert", "rich.ply", "page.html"]);
    let scene = labelgs::scenes::open(&place.path("scene"), &LoadOptions::default()).expect("a scene");
    let camera = serde_json::to_string(&CameraFile::from(&scene.train[0].camera)).expect("JSON");
    std::fs::write(place.path("camera.json"), &camera).expect("written");
    for (name, more) in [("all", &[][..]), ("some", &["--without", "3"])] {
        let typed = ["render", "page.html", "--camera", "camera.json", "--near", "0.01", "--what", "rgb", "-o", name];
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
    assert!(whole > LEAST && hidden > LEAST, "{whole} dB, {hidden} dB with a label hidden");

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
