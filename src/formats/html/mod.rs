//! A page that shows a model in any browser: one HTML file that asks nothing from the network, with the model as an SPZ
//! in it. It is read back like an SPZ.

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

/// The format by its ending.
pub(super) const FORMAT: ModelFormat = ModelFormat {
    name: "HTML",
    endings: &[".html"],
    contents: &["a web page", "a page of HTML or XML"],
    read,
    write: Some(WRITER),
};

const WRITER: ModelWriter = ModelWriter { losses: spz::losses, write, checksum: None };

/// One script, in this order.
const SCRIPTS: [&str; 8] = [
    web::ALGEBRA,
    web::CAMERA,
    web::INPUT,
    include_str!("decode.js"),
    include_str!("shaders.js"),
    include_str!("draw.js"),
    include_str!("pick.js"),
    include_str!("page.js"),
];
/// Start and end of the model in a page.
const MODEL: [&str; 2] = ["<script type=\"text/plain\" id=\"model\">", "</script>"];

fn write(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    let mut packed = Vec::new();
    spz::write_v3(export, &mut packed)?;
    out.write_all(page(export, &STANDARD.encode(packed)).as_bytes())
}

/// Returns the page around a model, which comes as base64.
fn page(export: &Export, model: &str) -> String {
    let mut counts: BTreeMap<u32, u64> = BTreeMap::new();
    for &row in export.rows {
        *counts.entry(export.labels().map_or(UNLABELLED, |labels| labels[row])).or_default() += 1;
    }
    let labels = counts.iter().map(|(&id, count)| {
        let name = export.names.and_then(|names| names.name(id));
        json!({ "id": id, "name": name, "colour": label_colour(id), "gaussians": count })
    });
    // Axes of the model inside.
    let turned = |place: DVec3| spz::AXES.position(place.as_vec3().to_array());
    let view = export.options.first_view;
    let view = view.map(|FirstView { up, eye }| json!({ "up": turned(up), "eye": turned(eye - export.origin) }));
    let about = json!({ "labels": labels.collect::<Vec<_>>(), "origin": export.origin.to_array(), "view": view });
    // Nothing in a name may end the script.
    let about = about.to_string().replace('<', "\\u003c");
    let title = if export.title.is_empty() { "Model" } else { export.title };
    let body = html! {
        canvas id="picture" tabindex="0" aria-label="Picture of the model. Drag to turn it, click an object to select it." {}
        (panels(title, export.rows.len()))
        script type="application/json" id="about" { (PreEscaped(about)) }
        script type="text/plain" id="model" { (PreEscaped(model)) }
    };
    web::page(title, include_str!("style.css"), &body, &web::joined(&SCRIPTS))
}

fn panels(title: &str, count: usize) -> Markup {
    html! {
        header.card id="head" {
            h1 { (title) }
            // Of the device at hand: the script fills it.
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
            button type="button" id="alone" aria-pressed="false" { "Show alone" }
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
                    "Values have the steps of SPZ: positions, sizes, rotations, colours. The browser sorts Gaussians by the \
                     depth of their centres and adds their colours in steps of 1/256, where the engine has 32-bit \
                     floats and stops behind opaque ones. Labels are those of Gaussians, so outlines are as sharp as the \
                     Gaussians, not as a label map."
                }
                p { (counted(count, "Gaussian")) ". " label { input type="checkbox" id="counts"; " Show the number of each object" } }
            }
        }
        div.card id="message" role="status" { "Reading the model …" }
    }
}

/// Reads the model in a page.
fn read(path: &Path) -> Result<ReadModel> {
    let text = file::text(path)?;
    let [start, end] = MODEL;
    let inside = text.split_once(start).and_then(|(_, rest)| rest.split_once(end));
    let (packed, _) = inside
        .ok_or_else(|| Error::data(path, "", "has no model inside; only pages that labelgs has written are read"))?;
    let bytes = STANDARD.decode(packed.trim()).map_err(|error| {
        Error::data(path, "the model inside", format!("is not base64: {error}; the page was cut short or changed"))
    })?;
    spz::read_bytes(path, &bytes)
}
