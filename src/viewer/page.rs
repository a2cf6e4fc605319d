//! The files of the page, in the program.

use crate::web;

/// Path, type and bytes of each file.
const FILES: &[(&str, &str, &[u8])] = &[
    ("/", "text/html; charset=utf-8", include_bytes!("page/index.html")),
    ("/style.css", "text/css; charset=utf-8", include_bytes!("page/style.css")),
    ("/panels.css", "text/css; charset=utf-8", include_bytes!("page/panels.css")),
    ("/main.js", SCRIPT, include_bytes!("page/main.js")),
    ("/link.js", SCRIPT, include_bytes!("page/link.js")),
    ("/algebra.js", SCRIPT, web::ALGEBRA.as_bytes()),
    ("/camera.js", SCRIPT, web::CAMERA.as_bytes()),
    ("/input.js", SCRIPT, web::INPUT.as_bytes()),
    ("/map.js", SCRIPT, include_bytes!("page/map.js")),
    ("/measure.js", SCRIPT, include_bytes!("page/measure.js")),
    ("/path.js", SCRIPT, include_bytes!("page/path.js")),
    ("/select.js", SCRIPT, include_bytes!("page/select.js")),
    ("/stage.js", SCRIPT, include_bytes!("page/stage.js")),
    ("/labels.js", SCRIPT, include_bytes!("page/labels.js")),
    ("/edits.js", SCRIPT, include_bytes!("page/edits.js")),
    ("/object.js", SCRIPT, include_bytes!("page/object.js")),
    ("/views.js", SCRIPT, include_bytes!("page/views.js")),
    ("/training.js", SCRIPT, include_bytes!("page/training.js")),
    ("/dom.js", SCRIPT, include_bytes!("page/dom.js")),
    ("/icon.svg", "image/svg+xml", include_bytes!("page/icon.svg")),
];

const SCRIPT: &str = "text/javascript; charset=utf-8";

pub(super) fn file(path: &str) -> Option<(&'static str, &'static [u8])> {
    FILES.iter().find(|(own, ..)| *own == path).map(|&(_, kind, bytes)| (kind, bytes))
}
