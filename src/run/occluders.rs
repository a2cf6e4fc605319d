//! Occluders from a file.

use super::Request;
use crate::error::{Error, Result, Setting};
use crate::records::occlusion_table::OcclusionTable;
use crate::scene::{Dataset, View};
use crate::train::{Occlusion, TrainConfig};
use std::path::Path;

/// Refuses an occluder file that no step would read, and the occluder source `file` without a file.
pub(super) fn check(config: &TrainConfig, file: Option<&Path>) -> Result<()> {
    if config.layer_every() == 0 && file.is_some() {
        return Err(Error::usage(
            Setting("layer_every"),
            "is 0, but only steps with object layers read occluders; choose 1 or more",
        ));
    }
    if config.occlusion == Occlusion::File && file.is_none() {
        let problem = format!("is file, but no file was named; name it in {}", Setting("occluders"));
        return Err(Error::usage(Setting("occlusion"), problem));
    }
    Ok(())
}

/// Reads the given occluders. Returns `None` if the run finds its own.
pub(super) fn table(request: &Request, dataset: &Dataset) -> Result<Option<OcclusionTable>> {
    let Some(path) = &request.occluders else { return Ok(None) };
    let views: Vec<&View> = dataset.train.iter().filter(|view| view.mask.is_some()).collect();
    let table = OcclusionTable::read(path)?;
    if !views.is_empty() && !views.iter().any(|view| table.views.contains_key(&view.name)) {
        let some = table.views.keys().next().map_or("no view", String::as_str);
        let problem = format!("has none of the scene's views (such as {}), but {some}", views[0].name);
        return Err(Error::data(path, "views", problem));
    }
    Ok(Some(table))
}
