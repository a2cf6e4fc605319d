//! An HTML page with ground truth, prediction and difference of every scored picture, in one folder with its PNGs.

use super::compared::{Compared, Watch};
use crate::io::{atomic, image::write_png_rgb8};
use crate::{Error, Result};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Colours in the difference of two masks.
const ONLY_FOUND: [u8; 3] = [230, 60, 40];
const ONLY_TRUE: [u8; 3] = [40, 110, 240];
const BOTH: [u8; 3] = [60, 190, 90];

const HEAD: &str = "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>labelgs: scores</title>\n<style>\n\
    body { font-family: sans-serif; margin: 1em; background: #fff; color: #222 }\n\
    table { border-collapse: collapse }\n\
    td, th { padding: 4px 8px; text-align: left; vertical-align: top; border-bottom: 1px solid #ccc }\n\
    td img { width: 24vw; max-width: 480px; background: #000 }\n\
    .note { color: #b00020 }\n\
    </style>\n";

/// The page of a run. Pictures are written at once, the page itself by [`Page::finish`].
#[derive(Debug)]
pub struct Page {
    folder: PathBuf,
    rows: String,
    count: u32,
}

impl Page {
    /// Makes a page in `folder`, which is created. Refuses a folder with files, because pictures of another page would
    /// remain.
    pub fn new(folder: &Path) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(Error::write(folder))?;
        atomic::require_empty("page", folder)?;
        Ok(Self { folder: folder.to_owned(), rows: String::new(), count: 0 })
    }

    /// Writes `index.html`, with `summary` above the pictures.
    pub fn finish(self, summary: &str) -> Result<PathBuf> {
        let path = self.folder.join("index.html");
        let legend = "<p>Difference of masks: green is in both, red only in the prediction, blue only in the ground \
                      truth. Without a mask it is the absolute difference of colours.</p>";
        let head = "<tr><th>view</th><th>ground truth</th><th>prediction</th><th>difference</th></tr>";
        let body = format!(
            "{HEAD}<h1>labelgs: scores</h1>\n<pre>{}</pre>\n{legend}\n<table>\n{head}\n{}</table>\n</html>\n",
            escaped(summary),
            self.rows
        );
        atomic::write(&path, |out| out.write_all(body.as_bytes()))?;
        Ok(path)
    }

    fn picture(&self, kind: &str, picture: &Compared, pixels: &[[u8; 3]]) -> Result<String> {
        let name = format!("{:05}-{kind}.png", self.count);
        write_png_rgb8(self.folder.join(&name), picture.photo.width, picture.photo.height, pixels)?;
        Ok(name)
    }
}

impl Watch for Page {
    fn see(&mut self, picture: &Compared) -> Result<()> {
        self.count += 1;
        let [truth, prediction, difference] = panels(picture);
        let files = [("truth", truth), ("prediction", prediction), ("difference", difference)];
        let mut cells = String::new();
        for (kind, pixels) in files {
            let file = self.picture(kind, picture, &pixels)?;
            // Writing to a String cannot fail.
            let _ = write!(cells, "<td><img loading=\"lazy\" alt=\"{kind}\" src=\"{file}\"></td>");
        }
        let object = picture.object.as_deref().map_or(String::new(), |name| format!("<br><b>{}</b>", escaped(name)));
        let numbers: String =
            picture.numbers.iter().filter_map(|&(name, value)| Some(format!("<br>{name} {:.4}", value?))).collect();
        let note = if picture.note.is_empty() {
            String::new()
        } else {
            format!("<br><span class=\"note\">{}</span>", escaped(&picture.note))
        };
        let _ = writeln!(self.rows, "<tr><td>{}{object}{numbers}{note}</td>{cells}</tr>", escaped(picture.view));
        Ok(())
    }
}

fn panels(picture: &Compared) -> [Vec<[u8; 3]>; 3] {
    let pixels = picture.photo.rgba.len();
    let photo = |index: usize| {
        let [r, g, b, _] = picture.photo.rgba[index];
        [r, g, b]
    };
    let found = |index: usize| picture.rgb[index].map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8);
    let truth = |index: usize| match picture.masks {
        Some((_, truth)) if !truth[index] => [0; 3],
        _ => photo(index),
    };
    let difference = |index: usize| match picture.masks {
        Some((found, truth)) => match (found[index], truth[index]) {
            (true, true) => BOTH,
            (true, false) => ONLY_FOUND,
            (false, true) => ONLY_TRUE,
            (false, false) => photo(index).map(|value| value / 4),
        },
        None => std::array::from_fn(|channel| found(index)[channel].abs_diff(photo(index)[channel])),
    };
    [(0..pixels).map(truth).collect(), (0..pixels).map(found).collect(), (0..pixels).map(difference).collect()]
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
