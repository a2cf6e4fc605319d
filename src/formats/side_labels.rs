//! Labels beside a file whose format cannot store them, or whose labels other programs drop: the part `gaussians` of
//! `NAME.labels.json`. They are valid for the same Gaussians in the same order, verified by a checksum of the
//! positions.

use super::format::Export;
use labelgs_files::label_table::{LabelEntry, LabelTable};
use labelgs_files::{atomic, read as file};
use labelgs_scene::{Error, MODEL_LABEL_MAX, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;

#[derive(Serialize)]
struct SideFile<'a> {
    #[serde(flatten)]
    table: &'a LabelTable,
    gaussians: PerGaussian,
}

#[derive(Deserialize)]
struct ReadSideFile {
    gaussians: Option<PerGaussian>,
}

#[derive(Serialize, Deserialize)]
struct PerGaussian {
    count: u64,
    /// CRC-32 of the stored positions.
    positions_crc32: u32,
    /// Runs of equal labels: (id, length).
    ids: Vec<(u32, u64)>,
}

/// Writes names and labels beside the model at `path`.
pub(super) fn write(path: &Path, export: &Export, labels: &[u32], checksum: u32) -> Result<()> {
    let mut ids: Vec<(u32, u64)> = Vec::new();
    for &row in export.rows {
        match ids.last_mut() {
            Some((id, length)) if *id == labels[row] => *length += 1,
            _ => ids.push((labels[row], 1)),
        }
    }
    let known: BTreeSet<u32> = ids.iter().map(|run| run.0).filter(|&id| id != 0).collect();
    let unnamed = LabelTable::new(known.into_iter().map(LabelEntry::new).collect());
    let gaussians = PerGaussian { count: export.rows.len() as u64, positions_crc32: checksum, ids };
    let written = SideFile { table: export.names.unwrap_or(&unnamed), gaussians };
    atomic::write_json(&LabelTable::path_beside(path), &written)
}

/// Reads the labels beside the model at `path` if they belong to its `count` Gaussians; otherwise adds a note.
pub(super) fn read(path: &Path, count: usize, checksum: u32, notes: &mut Vec<String>) -> Result<Option<Vec<u32>>> {
    let beside = LabelTable::path_beside(path);
    if !beside.is_file() {
        return Ok(None);
    }
    let expected =
        r#"expected "gaussians": {"count": N, "positions_crc32": C, "ids": [[id, length], ..]}; correct or delete it"#;
    let found: ReadSideFile = file::json(&beside, expected)?;
    let Some(own) = found.gaussians else { return Ok(None) };
    if own.count != count as u64 || own.positions_crc32 != checksum {
        let name = beside.display();
        notes.push(format!("the labels in {name} belong to other Gaussians or another order and were ignored"));
        return Ok(None);
    }
    let total = own.ids.iter().try_fold(0_u64, |sum, run| sum.checked_add(run.1));
    if total != Some(own.count) || own.ids.iter().any(|run| run.0 > MODEL_LABEL_MAX) {
        let problem = format!("expected runs of labels from 0 to {MODEL_LABEL_MAX} whose lengths add up to {count}");
        return Err(Error::data(&beside, "gaussians.ids", problem));
    }
    let run = |&(id, length): &(u32, u64)| std::iter::repeat_n(id, length as usize);
    Ok(Some(own.ids.iter().flat_map(run).collect()))
}
