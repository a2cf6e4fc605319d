//! Reads a model with the names of its labels, and writes it after an edit.

use crate::cli::support::context::Context;
use crate::cli::support::model_format::WriteArgs;
use crate::cli::support::parsers::{Picks, model_file, share};
use crate::cli::support::shell_words::quoted_path;
use crate::edit::Transform;
use crate::edit::catalogue::Catalogue;
use crate::edit::select::{MIN_LABEL_CONFIDENCE, Tally, extract};
use crate::files::label_table::LabelTable;
use crate::formats::{LazyModel, ModelRef, export_model};
use crate::run::models;
use crate::scene::gaussians::opacity_of;
use crate::scene::{Gaussians, UNLABELLED};
use crate::words::counted;
use crate::{Error, Result};
use clap::Args;
use glam::DVec3;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Source of the names of labels.
#[derive(Args, Clone, Debug, Default)]
pub struct TableArg {
    /// File with the names of labels. Default: MODEL.labels.json beside the model, labels.json of its run, or the names
    /// in the model file.
    #[arg(long, value_name = "FILE", help_heading = "Labels")]
    pub label_table: Option<PathBuf>,
}

impl TableArg {
    /// Reads the table of a model, if there is one; `own` are the names in its file.
    pub fn open(&self, model: &Path, own: Option<LabelTable>) -> Result<Option<LabelTable>> {
        self.file(model).map_or(Ok(own), |path| LabelTable::read(&path).map(Some))
    }

    /// Returns the file of the table, if there is one.
    pub(crate) fn file(&self, model: &Path) -> Option<PathBuf> {
        self.label_table.clone().or_else(|| LabelTable::find_for_model(model))
    }
}

/// Arguments of every edit of labels.
#[derive(Args, Clone, Debug)]
pub struct EditArgs {
    /// Model: a PLY, SPZ, GLB, SOG, USD or .splat file, or the output folder of `labelgs train`.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// File to write; its extension decides the format. Label names go to OUT.labels.json beside it.
    #[arg(short, long, value_name = "OUT.ply", value_parser = model_file())]
    pub output: PathBuf,
    #[command(flatten)]
    pub write: WriteArgs,
    #[command(flatten)]
    pub table: TableArg,
}

impl EditArgs {
    /// Opens the model and counts its labels.
    pub(crate) fn open(&self) -> Result<(Gaussians, Catalogue)> {
        open(&self.model, &self.table)
    }

    /// Finds labels of the model; a message about unknown ones says how to list them.
    pub(crate) fn resolve(&self, known: &Catalogue, argument: &str, picks: &Picks) -> Result<BTreeSet<u32>> {
        or_list(known.resolve(argument, &picks.0), &self.model)
    }

    /// Writes model and table of an edit and prints a summary. `more` holds further fields of the JSON.
    pub(crate) fn finish(&self, context: &Context, edited: &EditResult, more: Value) -> Result<()> {
        let EditResult { model, table, of, added, labels, note, alone, moved } = edited;
        let mut options = match alone {
            true => self.write.options_of_part(&self.model, &self.output, model)?,
            false => self.write.options(&self.model, &self.output)?,
        };
        options.first_view = options.first_view.map(|view| moved.map_or(view, |by| view.moved(&by)));
        let left_out = export_model(&self.output, model, table.as_ref(), options)?;
        let written = model.len() as u64 - left_out;
        let beside = LabelTable::path_beside(&self.output);
        let output = self.output.display();
        let mut result = json!({
            "schema_version": 1,
            "output": output.to_string(),
            "label_table": table.as_ref().filter(|_| beside.is_file()).map(|_| beside.display().to_string()),
            "labels": labels,
            "gaussians": written,
            "of": of,
        });
        if let (Some(result), Value::Object(more)) = (result.as_object_mut(), more) {
            result.extend(more);
        }
        let text = match (*of as u64 + added).checked_sub(written).filter(|_| *added > 0) {
            Some(removed) => {
                let count = counted(written, "Gaussian");
                format!("{output}: {count} ({removed} of {of} removed, {added} added)\n")
            }
            None => format!("{output}: {written} of {}{note}\n", counted(of, "Gaussian")),
        };
        context.show(&result, &text)
    }
}

