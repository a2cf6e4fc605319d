//! A page that shows a model in any browser: a single HTML file that embeds the model as an SPZ and needs no network.
//! It is read back like an SPZ.

use super::format::{Export, FirstView, ModelFormat, ModelWriter, ReadModel};
use super::spz;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use labelgs_files::read as file;
use labelgs_scene::UNLABELLED;
use labelgs_scene::labels::label_colour;
use labelgs_scene::words::counted;
use labelgs_scene::{Error, Result};
use labelgs_web as web;
use maud::{Markup, PreEscaped, html};
use serde_json::json;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

/// The HTML page format.
pub(super) const MODEL_FORMAT: ModelFormat = ModelFormat {
    name: "HTML",
    extensions: &[".html"],
    contents: &["a web page", "a page of HTML or XML"],
    read,
    write: Some(MODEL_WRITER),
};

const MODEL_WRITER: ModelWriter = ModelWriter { losses: spz::losses, write, checksum: None };

/// One script, in this order.
const PAGE_SCRIPTS: [&str; 8] = [
    web::ALGEBRA_SCRIPT,
    web::CAMERA_SCRIPT,
    web::INPUT_SCRIPT,
    include_str!("decode.js"),
    include_str!("shaders.js"),
    include_str!("draw.js"),
    include_str!("pick.js"),
    include_str!("page.js"),
];
/// Delimiters of the model in a page.
const MODEL_DELIMITERS: [&str; 2] = ["<script type=\"text/plain\" id=\"model\">", "</script>"];

fn write(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    let mut packed = Vec::new();
    spz::write_v3(export, &mut packed)?;
    out.write_all(page(export, &STANDARD.encode(packed)).as_bytes())
}

/// Returns the page around a model encoded as base64.
fn page(export: &Export, model: &str) -> String {
    let mut counts: BTreeMap<u32, u64> = BTreeMap::new();
    for &row in export.rows {
        *counts.entry(export.labels().map_or(UNLABELLED, |labels| labels[row])).or_default() += 1;
    }
    let labels = counts.iter().map(|(&id, count)| {
        let name = export.names.and_then(|names| names.name(id));
        json!({ "id": id, "name": name, "colour": label_colour(id), "gaussians": count })
    });
    // Axes of the embedded model.
    let turned = |place: DVec3| spz::SPZ_AXES.position(place.as_vec3().to_array());
    let view = export.options.first_view;
    let view = view.map(|FirstView { up, eye }| json!({ "up": turned(up), "eye": turned(eye - export.origin) }));
    let about = json!({ "labels": labels.collect::<Vec<_>>(), "origin": export.origin.to_array(), "view": view });
    // A name must not end the script element.
    let about = about.to_string().replace('<', "\\u003c");
    let title = if export.title.is_empty() { "Model" } else { export.title };
    let body = html! {
        canvas id="picture" tabindex="0" aria-label="The model. Drag to rotate it, click an object to select it." {}
        (panels(title, export.rows.len()))
        script type="application/json" id="about" { (PreEscaped(about)) }
        script type="text/plain" id="model" { (PreEscaped(model)) }
    };
    web::page(title, include_str!("style.css"), &body, &web::joined(&PAGE_SCRIPTS))
}

fn panels(title: &str, count: usize) -> Markup {
    html! {
        header.card id="head" {
            h1 { (title) }
            // The script fills in the controls of the device.
            p id="hint" {}
        }
        details.card id="panel" aria-label="Objects" hidden {
            summary { "Objects" }
            div {
                button type="button" id="show-all" { "Show all" }
                button type="button" id="tint-all" { "Tint all" }
            }
            ul id="labels" {}
        }
        div.card id="chosen" role="status" hidden {
            strong id="chosen-name" {}
            button type="button" id="alone" aria-pressed="false" { "Show only this" }
            button type="button" id="back" { "Back" }
        }
        footer id="foot" {
            div.card.tools {
                button type="button" id="reset" { "Reset camera" }
                button type="button" id="full" hidden { "Full screen" }
            }
            details.card id="notes" {
                summary { "Made with labelgs" }
                p {
                    "This page is a preview. Positions, sizes, rotations and colours are quantised as in SPZ files. The \
                     browser sorts Gaussians by the depth of their centres and blends 8-bit colours. labelgs itself \
                     blends 32-bit colours. Outlines of objects follow single Gaussians, so they are less sharp than in \
                     a label map."
                }
                p { (counted(count, "Gaussian")) ". " label { input type="checkbox" id="counts"; " Show Gaussians per object" } }
            }
        }
        div.card id="message" role="status" { "Loading the model …" }
    }
}

/// Reads the model embedded in a page.
fn read(path: &Path) -> Result<ReadModel> {
    let text = file::text(path)?;
    let [start, end] = MODEL_DELIMITERS;
    let inside = text.split_once(start).and_then(|(_, rest)| rest.split_once(end));
    let (packed, _) =
        inside.ok_or_else(|| Error::data(path, "", "contains no model; only pages written by labelgs can be read"))?;
    let bytes = STANDARD.decode(packed.trim()).map_err(|error| {
        Error::data(path, "embedded model", format!("is not base64: {error}; the page is truncated or was modified"))
    })?;
    spz::read_bytes(path, &bytes)
}
