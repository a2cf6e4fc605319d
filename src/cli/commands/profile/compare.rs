//! `labelgs profile --compare`: two profiles side by side.

use crate::cli::support::stdout;
use crate::files::read;
use crate::{Error, Result};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// The compared part of the JSON.
#[derive(Deserialize)]
struct File {
    steps: Vec<Step>,
    #[serde(default)]
    counters: BTreeMap<String, Counter>,
    #[serde(flatten)]
    about: BTreeMap<String, Value>,
}

#[derive(Deserialize)]
struct Step {
    first_run: Option<bool>,
    stages_ms: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
struct Counter {
    median: Option<f64>,
}

/// A file of `labelgs profile --json`.
pub struct Profile {
    /// Times of each stage in every counted step, ms; `all` is their sum.
    pub samples: BTreeMap<String, Vec<f64>>,
    counters: BTreeMap<String, Counter>,
    about: BTreeMap<String, Value>,
}

impl Profile {
    /// Reads a profile.
    pub fn read(path: &Path) -> Result<Self> {
        const EXPECTED: &str = "expected the steps with stages_ms that labelgs profile --json writes";
        let File { steps, counters, about } = read::json(path, EXPECTED)?;
        let mut samples: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for step in steps.into_iter().filter(|step| step.first_run == Some(false)) {
            samples.entry("all".to_owned()).or_default().push(step.stages_ms.values().sum());
            step.stages_ms.into_iter().for_each(|(name, time)| samples.entry(name).or_default().push(time));
        }
        if samples.is_empty() {
            return Err(Error::data(path, "steps", EXPECTED));
        }
        Ok(Self { samples, counters, about })
    }
}

/// A stage in both profiles.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the stage.
    pub stage: String,
    /// Median of the steps, ms, before and after.
    pub median: [f64; 2],
    /// True if it became slower beyond noise.
    pub regressed: bool,
}

/// Prints stages and counters of both profiles. Fails if a stage became slower beyond noise: its median grew by more
/// than `tolerance` (a share), and its lower quartile exceeds the old upper quartile.
pub(crate) fn run(files: [&Path; 2], tolerance: f64, as_json: bool) -> Result<()> {
    let [old, new] = [Profile::read(files[0])?, Profile::read(files[1])?];
    for what in ["device", "kernels", "labels", "size", "views", "worker_threads", "barrier_before_each_pass"] {
        let [old, new] = [&old, &new].map(|profile| profile.about.get(what).unwrap_or(&Value::Null));
        if old != new {
            tracing::warn!("the profiles differ in {what}: {old} and {new}");
        }
    }
    let rows = compare(&old.samples, &new.samples, tolerance);
    let counters = counters(&old, &new);
    if as_json {
        let row = |row: &Row| json!({ "stage": row.stage, "before_ms": row.median[0], "after_ms": row.median[1], "regressed": row.regressed });
        stdout::print_json(&json!({
            "schema_version": 1,
            "tolerance": tolerance,
            "stages": rows.iter().map(row).collect::<Vec<_>>(),
            "counters": counters.iter().map(|(name, pair)| (name.clone(), json!(pair))).collect::<serde_json::Map<_, _>>(),
        }))?;
    } else {
        stdout::print(&text(&rows, &counters))?;
    }
    let slower: Vec<&str> = rows.iter().filter(|row| row.regressed).map(|row| row.stage.as_str()).collect();
    if slower.is_empty() { Ok(()) } else { Err(Error::Check(format!("slower beyond noise: {}", slower.join(", ")))) }
}

/// Returns the stages that both profiles have.
pub fn compare(old: &BTreeMap<String, Vec<f64>>, new: &BTreeMap<String, Vec<f64>>, tolerance: f64) -> Vec<Row> {
    let row = |(stage, before): (&String, &Vec<f64>)| {
        let after = new.get(stage)?;
        let median = [quantile(before, 0.5), quantile(after, 0.5)];
        let apart = quantile(after, 0.25) > quantile(before, 0.75);
        Some(Row { stage: stage.clone(), median, regressed: apart && median[1] > median[0] * (1.0 + tolerance) })
    };
    old.iter().filter_map(row).collect()
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((sorted.len().saturating_sub(1) as f64 * share).round() as usize).copied().unwrap_or(f64::NAN)
}

/// Returns the medians of the counters that both profiles have.
fn counters(old: &Profile, new: &Profile) -> Vec<(String, [f64; 2])> {
    let both = old.counters.iter().filter_map(|(name, old)| Some((name, old.median?, new.counters.get(name)?.median?)));
    both.map(|(name, old, new)| (name.clone(), [old, new])).collect()
}

fn text(rows: &[Row], counters: &[(String, [f64; 2])]) -> String {
    let mut text = format!("{:<24} {:>14} {:>14} {:>8}\n", "stage, median ms", "before", "after", "ratio");
    for row in rows {
        let [before, after] = row.median;
        let mark = if row.regressed { "  slower" } else { "" };
        text += &format!("{:<24} {before:>14.3} {after:>14.3} {:>8.3}{mark}\n", row.stage, after / before);
    }
    for (name, [before, after]) in counters {
        text += &format!("{name:<24} {before:>14.0} {after:>14.0} {:>8.3}\n", after / before);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::compare;

    #[test]
    fn slower_is_what_leaves_the_noise() {
        let noisy =
            |base: f64| [("blend".to_owned(), (0..40).map(|i| base + f64::from(i % 10) * 0.1).collect())].into();
        let regressed =
            |before: f64, after: f64, tolerance: f64| compare(&noisy(before), &noisy(after), tolerance)[0].regressed;
        assert!(!regressed(5.0, 5.0, 0.05));
        assert!(!regressed(5.0, 5.3, 0.05), "within the spread of the steps");
        assert!(regressed(5.0, 6.0, 0.05));
        assert!(!regressed(5.0, 6.0, 0.3), "within what is tolerated");
        assert!(!regressed(6.0, 5.0, 0.05), "faster");
        assert_eq!(compare(&noisy(5.0), &[("other".to_owned(), vec![1.0])].into(), 0.05), [], "in both, or not at all");
    }
}