/// The result of an edit.
pub(crate) struct EditResult<'a> {
    /// The model.
    pub model: &'a Gaussians,
    /// The names of its labels, if the source has names.
    pub table: Option<LabelTable>,
    /// Number of Gaussians of the source.
    pub of: usize,
    /// Number of Gaussians that the edit added.
    pub added: u64,
    /// Labels that were chosen or made.
    pub labels: BTreeSet<u32>,
    /// More about the result, for the terminal.
    pub note: String,
    /// The model is objects without their scene.
    pub alone: bool,
    /// Where the model is now.
    pub moved: Option<Transform>,
}

impl<'a> EditResult<'a> {
    /// The result of an edit that adds no Gaussians to the `of` before.
    pub(crate) fn new(model: &'a Gaussians, table: Option<LabelTable>, of: usize, labels: BTreeSet<u32>) -> Self {
        Self { model, table, of, added: 0, labels, note: String::new(), alone: false, moved: None }
    }

    /// The result of an edit that leaves the labels alone.
    pub(crate) fn with_labels_of(model: &'a Gaussians, known: Catalogue, of: usize) -> Self {
        Self::new(model, known.table, of, model.labels.iter().flatten().copied().collect())
    }
}

/// Confidence of the Gaussians of an object.
#[derive(Args, Clone, Copy, Debug)]
pub struct MinConfidenceArg {
    /// Minimum label confidence of a Gaussian to count as part of an object, for models with confidences.
    #[arg(
        long, value_name = "SHARE", value_parser = share, default_value_t = MIN_LABEL_CONFIDENCE,
        help_heading = "Labels"
    )]
    pub min_confidence: f32,
}

impl MinConfidenceArg {
    /// Returns the Gaussians of some labels with enough confidence. Fails if there is none.
    pub fn extract(&self, model: &Gaussians, labels: &[u32]) -> Result<Gaussians> {
        self.check(extract(model, labels, self.min_confidence)?)
    }

    /// The same from a model that may stay in its file; the labels occur in it.
    pub(crate) fn extract_seen(&self, path: &Path, model: ModelRef, labels: &BTreeSet<u32>) -> Result<Gaussians> {
        let mut numbers = Vec::new();
        models::scan(path, model, |number, row| {
            if labels.contains(&row.label.unwrap_or(UNLABELLED))
                && row.confidence.is_none_or(|share| share >= self.min_confidence)
            {
                numbers.push(number);
            }
        })?;
        self.check(model.rows(numbers.into_iter(), DVec3::ZERO)?)
    }

    fn check(&self, part: Gaussians) -> Result<Gaussians> {
        if part.is_empty() { Err(self.nothing()) } else { Ok(part) }
    }

    /// The error of a confidence that no Gaussian of the labels has.
    pub(crate) fn nothing(&self) -> Error {
        let problem =
            format!("no Gaussian of these labels has a confidence of {} or more; lower the value", self.min_confidence);
        Error::usage("--min-confidence", problem)
    }
}

/// Adds to an error about the labels of a model how to list them.
pub(crate) fn or_list<T>(found: Result<T>, model: &Path) -> Result<T> {
    found.map_err(|error| match error {
        Error::Usage { argument, problem } => {
            Error::usage(argument, format!("{problem} (run `labelgs list {}` to see all)", quoted_path(model)))
        }
        other => other,
    })
}

/// Refuses a model without labels.
pub(crate) fn require_labels(model: &Path, has_labels: bool) -> Result<()> {
    const PROBLEM: &str = "the model has no labels; train it with masks, or run `labelgs label`";
    if has_labels { Ok(()) } else { Err(Error::data(model, "", PROBLEM)) }
}

/// Opens a model and counts its labels.
pub(crate) fn open(model: &Path, table: &TableArg) -> Result<(Gaussians, Catalogue)> {
    let read = models::open(model)?;
    let known = Catalogue::new(&read.gaussians, table.open(model, read.names)?);
    Ok((read.gaussians, known))
}

/// A model that may stay in its file, with its labels.
pub(crate) struct LabelledModel {
    /// The model.
    pub model: LazyModel,
    /// The Gaussians of each label.
    pub tally: Tally,
    /// The labels.
    pub known: Catalogue,
}

/// Scans a model for its labels.
pub(crate) fn look(path: &Path, table: &TableArg) -> Result<LabelledModel> {
    let model = models::open_lazily(path)?;
    let (view, mut tally) = (model.view(), Tally::default());
    models::scan(path, view, |_, row| {
        let place = view.origin() + DVec3::from_array(row.position);
        tally.add(row.label.unwrap_or(UNLABELLED), place, opacity_of(row.opacity));
    })?;
    let known = Catalogue { gaussians: tally.counts(), table: table.open(path, model.names().cloned())? };
    Ok(LabelledModel { model, tally, known })
}
