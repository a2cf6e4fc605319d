//! An HTML page with ground truth, prediction and difference of every scored picture, in a folder with its PNGs.

use super::compared::{PictureObserver, ScoredPicture};
use crate::files::atomic;
use crate::files::image::write_png_rgb8;
use crate::report::panels::heat;
use crate::report::text::{DECIBEL_DIGITS, SCORE_DIGITS};
use crate::report::{Figure, Panel, page, section};
use crate::scene::colour::to_byte;
use crate::{Error, Result};
use maud::{Markup, PreEscaped, html};
use std::path::{Path, PathBuf};

/// Colours in the difference of two masks.
const ONLY_PREDICTED_COLOUR: [u8; 3] = [230, 60, 40];
const ONLY_TRUE_COLOUR: [u8; 3] = [40, 110, 240];
const IN_BOTH_COLOUR: [u8; 3] = [60, 190, 90];

/// The page of an evaluation. Pictures are written immediately, the page itself by [`Page::finish`].
#[derive(Debug)]
pub struct Page {
    folder: PathBuf,
    figures: String,
    count: u32,
}

impl Page {
    /// Makes a page in `folder`, which is created. Refuses a folder with files, so that no pictures of another page
    /// remain.
    pub fn new(folder: &Path) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(Error::write(folder))?;
        atomic::require_empty("page", folder)?;
        Ok(Self { folder: folder.to_owned(), figures: String::new(), count: 0 })
    }

    /// Writes `index.html`, with `summary` above the pictures.
    pub fn finish(self, summary: &Markup) -> Result<PathBuf> {
        let path = self.folder.join("index.html");
        let pictures = html! {
            p.quiet {
                "Green is in both masks, red only in the prediction, blue only in the ground truth. Errors are mean \
                 absolute differences of the channels, which go from 0 to 1."
            }
            // Escaped by `Figure::markup`.
            (PreEscaped(&self.figures))
        };
        let body = html! { (summary) (section("Images", &pictures)) };
        let page = page("Scores", &html! { p.quiet { "A labelgs model compared with its ground truth." } }, &body);
        atomic::write(&path, |out| out.write_all(page.as_bytes()))?;
        Ok(path)
    }

    fn picture(&self, kind: &str, picture: &ScoredPicture, pixels: &[[u8; 3]]) -> Result<String> {
        let name = format!("{:05}-{kind}.png", self.count);
        write_png_rgb8(self.folder.join(&name), picture.photo.width, picture.photo.height, pixels)?;
        Ok(name)
    }
}

impl PictureObserver for Page {
    fn observe(&mut self, picture: &ScoredPicture) -> Result<()> {
        self.count += 1;
        let kinds = [("truth", "ground truth"), ("prediction", "prediction"), ("difference", "difference")];
        let mut panels = Vec::new();
        for ((kind, name), pixels) in kinds.into_iter().zip(pixels(picture)) {
            let is_heat = kind == "difference" && picture.masks.is_none();
            let name = if is_heat { "error" } else { name };
            panels.push(Panel { name: name.to_owned(), source: self.picture(kind, picture, &pixels)?, is_heat });
        }
        let number = |&(name, value): &(&str, Option<f64>)| Some((name.to_owned(), score_text(name, value?)));
        let figure = Figure {
            view: picture.view.to_owned(),
            object: picture.object.clone(),
            numbers: picture.numbers.iter().filter_map(number).collect(),
            note: picture.note.clone(),
            panels,
            ..Figure::default()
        };
        self.figures += &figure.markup().into_string();
        Ok(())
    }
}

/// Formats a score with unit.
fn score_text(name: &str, value: f64) -> String {
    let is_decibels = name.to_lowercase().contains("psnr");
    if is_decibels { format!("{value:.DECIBEL_DIGITS$} dB") } else { format!("{value:.SCORE_DIGITS$}") }
}

/// Ground truth, prediction and difference.
fn pixels(picture: &ScoredPicture) -> [Vec<[u8; 3]>; 3] {
    let (photo, found) = (picture.photo.rgb(), picture.rgb.iter().map(|colour| colour.map(to_byte)).collect());
    let Some((inside, outline)) = picture.masks else {
        return [photo, found, heat(picture.photo, picture.rgb)];
    };
    let truth = photo.iter().zip(outline).map(|(&colour, &inside)| if inside { colour } else { [0; 3] }).collect();
    let difference = |index: usize| match (inside[index], outline[index]) {
        (true, true) => IN_BOTH_COLOUR,
        (true, false) => ONLY_PREDICTED_COLOUR,
        (false, true) => ONLY_TRUE_COLOUR,
        (false, false) => photo[index].map(|value| value / 4),
    };
    [truth, found, (0..photo.len()).map(difference).collect()]
}
