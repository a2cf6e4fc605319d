//! The files of the page, in the program.

use crate::web;

/// Path, type and bytes of each file.
const PAGE_FILES: &[(&str, &str, &[u8])] = &[
    ("/", "text/html; charset=utf-8", include_bytes!("page/index.html")),
    ("/style.css", "text/css; charset=utf-8", include_bytes!("page/style.css")),
    ("/panels.css", "text/css; charset=utf-8", include_bytes!("page/panels.css")),
    ("/main.js", SCRIPT_TYPE, include_bytes!("page/main.js")),
    ("/link.js", SCRIPT_TYPE, include_bytes!("page/link.js")),
    ("/algebra.js", SCRIPT_TYPE, web::ALGEBRA_SCRIPT.as_bytes()),
    ("/camera.js", SCRIPT_TYPE, web::CAMERA_SCRIPT.as_bytes()),
    ("/input.js", SCRIPT_TYPE, web::INPUT_SCRIPT.as_bytes()),
    ("/map.js", SCRIPT_TYPE, include_bytes!("page/map.js")),
    ("/measure.js", SCRIPT_TYPE, include_bytes!("page/measure.js")),
    ("/path.js", SCRIPT_TYPE, include_bytes!("page/path.js")),
    ("/select.js", SCRIPT_TYPE, include_bytes!("page/select.js")),
    ("/stage.js", SCRIPT_TYPE, include_bytes!("page/stage.js")),
    ("/labels.js", SCRIPT_TYPE, include_bytes!("page/labels.js")),
    ("/edits.js", SCRIPT_TYPE, include_bytes!("page/edits.js")),
    ("/object.js", SCRIPT_TYPE, include_bytes!("page/object.js")),
    ("/views.js", SCRIPT_TYPE, include_bytes!("page/views.js")),
    ("/training.js", SCRIPT_TYPE, include_bytes!("page/training.js")),
    ("/dom.js", SCRIPT_TYPE, include_bytes!("page/dom.js")),
    ("/icon.svg", "image/svg+xml", include_bytes!("page/icon.svg")),
];

const SCRIPT_TYPE: &str = "text/javascript; charset=utf-8";

pub(super) fn file(path: &str) -> Option<(&'static str, &'static [u8])> {
    PAGE_FILES.iter().find(|(own, ..)| *own == path).map(|&(_, kind, bytes)| (kind, bytes))
}
