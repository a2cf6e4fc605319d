//! Reads a model with the names of its labels, and writes it after an edit.

use crate::cli::support::args::JsonFlag;
use crate::cli::support::context::Context;
use crate::cli::support::model_format::WriteArgs;
use crate::cli::support::parsers::{model_file, share};
use crate::cli::support::shell_words::quoted;
use crate::cli::support::stdout;
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
use serde_json::json;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Source of the names of labels.
#[derive(Args, Clone, Debug, Default)]
pub struct TableArg {
    /// Table with the names of labels. Default: MODEL.labels.json beside the model, labels.json of its run, or the names in the
    /// file of the model.
    #[arg(long, value_name = "FILE", help_heading = "Labels")]
    pub label_table: Option<PathBuf>,
}

impl TableArg {
    /// Reads the table of a model, if there is one; `own` are the names in its file.
    pub fn open(&self, model: &Path, own: Option<LabelTable>) -> Result<Option<LabelTable>> {
        let path = self.label_table.clone().or_else(|| LabelTable::find_for_model(model));
        path.map_or(Ok(own), |path| LabelTable::read(&path).map(Some))
    }
}

/// Arguments of every edit of labels.
#[derive(Args, Clone, Debug)]
pub struct EditArgs {
    /// The model: a PLY, SPZ, GLB, SOG or .splat, or the folder of a `labelgs train` run.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// File to write; its ending is the format. Names of its labels go to OUT.labels.json beside it.
    #[arg(short, long, value_name = "OUT.ply", value_parser = model_file())]
    pub output: PathBuf,
    /// How it is written.
    #[command(flatten)]
    pub write: WriteArgs,
    /// Names.
    #[command(flatten)]
    pub table: TableArg,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

impl EditArgs {
    /// Returns where the result goes.
    pub(crate) fn target(&self, context: &Context) -> Target<'_> {
        Target::new((&self.model, &self.output), self.write, wants_json(context, &self.json))
    }

    /// Writes and prints the result of an edit that leaves the labels alone. `of` is the number of Gaussians before.
    pub(crate) fn finish(
        &self,
        context: &Context,
        (model, known): (&Gaussians, Catalogue),
        of: usize,
        more: serde_json::Value,
    ) -> Result<()> {
        let labels: BTreeSet<u32> = model.labels.iter().flatten().copied().collect();
        Edited { model, table: known.table, of, added: 0, labels: &labels }.finish(&self.target(context), more)
    }
}

/// Where the result of an edit goes.
#[derive(Clone, Copy)]
pub(crate) struct Target<'a> {
    /// The model that it is made of.
    pub model: &'a Path,
    /// File to write.
    pub output: &'a Path,
    /// How it is written.
    pub write: WriteArgs,
    /// The summary is printed as JSON.
    pub print_json: bool,
}

impl<'a> Target<'a> {
    pub(crate) fn new((model, output): (&'a Path, &'a Path), write: WriteArgs, print_json: bool) -> Self {
        Self { model, output, write, print_json }
    }
}

/// Which Gaussians an object consists of.
#[derive(Args, Clone, Copy, Debug)]
pub struct MinConfidenceArg {
    /// Least label_confidence of a Gaussian of a separate object, for models that have it.
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
        let problem = format!("no Gaussian of the labels has a confidence of {}; lower it", self.min_confidence);
        Error::usage("--min-confidence", problem)
    }
}

/// Adds to an error about the labels of a model how to list them.
pub(crate) fn or_list<T>(found: Result<T>, model: &Path) -> Result<T> {
    found.map_err(|error| match error {
        Error::Usage { argument, problem } => Error::usage(
            argument,
            format!("{problem} (labelgs list {} shows all)", quoted(&model.display().to_string())),
        ),
        other => other,
    })
}

/// Opens a model and counts its labels.
pub(crate) fn open(model: &Path, table: &TableArg) -> Result<(Gaussians, Catalogue)> {
    let read = models::open(model)?;
    let known = Catalogue::new(&read.gaussians, table.open(model, read.names)?);
    Ok((read.gaussians, known))
}

/// A model that may stay in its file, with its labels.
pub(crate) struct Seen {
    /// The model.
    pub model: LazyModel,
    /// The Gaussians of each label.
    pub tally: Tally,
    /// The labels.
    pub known: Catalogue,
}

/// Looks through a model for its labels.
pub(crate) fn look(path: &Path, table: &TableArg) -> Result<Seen> {
    let model = models::open_lazily(path)?;
    let (view, mut tally) = (model.view(), Tally::default());
    models::scan(path, view, |_, row| {
        let place = view.origin() + DVec3::from_array(row.position);
        tally.add(row.label.unwrap_or(UNLABELLED), place, opacity_of(row.opacity));
    })?;
    let known = Catalogue { gaussians: tally.counts(), table: table.open(path, model.names().cloned())? };
    Ok(Seen { model, tally, known })
}

/// The result of an edit.
pub(crate) struct Edited<'a> {
    /// The model.
    pub model: &'a Gaussians,
    /// The names of its labels, if the source has names.
    pub table: Option<LabelTable>,
    /// Number of Gaussians of the source.
    pub of: usize,
    /// Number of Gaussians that the source has not.
    pub added: u64,
    /// Labels that were chosen or made.
    pub labels: &'a BTreeSet<u32>,
}

impl Edited<'_> {
    /// Writes model and table and prints a summary. `more` holds further fields of the JSON.
    pub(crate) fn finish(&self, to: &Target, more: serde_json::Value) -> Result<()> {
        let left_out =
            export_model(to.output, self.model, self.table.as_ref(), to.write.options(to.model, to.output)?)?;
        let beside = LabelTable::beside(to.output);
        let written = self.model.len() as u64 - left_out;
        if to.print_json {
            let mut result = json!({
                "schema_version": 1,
                "output": to.output.display().to_string(),
                "label_table": self.table.as_ref().filter(|_| beside.is_file()).map(|_| beside.display().to_string()),
                "labels": self.labels,
                "gaussians": written,
                "of": self.of,
            });
            if let (Some(result), serde_json::Value::Object(more)) = (result.as_object_mut(), more) {
                result.extend(more);
            }
            return stdout::print_json(&result);
        }
        let (output, of, added) = (to.output.display(), self.of, self.added);
        match (of as u64 + added).checked_sub(written).filter(|_| added > 0) {
            Some(removed) => stdout::print(&format!(
                "{output}: {}: of {of} before, {removed} removed; {added} added\n",
                counted(written, "Gaussian")
            )),
            None => stdout::print(&format!("{output}: {written} of {}\n", counted(of as u64, "Gaussian"))),
        }
    }
}

/// Returns true if `--json` was typed before or after the command.
pub(crate) fn wants_json(context: &Context, here: &JsonFlag) -> bool {
    context.json || here.json
}
