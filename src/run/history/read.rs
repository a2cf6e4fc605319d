//! Reads a history.

use super::Entry;
use crate::error::{Error, Result};
use crate::files::read::bytes;
use std::path::Path;

/// A history.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct History {
    /// Entries by ascending step.
    pub entries: Vec<Entry>,
    /// End of each line, bytes.
    pub ends: Vec<u64>,
}

/// Reads a history. An incomplete last line is dropped: a killed run may leave one.
pub(crate) fn read(path: &Path) -> Result<History> {
    let bytes = bytes(path)?;
    let mut history = History::default();
    let mut start = 0;
    while let Some(length) = bytes[start..].iter().position(|&byte| byte == b'\n') {
        let end = start + length;
        let entry: Entry = serde_json::from_slice(&bytes[start..end]).map_err(|error| {
            let place = format!("line {}", history.entries.len() + 1);
            Error::data(path, place, format!("is not a valid history line ({error}); fix or delete the line"))
        })?;
        if let Some(before) = history.entries.last().filter(|before| before.step() > entry.step()) {
            let place = format!("line {}", history.entries.len() + 1);
            let problem = format!(
                "step {} comes after step {}; expected ascending steps; fix or delete the line",
                entry.step(),
                before.step()
            );
            return Err(Error::data(path, place, problem));
        }
        start = end + 1;
        history.entries.push(entry);
        history.ends.push(start as u64);
    }
    Ok(history)
}
