//! Occluders from files.

use super::Request;
use crate::error::{Error, Result, Setting};
use crate::label::occlusion::from_depths;
use crate::records::occlusion_table::OcclusionTable;
use crate::scene::{Dataset, DepthKind, View};
use crate::scenes::Lookup;
use crate::train::{Occlusion, TrainConfig};
use std::path::PathBuf;

/// Files with occluders.
#[derive(Clone, Debug, PartialEq)]
pub enum OccluderFiles {
    /// Depth maps, one per photo by name, for the rule of the paper.
    Depths {
        /// Their folder.
        folder: PathBuf,
        /// Meaning of their values.
        kind: DepthKind,
    },
    /// Occluder lists of an earlier run.
    Lists(PathBuf),
}

/// Refuses a source of occluders without its files, and files that the source does not read.
pub(super) fn check(config: &TrainConfig, files: Option<&OccluderFiles>) -> Result<()> {
    if config.layer_every() == 0 && files.is_some() {
        return Err(Error::usage(
            Setting("layer_every"),
            "is 0, and only steps with object layers read occluders; choose 1 or more",
        ));
    }
    let needs = |files: Setting, problem: &str| Error::usage(Setting("occlusion"), format!("{problem} {files}"));
    match (config.occlusion, files) {
        (Occlusion::Depth, Some(OccluderFiles::Depths { .. })) => Ok(()),
        (Occlusion::Depth, _) => Err(needs(Setting("depths"), "is depth, which needs a folder of depth maps in")),
        (_, Some(OccluderFiles::Depths { .. })) => {
            let problem = format!("is only read with {}", Setting("occlusion").to("depth"));
            Err(Error::usage(Setting("depths"), problem))
        }
        (Occlusion::File, None) => Err(needs(Setting("occlusion_file"), "is file, and no file was named; name it in")),
        _ => Ok(()),
    }
}

/// Reads the given occluders. Returns none if the run finds its own.
pub(super) fn table(request: &Request, lookup: &Lookup, dataset: &Dataset) -> Result<Option<OcclusionTable>> {
    let views: Vec<&View> = dataset.train.iter().filter(|view| view.mask.is_some()).collect();
    let path = match &request.occluders {
        None => return Ok(None),
        Some(OccluderFiles::Depths { folder, kind }) => {
            let found = from_depths((&request.scene, lookup), folder, *kind, &views)?;
            return Ok(Some(OcclusionTable::new("depth", found)));
        }
        Some(OccluderFiles::Lists(path)) => path,
    };
    let table = OcclusionTable::read(path)?;
    if !views.is_empty() && !views.iter().any(|view| table.views.contains_key(&view.name)) {
        let some = table.views.keys().next().map_or("no view", String::as_str);
        let problem = format!("has none of the scene's views, such as {}; it has {some}", views[0].name);
        return Err(Error::data(path, "views", problem));
    }
    Ok(Some(table))
}
