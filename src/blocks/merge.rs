//! Merges the block models into one.

use super::join::{BlockMasks, join};
use super::trained::{TrainedBlock, compare, core};
use crate::error::{Error, Result};
use crate::files::atomic;
use crate::files::label_table::{self, LabelTable};
use crate::files::run_folder::{self, Lock};
use crate::formats::write_joined;
use crate::records::block_file::{self, BlockFile, BlocksFile, REST_MODEL_FILE};
use crate::run::models::{self, Models, model_path};
use crate::scene::Gaussians;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// File with the result, written last.
const MERGE_FILE: &str = "merge.json";

/// Options of a merge.
#[derive(Clone, Copy, Default)]
pub struct MergeOptions<'a> {
    /// Uses the coarse Gaussians for blocks without a finished run.
    pub allow_missing: bool,
    /// Masks whose ids agree within a block only. Objects then get new ids, and coarse Gaussians no label.
    pub masks: Option<BlockMasks<'a>>,
}

/// The result of a merge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MergeResult {
    /// The model.
    pub model: PathBuf,
    /// Gaussians of each block in the model, by name.
    pub blocks: Vec<(String, u64)>,
    /// Number of coarse Gaussians in the model.
    pub coarse: u64,
    /// Names of blocks without a finished run.
    pub missing: Vec<String>,
    /// Devices that trained the blocks.
    pub devices: Vec<String>,
}

impl MergeResult {
    /// Returns the number of Gaussians in the model.
    pub fn gaussians(&self) -> u64 {
        self.coarse + self.blocks.iter().map(|(_, count)| count).sum::<u64>()
    }
}

/// Rows of the merged model from one file.
enum MergePart {
    /// The core of a training.
    Trained(Box<TrainedBlock>),
    /// The core of a block's first model, or the Gaussians that are coarse everywhere.
    Coarse(Option<Box<BlockFile>>, PathBuf),
}

/// Merges the runs in `models`, one folder per block of the folder `blocks`, into the folder `out`. Takes the core
/// Gaussians of each run, then the coarse ones. Only one model is in memory at a time.
///
/// # Errors
///
/// Blocks without a finished run, or with a run that has another split, other settings, another labelgs version or
/// other label names. One error lists all problems.
pub fn merge(blocks: &Path, models: &Path, out: &Path, options: &MergeOptions) -> Result<MergeResult> {
    let (file, crc) = BlocksFile::read(blocks)?;
    let mut problems = Vec::new();
    let mut merged = MergeResult::default();
    let mut parts = Vec::new();
    for row in file.blocks.iter().filter(|row| row.trained) {
        let folder = blocks.join(&row.id);
        let block = BlockFile::read(&folder)?;
        if block.blocks != crc {
            problems.push(format!("{}: belongs to another split than {}", folder.display(), block_file::BLOCKS_FILE));
            continue;
        }
        match TrainedBlock::open(&block, &models.join(&row.id)) {
            Ok(trained) => parts.push(MergePart::Trained(Box::new(trained))),
            Err(problem) if problem.is_missing && options.allow_missing => {
                tracing::warn!("{}; its core stays coarse", problem.text);
                merged.missing.push(row.id.clone());
                parts.push(MergePart::Coarse(Some(Box::new(block)), BlockFile::init(&folder)));
            }
            Err(problem) => problems.push(problem.text),
        }
    }
    let trained: Vec<&TrainedBlock> = parts.iter().filter_map(MergePart::trained).collect();
    problems.extend(compare(&trained));
    let names = if options.masks.is_some() { None } else { names(blocks, &trained, &mut problems)? };
    refuse(models, &problems)?;
    merged.devices = devices(&trained);
    let joined = options.masks.map(|masks| join(blocks, &trained, &masks)).transpose()?;
    let has_ids = joined.is_some();
    let (ids, names) = joined.map_or((Vec::new(), names), |joined| (joined.of, Some(joined.names)));
    parts.iter_mut().filter_map(MergePart::trained_mut).zip(ids).for_each(|(trained, ids)| trained.ids = Some(ids));
    parts.push(MergePart::Coarse(None, blocks.join(REST_MODEL_FILE)));
    write(&file, &parts, (names.as_ref(), has_ids), out, merged)
}

/// Combines all problems into one error.
fn refuse(models: &Path, problems: &[String]) -> Result<()> {
    let problem = match problems {
        [] => return Ok(()),
        [problem] => problem.clone(),
        many => format!("{} problems:\n  {}", many.len(), many.join("\n  ")),
    };
    Err(Error::data(models, "", problem))
}

fn devices(trained: &[&TrainedBlock]) -> Vec<String> {
    let mut devices: Vec<String> = trained.iter().map(|trained| trained.device.clone()).collect();
    devices.sort();
    devices.dedup();
    devices
}

