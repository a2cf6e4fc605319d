//! Pictures of held-out views.

use super::load::Ran;
use crate::error::Result;
use crate::files::read;
use crate::report::text::number;
use crate::report::{Figure, Panel};
use crate::run::info::Pictured;
use crate::run::pictures::{KINDS, path};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

/// Most bytes of all pictures in a page, before they become text.
const BYTES_MAX: u64 = 12 << 20;

/// Returns the pictures, the worst views first.
pub(super) fn views(runs: &[Ran]) -> Result<Markup> {
    let mut book = Book::default();
    let figures = match runs {
        [run] => run.info.pictures.iter().map(|view| single(&mut book, run, view)).collect::<Result<Vec<_>>>()?,
        _ => several(&mut book, runs)?,
    };
    let figures: Vec<&Figure> = figures.iter().filter(|figure| !figure.panels.is_empty()).collect();
    Ok(html! {
        @if figures.is_empty() { p.quiet { "There are no pictures: the run has not ended, or holds out no views." } }
        @else { p.quiet { "The held-out views with the lowest PSNR." } }
        @for figure in figures { (figure.markup()) }
        @if book.is_full { p.quiet { "More pictures would make this page too large." } }
    })
}

fn single(book: &mut Book, run: &Ran, view: &Pictured) -> Result<Figure> {
    let mut panels = Vec::new();
    for (name, file) in KINDS {
        panels.extend(book.panel(run, view.number, file, name)?);
    }
    let numbers = [("PSNR", view.psnr, 2, " dB"), ("SSIM", view.ssim, 4, ""), ("IoU", view.iou, 4, "")];
    let numbers = numbers.into_iter().filter(|(_, value, ..)| value.is_some());
    let numbers = numbers.map(|(name, value, digits, unit)| (name.to_owned(), number(value, digits) + unit)).collect();
    Ok(Figure { view: view.view.clone(), numbers, panels, ..Figure::default() })
}

/// The photo of each view, and what each run makes of it.
fn several(book: &mut Book, runs: &[Ran]) -> Result<Vec<Figure>> {
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
                figure.panels.extend(book.panel(run, view.number, KINDS[0].1, KINDS[0].0)?);
            }
            figure.panels.extend(book.panel(run, view.number, KINDS[1].1, &run.name)?);
            figure.numbers.push((run.name.clone(), number(view.psnr, 2) + " dB"));
        }
        figures.push(figure);
    }
    Ok(figures)
}

/// The pictures of a page.
#[derive(Default)]
struct Book {
    bytes: u64,
    is_full: bool,
}

impl Book {
    /// Returns a picture of a view if there is one, and room for it.
    fn panel(&mut self, run: &Ran, number: u32, file: &str, name: &str) -> Result<Option<Panel>> {
        let path = path(&run.folder, number, file);
        let Ok(found) = std::fs::metadata(&path) else { return Ok(None) };
        if !found.is_file() || self.is_full || self.bytes + found.len() > BYTES_MAX {
            self.is_full |= found.is_file();
            return Ok(None);
        }
        let bytes = read::bytes(&path)?;
        self.bytes += bytes.len() as u64;
        let kind = if file.ends_with(".png") { "png" } else { "jpeg" };
        let source = format!("data:image/{kind};base64,{}", STANDARD.encode(bytes));
        Ok(Some(Panel { name: name.to_owned(), source }))
    }
}
