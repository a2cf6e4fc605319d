//! `labelgs masks check`.

use super::open_photos;
use crate::cli::support::{Context, ReadArgs};
use crate::masks::check::{Finding, Problem};
use crate::masks::{Report, inspect};
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// `labelgs masks check`.
#[derive(Args, Clone, Debug)]
pub struct CheckArgs {
    /// Folder of id masks.
    #[arg(value_name = "MASKS")]
    pub masks: PathBuf,
    /// Scene with the photos of the masks.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// Prints the findings. Fails if there are any.
pub(crate) fn run(args: &CheckArgs, context: &Context) -> Result<()> {
    let dataset = open_photos(&args.scene, &args.read)?;
    let report = inspect(&dataset, &args.masks)?;
    let mut counts: BTreeMap<Problem, usize> = BTreeMap::new();
    report.findings.iter().for_each(|finding| *counts.entry(finding.problem).or_default() += 1);
    let [masks, scene] = [&args.masks, &args.scene].map(|path| path.display().to_string());
    let found = json!({ "schema_version": 1, "masks": masks, "scene": scene, "counts": counts, "report": report });
    context.show(&found, &table(args, &report))?;
    if report.findings.is_empty() {
        return Ok(());
    }
    let counts: Vec<String> = counts.iter().map(|(problem, count)| format!("{count} {}", problem.text())).collect();
    Err(Error::Check(format!("{masks}: {}", counts.join(", "))))
}

fn table(args: &CheckArgs, report: &Report) -> String {
    let (masks, photos, ids) = (report.masks, report.photos, report.ids.len());
    let mut text = format!("{}: {masks} masks for {photos} photos, {ids} ids\n", args.masks.display());
    if report.findings.is_empty() {
        return text + "no problems found\n";
    }
    text += &format!("{:>12} {:>16} {:>6}  details\n", "problem", "photo", "id");
    report.findings.iter().for_each(|finding| text += &line(finding));
    text
}

fn line(finding: &Finding) -> String {
    let view = finding.view.as_deref().unwrap_or("-");
    let id = finding.id.map_or("-".to_owned(), |id| id.to_string());
    format!("{:>12} {view:>16} {id:>6}  {}\n", finding.problem.text(), finding.text)
}
