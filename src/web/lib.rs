//! Shared by pages in a browser: the frame of a single-file page, and the camera with mouse and keyboard control.
//!
//! A page in one file opens from disk: style and script are inside, and nothing is asked from the network. All text
//! goes through `maud`, which escapes it.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Vectors and rotations, a module of JavaScript.
pub const ALGEBRA_SCRIPT: &str = include_str!("algebra.js");
/// The camera, a module that imports [`ALGEBRA_SCRIPT`].
pub const CAMERA_SCRIPT: &str = include_str!("camera.js");
/// Mouse, touch and keys that move the camera, a module.
pub const INPUT_SCRIPT: &str = include_str!("input.js");

/// Colours and buttons of every page in one file.
const THEME_STYLE: &str = include_str!("theme.css");
/// Content policy of a page: only images inside or beside the page may be loaded.
const CONTENT_POLICY: &str =
    "default-src 'none'; img-src 'self' file: data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// Returns a page in one file. `body` and text of `title` are escaped already or by `maud`; the others come from this
/// program.
pub fn page(title: &str, style: &str, body: &Markup, script: &str) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta http-equiv="Content-Security-Policy" content=(CONTENT_POLICY);
                title { (title) " – labelgs" }
                style { (PreEscaped(THEME_STYLE)) (PreEscaped(style)) }
            }
            body {
                (body)
                script type="module" { (PreEscaped(script)) }
            }
        }
    };
    markup.into_string() + "\n"
}

/// Returns modules as one script: a page on disk cannot import, so their names share one scope.
pub fn joined(modules: &[&str]) -> String {
    let lines = modules.iter().flat_map(|module| module.lines()).filter(|line| !line.starts_with("import "));
    lines.flat_map(|line| [line.strip_prefix("export ").unwrap_or(line), "\n"]).collect()
}
