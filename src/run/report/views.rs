//! Pictures of held-out views.

use super::load::ReportedRun;
use crate::error::Result;
use crate::files::read;
use crate::report::text::{DECIBEL_DIGITS, SCORE_DIGITS, number};
use crate::report::{Figure, Panel};
use crate::run::info::PicturedView;
use crate::run::pictures::{HEAT_MAP_FILE, PICTURE_KINDS, path};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use std::path::Path;

/// Names of the pictures that are shown immediately.
const FIRST_KINDS: [&str; 3] = [PICTURE_KINDS[0].0, PICTURE_KINDS[1].0, PICTURE_KINDS[2].0];
/// Most bytes of all pictures in a page, before base64 encoding.
const BYTES_MAX: u64 = 12 << 20;

/// Returns the first figure, and the other pictures.
pub(super) fn views(book: &mut PictureBook, runs: &[ReportedRun]) -> Result<(Markup, Markup)> {
    let mut figures = match runs {
        [run] => run.info.pictures.iter().map(|view| single(book, run, view)).collect::<Result<Vec<_>>>()?,
        _ => several(book, runs)?,
    };
    figures.retain(|figure| !figure.panels.is_empty());
    // Neither the worst nor the best view represents the run, so show the median.
    let middle = figures.len() / 2;
    let first = (!figures.is_empty()).then(|| Figure { is_large: true, ..figures.remove(middle) });
    let rest = html! {
        @if first.is_none() { p.quiet { "No images: the run has not finished, or has no held-out views." } }
        @else if figures.is_empty() { p.quiet { "All images are at the top." } }
        @else { p.quiet { "Other held-out views, lowest PSNR first." } }
        @for figure in &figures { (figure.markup()) }
        @if book.is_full { p.quiet { "The remaining images are left out to limit the size of this page." } }
    };
    Ok((html! { @if let Some(first) = first { (first.markup()) } }, rest))
}

fn single(book: &mut PictureBook, run: &ReportedRun, view: &PicturedView) -> Result<Figure> {
    let mut panels = Vec::new();
    for (name, file) in PICTURE_KINDS {
        panels.extend(book.panel(run, view.number, file, name)?);
    }
    let numbers = [
        ("PSNR", view.psnr, DECIBEL_DIGITS, " dB"),
        ("SSIM", view.ssim, SCORE_DIGITS, ""),
        ("IoU", view.iou, SCORE_DIGITS, ""),
    ];
    let numbers = numbers.into_iter().filter(|(_, value, ..)| value.is_some());
    let numbers = numbers.map(|(name, value, digits, unit)| (name.to_owned(), number(value, digits) + unit)).collect();
    // Masks and errors are folded.
    let (more, panels) = panels.into_iter().partition(|panel: &Panel| !FIRST_KINDS.contains(&panel.name.as_str()));
    Ok(Figure { view: view.view.clone(), numbers, panels, more, ..Figure::default() })
}

/// The photo of each view, and each run's pictures of it.
fn several(book: &mut PictureBook, runs: &[ReportedRun]) -> Result<Vec<Figure>> {
    let mut names: Vec<&str> = Vec::new();
    for view in runs.iter().flat_map(|run| &run.info.pictures) {
        if !names.contains(&view.view.as_str()) {
            names.push(&view.view);
        }
    }
    let mut figures = Vec::new();
    for name in names {
        let mut figure = Figure { view: name.to_owned(), ..Figure::default() };
        for run in runs {
            let Some(view) = run.info.pictures.iter().find(|view| view.view == name) else { continue };
            if figure.panels.is_empty() {
                figure.panels.extend(book.panel(run, view.number, PICTURE_KINDS[0].1, PICTURE_KINDS[0].0)?);
            }
            figure.panels.extend(book.panel(run, view.number, PICTURE_KINDS[1].1, &run.name)?);
            figure.numbers.push((run.name.clone(), number(view.psnr, DECIBEL_DIGITS) + " dB"));
        }
        figures.push(figure);
    }
    Ok(figures)
}

/// The pictures of a page.
#[derive(Default)]
pub(super) struct PictureBook {
    bytes: u64,
    is_full: bool,
}

impl PictureBook {
    /// Returns a picture of a view, if it exists and fits into the page.
    fn panel(&mut self, run: &ReportedRun, number: u32, file: &str, name: &str) -> Result<Option<Panel>> {
        let source = self.source(&path(&run.folder, number, file))?;
        Ok(source.map(|source| Panel { name: name.to_owned(), source, is_heat: file == HEAT_MAP_FILE }))
    }

    /// Returns the in-page address of a picture, if it exists and fits into the page.
    pub(super) fn source(&mut self, path: &Path) -> Result<Option<String>> {
        let Ok(found) = std::fs::metadata(path) else { return Ok(None) };
        if !found.is_file() || self.is_full || self.bytes + found.len() > BYTES_MAX {
            self.is_full |= found.is_file();
            return Ok(None);
        }
        let bytes = read::bytes(path)?;
        self.bytes += bytes.len() as u64;
        let kind = if path.extension().is_some_and(|ending| ending == "png") { "png" } else { "jpeg" };
        Ok(Some(format!("data:image/{kind};base64,{}", STANDARD.encode(bytes))))
    }
}
