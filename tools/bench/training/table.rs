//! Trainings as a table: a line per kind and length, with means and ranges over seeds.

use super::rows::Row;

/// All seeds of a scene, a kind and a length.
pub(super) struct Group<'a> {
    pub scene: &'a str,
    kind: &'a str,
    pub steps: u32,
    pub rows: Vec<&'a Row>,
}

impl Group<'_> {
    fn values(&self, of: impl Fn(&Row) -> Option<f64>) -> Vec<f64> {
        self.rows.iter().filter_map(|row| of(row)).collect()
    }

    fn mean(&self, of: impl Fn(&Row) -> Option<f64>) -> Option<f64> {
        let values = self.values(of);
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// Formats mean, minimum and maximum.
    pub fn cell(&self, digits: usize, of: impl Fn(&Row) -> Option<f64>) -> String {
        let values = self.values(of);
        if values.is_empty() {
            return "-".to_owned();
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        match values.len() {
            1 => format!("{mean:.digits$}"),
            _ => format!("{mean:.digits$} ({least:.digits$} to {most:.digits$})"),
        }
    }
}

/// Groups rows in the order of their first occurrence.
pub(super) fn groups(rows: &[Row]) -> Vec<Group<'_>> {
    let mut found: Vec<Group> = Vec::new();
    for row in rows {
        let key = (row.scene.as_str(), row.program.as_str(), row.steps);
        match found.iter_mut().find(|group| (group.scene, group.kind, group.steps) == key) {
            Some(group) => group.rows.push(row),
            None => found.push(Group { scene: key.0, kind: key.1, steps: key.2, rows: vec![row] }),
        }
    }
    found
}

/// Returns the decisive score: PSNR where training can know the image, otherwise over whole views.
fn score(row: &Row) -> Option<f64> {
    row.psnr_seen.or(Some(row.psnr))
}

/// Returns (CPU seconds, score) of a kind on a scene, by length.
fn curve(groups: &[Group], scene: &str, kind: &str) -> Vec<(f64, f64)> {
    let own = groups.iter().filter(|group| (group.scene, group.kind) == (scene, kind));
    let mut curve: Vec<(f64, f64)> =
        own.filter_map(|group| Some((group.mean(|row| Some(row.cpu))?, group.mean(score)?))).collect();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    curve
}

/// Returns the CPU seconds at which a curve first reaches a score, linear in the logarithm of time; `None` if it never
/// does.
fn reached(curve: &[(f64, f64)], score: f64) -> Option<f64> {
    let mut before: Option<(f64, f64)> = None;
    for &(cpu, found) in curve {
        if found >= score {
            let Some((from, low)) = before else { return Some(cpu) };
            let part = ((score - low) / (found - low)).clamp(0.0, 1.0);
            return Some((from.ln() + part * (cpu.ln() - from.ln())).exp());
        }
        before = Some((cpu, found));
    }
    None
}

/// Returns the table. The last column is the time in which a kind reaches the score of the longest training of `other`,
/// relative to that training.
pub fn rows_of(rows: &[Row], other: &str) -> Vec<Vec<String>> {
    let groups = groups(rows);
    let head = [
        "scene",
        "training",
        "steps",
        "CPU s",
        "Gaussians",
        "PSNR",
        "PSNR seen",
        "worst view",
        "SSIM",
        "IoU map",
        "IoU object",
        "time to other's",
    ];
    let mut table = vec![head.map(str::to_owned).to_vec()];
    for group in &groups {
        let goal = curve(&groups, group.scene, other).last().copied();
        let own = curve(&groups, group.scene, group.kind);
        let is_last = own.last().map(|end| end.0) == group.mean(|row| Some(row.cpu));
        let ratio = match goal {
            Some((cpu, score)) if is_last && group.kind != other => {
                reached(&own, score).map_or("not reached".to_owned(), |own| format!("{:.2}", own / cpu))
            }
            _ => String::new(),
        };
        table.push(vec![
            group.scene.to_owned(),
            group.kind.to_owned(),
            group.steps.to_string(),
            group.cell(0, |row| Some(row.cpu)),
            group.cell(0, |row| Some(row.gaussians as f64)),
            group.cell(2, |row| Some(row.psnr)),
            group.cell(2, |row| row.psnr_seen),
            group.cell(2, |row| Some(row.worst)),
            group.cell(4, |row| Some(row.ssim)),
            group.cell(3, |row| row.iou_map),
            group.cell(3, |row| row.iou_object),
            ratio,
        ]);
    }
    table
}
