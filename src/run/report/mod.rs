//! `report.html`: one run, or several side by side, in one file.
//!
//! A report needs only the files in the run folders, no scene or device, so it can be made again at any time.
//! [`guide::outputs`](crate::guide::outputs) lists what it shows.

mod costs;
mod curves;
mod head;
mod load;
mod objects;
mod views;

pub(crate) use load::json;

use crate::error::{Error, Result};
use crate::files::atomic;
use crate::report::chart::colour_class;
use crate::report::{page, section};
use load::ReportedRun;
use maud::{Markup, html};
use std::path::{Path, PathBuf};

/// Name of the report of one run, in its folder.
pub(crate) const REPORT_FILE: &str = "report.html";

/// Writes the report of the runs in `folders` to `path`, and returns `path`.
///
/// # Errors
///
/// A folder is not a run folder; a file in it cannot be read; the output cannot be written.
pub fn write(folders: &[PathBuf], path: &Path) -> Result<PathBuf> {
    write_with(folders, path, "")
}

/// Same as [`write`], with a text above the runs.
pub(crate) fn write_with(folders: &[PathBuf], path: &Path, text: &str) -> Result<PathBuf> {
    if folders.is_empty() {
        return Err(Error::usage("runs", "is empty; give the output folder of one or more runs"));
    }
    let mut runs = folders.iter().map(|folder| ReportedRun::read(folder)).collect::<Result<Vec<_>>>()?;
    load::tell_apart(&mut runs);
    let page = compose(&runs, text)?;
    atomic::write(path, |out| out.write_all(page.as_bytes()))?;
    Ok(path.to_owned())
}

fn compose(runs: &[ReportedRun], text: &str) -> Result<String> {
    let mut book = views::PictureBook::default();
    let (first, views) = views::views(&mut book, runs)?;
    let objects = objects::objects(&mut book, runs)?;
    let body = html! {
        (first)
        (head::numbers(runs))
        @if !text.is_empty() { div.scroll { pre { (text) } } }
        @if let Some(warnings) = head::warnings(runs) { (section("Warnings", &warnings)) }
        (section("Curves", &curves::curves(runs)))
        (section("Objects", &objects))
        (section("Views", &views))
        (section("Time and memory", &costs::costs(runs)))
        (section("Run and settings", &html! {
            details { summary { "Commands and inputs" } (head::what(runs)) }
            details { summary { "Settings" } (head::settings(runs)) }
        }))
    };
    Ok(page(&head::title(runs), &head::lead(runs), &body))
}

/// Returns a table with a column per run; rows without values are omitted.
fn columns(runs: &[ReportedRun], rows: &[(String, Vec<Option<String>>)]) -> Markup {
    let rows = rows.iter().filter(|(_, cells)| cells.iter().any(Option::is_some));
    html! {
        div.scroll {
            table {
                @if runs.len() > 1 {
                    thead { tr { th {} @for (index, run) in runs.iter().enumerate() { th { (run_name(index,
                    run)) } } } }
                }
                tbody {
                    @for (name, cells) in rows {
                        tr { th { (name) } @for cell in cells { td { (cell.as_deref().unwrap_or("–")) } } }
                    }
                }
            }
        }
    }
}

/// Returns a row of [`columns`].
fn row(
    runs: &[ReportedRun],
    name: &str,
    value: impl Fn(&ReportedRun) -> Option<String>,
) -> (String, Vec<Option<String>>) {
    (name.to_owned(), runs.iter().map(value).collect())
}

/// Returns the name of a run with its colour.
fn run_name(index: usize, run: &ReportedRun) -> Markup {
    html! { span.run { i class=(colour_class(index)) {} (run.name) } }
}
