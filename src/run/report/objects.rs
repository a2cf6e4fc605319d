//! A row for each object.

use super::load::Ran;
use super::run_name;
use crate::report::text::{count, number};
use crate::run::ObjectSummary;
use crate::scene::labels::label_colour;
use maud::{Markup, html};
use std::collections::BTreeMap;

/// Returns the table of all objects.
pub(super) fn objects(runs: &[Ran]) -> Markup {
    let of = |run: &Ran| run.metrics.as_ref().map(|metrics| metrics.objects.clone()).unwrap_or_default();
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
        return html! { p.quiet { "There are none: the run has no masks, or has not ended." } };
    }
    match all.as_slice() {
        [one] => single(one.values()),
        _ => several(runs, &all, &ids),
    }
}

fn single<'a>(objects: impl Iterator<Item = &'a ObjectSummary>) -> Markup {
    html! {
        div.scroll {
            table.sortable.wide {
                thead {
                    tr {
                        th { "object" } th.right { "id" } th.right { "Gaussians" } th.right { "confidence" }
                        th.right { "IoU" } th.right { "PSNR, dB" } th { "worst view" } th.right { "IoU there" }
                    }
                }
                tbody {
                    @for object in objects {
                        tr {
                            (title(object.id, object.name.as_deref()))
                            (cell(Some(f64::from(object.id)), 0))
                            td.right data-value=(object.gaussians) { (count(object.gaussians)) }
                            (cell(object.confidence, 3))
                            (cell(object.iou, 4))
                            (cell(object.psnr, 2))
                            td { (object.worst_view.as_deref().unwrap_or("–")) }
                            (cell(object.worst_iou, 4))
                        }
                    }
                }
            }
        }
    }
}

/// IoU, PSNR and Gaussians by run.
fn several(runs: &[Ran], all: &[BTreeMap<u32, ObjectSummary>], ids: &[(u32, Option<String>)]) -> Markup {
    html! {
        div.scroll {
            table.sortable {
                thead {
                    tr {
                        th { "object" } th.right { "id" }
                        @for (index, run) in runs.iter().enumerate() { th.right { "IoU " (run_name(index, run)) } }
                        @for (index, run) in runs.iter().enumerate() { th.right { "PSNR " (run_name(index, run)) } }
                    }
                }
                tbody {
                    @for (id, name) in ids {
                        tr {
                            (title(*id, name.as_deref()))
                            (cell(Some(f64::from(*id)), 0))
                            @for run in all { (cell(run.get(id).and_then(|object| object.iou), 4)) }
                            @for run in all { (cell(run.get(id).and_then(|object| object.psnr), 2)) }
                        }
                    }
                }
            }
        }
    }
}

/// The colour and name of an object.
fn title(id: u32, name: Option<&str>) -> Markup {
    let [r, g, b] = label_colour(id);
    let name = name.map_or_else(|| format!("object {id}"), str::to_owned);
    html! { td data-value=(name) { i.swatch style=(format!("background:rgb({r},{g},{b})")) {} " " (name) } }
}

/// A number that tables are sorted by.
fn cell(value: Option<f64>, digits: usize) -> Markup {
    let key = value.map_or(String::new(), |value| value.to_string());
    html! { td.right data-value=(key) { (number(value, digits)) } }
}