/// Merges the label tables. A name with two ids, or an id with two names, is a problem.
fn names(blocks: &Path, trained: &[&TrainedBlock], problems: &mut Vec<String>) -> Result<Option<LabelTable>> {
    let coarse = LabelTable::read_in_folder(blocks)?;
    let mut of_id = BTreeMap::new();
    let mut of_name: BTreeMap<String, u32> = BTreeMap::new();
    let from = |folder: &Path| folder.join(label_table::FILE_NAME).display().to_string();
    let tables = trained.iter().filter_map(|trained| Some((from(&trained.folder), trained.names.as_ref()?)));
    for (path, table) in tables.chain(coarse.as_ref().map(|table| (from(blocks), table))) {
        for entry in &table.labels {
            let known = of_id.entry(entry.id).or_insert_with(|| entry.clone());
            if known.name != entry.name {
                let name = |name: &Option<String>| name.clone().unwrap_or_else(|| "nameless".to_owned());
                let (here, there) = (name(&entry.name), name(&known.name));
                problems.push(format!("{path}: label {} is {here}, elsewhere {there}", entry.id));
            }
            let Some(name) = &entry.name else { continue };
            let id = *of_name.entry(name.clone()).or_insert(entry.id);
            if id != entry.id {
                problems.push(format!("{path}: {name} is label {}, elsewhere {id}", entry.id));
            }
        }
    }
    Ok((!of_id.is_empty()).then(|| LabelTable::new(of_id.into_values().collect())))
}

impl MergePart {
    fn trained(&self) -> Option<&TrainedBlock> {
        if let Self::Trained(trained) = self { Some(trained) } else { None }
    }

    fn trained_mut(&mut self) -> Option<&mut TrainedBlock> {
        if let Self::Trained(trained) = self { Some(trained) } else { None }
    }

    /// Reads the rows. If blocks got new ids, labels of coarse Gaussians are meaningless and dropped.
    fn read(&self, has_ids: bool) -> Result<Gaussians> {
        let (block, path) = match self {
            Self::Trained(trained) => return trained.core(),
            Self::Coarse(block, path) => (block.as_deref(), path),
        };
        let model = match block {
            Some(block) => core(block, path)?,
            None => models::open(path)?.gaussians,
        };
        Ok(if has_ids { Gaussians { labels: None, label_confidence: None, ..model } } else { model })
    }
}

fn write(
    file: &BlocksFile,
    parts: &[MergePart],
    (names, has_ids): (Option<&LabelTable>, bool),
    out: &Path,
    mut merged: MergeResult,
) -> Result<MergeResult> {
    std::fs::create_dir_all(out).map_err(Error::write(out))?;
    let _lock = Lock::take(out)?;
    let result = out.join(MERGE_FILE);
    if result.is_file() {
        std::fs::remove_file(&result).map_err(Error::write(&result))?;
    }
    let steps = parts.iter().filter_map(MergePart::trained).map(|trained| trained.steps).max().unwrap_or(0);
    // The header needs the number of rows, so all parts are read twice.
    let mut like = None;
    for part in parts {
        let rows = part.read(has_ids)?;
        let count = rows.len() as u64;
        match part {
            MergePart::Trained(trained) => merged.blocks.push((trained.block.id.clone(), count)),
            MergePart::Coarse(..) => merged.coarse += count,
        }
        like = Some(joint(like, &rows));
    }
    let like = like.unwrap_or_default();
    merged.model = model_path(out, steps);
    let mut to = Models::new(out, 0)?;
    write_joined(&merged.model, &like, merged.gaussians() as usize, parts.iter().map(|part| part.read(has_ids)))?;
    to.note_saved(steps);
    if merged.missing.is_empty() && merged.coarse != file.rest {
        let problem = format!("has {} coarse Gaussians; expected {}", merged.coarse, file.rest);
        return Err(Error::data(&merged.model, "", problem));
    }
    write_records(file, parts, names, out)?;
    atomic::write_json(&result, &merged.to_json())?;
    Ok(merged)
}

/// Returns an empty model with the columns of `like` and `part`.
fn joint(like: Option<Gaussians>, part: &Gaussians) -> Gaussians {
    let like = like.unwrap_or_else(|| part.picked(&[]));
    let (labels, confidence) = (part.labels.is_some(), part.label_confidence.is_some());
    Gaussians {
        sh_degree: like.sh_degree.max(part.sh_degree),
        labels: (like.labels.is_some() || labels).then(Vec::new),
        label_confidence: (like.label_confidence.is_some() || confidence).then(Vec::new),
        ..like
    }
}

/// Writes settings, label names and blocks next to the model, where other commands expect them.
fn write_records(file: &BlocksFile, parts: &[MergePart], names: Option<&LabelTable>, out: &Path) -> Result<()> {
    if let Some(first) = parts.iter().find_map(MergePart::trained) {
        let from = first.folder.join(run_folder::CONFIG_FILE);
        let text = crate::files::read::text(&from)?;
        atomic::write(out.join(run_folder::CONFIG_FILE), |to| to.write_all(text.as_bytes()))?;
    }
    LabelTable::write_or_remove(names, &out.join(label_table::FILE_NAME))?;
    let text = file.text()?;
    atomic::write(out.join(block_file::BLOCKS_FILE), |to| to.write_all(&text))
}

impl MergeResult {
    /// Returns the content of `merge.json`.
    pub fn to_json(&self) -> serde_json::Value {
        json!({
            "schema_version": 1,
            "model": self.model.display().to_string(),
            "gaussians": self.gaussians(),
            "blocks": self.blocks.iter().map(|(id, count)| json!({ "id": id, "gaussians": count })).collect::<Vec<_>>(),
            "coarse": self.coarse,
            "missing": self.missing,
            "devices": self.devices,
        })
    }
}
