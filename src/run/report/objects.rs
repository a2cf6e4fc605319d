//! The object table.

use super::load::ReportedRun;
use super::run_name;
use super::views::PictureBook;
use crate::Result;
use crate::report::text::{DECIBEL_DIGITS, SCORE_DIGITS, count, number};
use crate::run::{ObjectSummary, thumbnails};
use crate::scene::labels::label_colour;
use maud::{Markup, html};
use std::collections::BTreeMap;

/// Returns the table of all objects.
pub(super) fn objects(book: &mut PictureBook, runs: &[ReportedRun]) -> Result<Markup> {
    let of = |run: &ReportedRun| run.metrics.as_ref().map(|metrics| metrics.objects.clone()).unwrap_or_default();
    let all: Vec<BTreeMap<u32, ObjectSummary>> =
        runs.iter().map(|run| of(run).into_iter().map(|object| (object.id, object)).collect()).collect();
    let mut ids: Vec<(u32, Option<String>)> = Vec::new();
    for object in all.iter().flat_map(BTreeMap::values) {
        match ids.iter_mut().find(|row| row.0 == object.id) {
            Some(row) => row.1 = row.1.take().or(object.name.clone()),
            None => ids.push((object.id, object.name.clone())),
        }
    }
    ids.sort();
    if ids.is_empty() {
        return Ok(html! { p.quiet { "No objects: the run has no masks, or has not finished." } });
    }
    // Objects look the same in all runs.
    let mut pictures = BTreeMap::new();
    for &(id, _) in &ids {
        for run in runs {
            if let Some(source) = book.source(&thumbnails::path(&run.folder, id))? {
                pictures.insert(id, source);
                break;
            }
        }
    }
    Ok(match all.as_slice() {
        [one] => single(one.values(), &pictures),
        _ => several(runs, &all, &ids, &pictures),
    })
}

/// Pictures by object.
type Pictures = BTreeMap<u32, String>;

fn single<'a>(objects: impl Iterator<Item = &'a ObjectSummary>, pictures: &Pictures) -> Markup {
    html! {
        div.scroll {
            table.sortable.wide.cards.pictured[!pictures.is_empty()] {
                thead {
                    tr {
                        th { "Object" } th.right { "Label" } th.right { "Gaussians" } th.right { "Confidence" }
                        th.right { "IoU" } th.right { "PSNR, dB" } th.right { "Worst IoU" } th.right { "in view" }
                    }
                }
                tbody {
                    @for object in objects {
                        @let worst = object.worst_view.as_deref().unwrap_or("–");
                        tr {
                            (title(object.id, object.name.as_deref(), pictures))
                            (cell("Label", Some(f64::from(object.id)), 0))
                            td.right data-title="Gaussians" data-value=(object.gaussians) { (count(object.gaussians)) }
                            (cell("Confidence", object.confidence, SCORE_DIGITS))
                            (cell("IoU", object.iou, SCORE_DIGITS))
                            (cell("PSNR, dB", object.psnr, DECIBEL_DIGITS))
                            (cell("Worst IoU", object.worst_iou, SCORE_DIGITS))
                            td.right data-title="in view" { (worst) }
                        }
                    }
                }
            }
        }
    }
}

/// IoU, PSNR and Gaussians by run.
fn several(
    runs: &[ReportedRun],
    all: &[BTreeMap<u32, ObjectSummary>],
    ids: &[(u32, Option<String>)],
    pictures: &Pictures,
) -> Markup {
    html! {
        div.scroll {
            table.sortable.pictured[!pictures.is_empty()] {
                thead {
                    tr {
                        th { "Object" } th.right { "Label" }
                        @for (index, run) in runs.iter().enumerate() { th.right { "IoU " (run_name(index, run)) } }
                        @for (index, run) in runs.iter().enumerate() { th.right { "PSNR, dB " (run_name(index, run)) } }
                    }
                }
                tbody {
                    @for (id, name) in ids {
                        tr {
                            (title(*id, name.as_deref(), pictures))
                            (cell("Label", Some(f64::from(*id)), 0))
                            @for run in all { (cell("IoU", run.get(id).and_then(|object| object.iou), SCORE_DIGITS)) }
                            @for run in all { (cell("PSNR, dB", run.get(id).and_then(|object| object.psnr), DECIBEL_DIGITS)) }
                        }
                    }
                }
            }
        }
    }
}

/// The picture, colour and name of an object.
fn title(id: u32, name: Option<&str>, pictures: &Pictures) -> Markup {
    let [r, g, b] = label_colour(id);
    let name = name.map_or_else(|| format!("object {id}"), str::to_owned);
    html! {
        td data-value=(name) {
            @if let Some(source) = pictures.get(&id) { img.thumb alt="" loading="lazy" src=(source); }
            i.swatch style=(format!("background:rgb({r},{g},{b})")) {} " " (name)
        }
    }
}

/// A sortable number, with its column title for narrow screens.
fn cell(title: &str, value: Option<f64>, digits: usize) -> Markup {
    let key = value.map_or(String::new(), |value| value.to_string());
    html! { td.right data-title=(title) data-value=(key) { (number(value, digits)) } }
}
