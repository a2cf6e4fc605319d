//! `labelgs check`: problems in the photos, found before training.

use crate::cli::support::{Context, ReadArgs};
use crate::scenes::capture::{CaptureProblem, Finding, Report, scan};
use crate::scenes::{self, LoadOptions};
use crate::words::counted;
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// `labelgs check`.
#[derive(Args, Clone, Debug)]
pub struct CheckArgs {
    /// Scene: a folder (COLMAP, transforms.json, poses_bounds.npy, Metashape) or a .json, .npy or .xml file.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// Prints what the scan finds. Fails if it finds a fault.
pub(crate) fn run(args: &CheckArgs, context: &Context) -> Result<()> {
    // It looks at the photos in full size, few times: a file of their pixels would cost more than it saves.
    // What is missing or damaged is a finding.
    // Surroundings that are transparent are none.
    let options = LoadOptions {
        test_every: None,
        photo_folder: None,
        max_bad_photos: 1.0,
        keep_opacity: true,
        ..LoadOptions::default()
    };
    let dataset = scenes::open(&args.scene, &args.read.options(options))?;
    let is_found = |note: &&String| dataset.flaws.iter().any(|flaw| flaw.text() == *note);
    dataset.notes.iter().filter(|note| !is_found(note)).for_each(|note| tracing::warn!("{note}"));
    let report = scan(&args.scene, &args.read.lookup(), &dataset)?;
    let mut counts: BTreeMap<CaptureProblem, usize> = BTreeMap::new();
    report.findings.iter().for_each(|finding| *counts.entry(finding.fault).or_default() += 1);
    let scene = args.scene.display().to_string();
    let found = json!({ "schema_version": 1, "scene": scene, "counts": counts, "report": report });
    context.show(&found, &table(&report))?;
    if report.findings.is_empty() {
        return Ok(());
    }
    let counts: Vec<String> = counts.iter().map(|(fault, count)| format!("{count} {}", fault.text())).collect();
    Err(Error::Check(format!("{scene}: {}", counts.join(", "))))
}

fn table(report: &Report) -> String {
    let number = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:.2}"));
    let views = report.views.len();
    let in_views = if views == report.photos { String::new() } else { format!(" in {}", counted(views, "view")) };
    let mut text = format!(
        "{}{in_views}, {}, extent {:.3}; reprojection error {} px, brightest / darkest photo {}\n",
        counted(report.photos, "photo"),
        counted(report.points, "point"),
        report.extent,
        number(report.reprojection),
        number(report.gain_spread)
    );
    if report.findings.is_empty() {
        return text + "no problems found\n";
    }
    text += &format!("{:>12} {:>20}  details\n", "problem", "photo");
    for finding in &report.findings {
        let view = finding.view.as_deref().unwrap_or("-");
        text +=
            &format!("{:>12} {view:>20}  {}; {}{}\n", finding.fault.text(), finding.text, finding.cure, typed(finding));
    }
    text
}

/// Returns the command of a cure that is one.
fn typed(finding: &Finding) -> &'static str {
    match finding.fault {
        CaptureProblem::Surroundings => ": labelgs train SCENE --masks DIR --masked-only -o OUT",
        _ => "",
    }
}
