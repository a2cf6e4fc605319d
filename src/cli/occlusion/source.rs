//! Occluders that are known before a model is: from depth maps or from a file.

use super::mask;
use crate::cli::train_args::TrainArgs;
use crate::io::depth::DepthFolder;
use crate::io::occlusion_table::OcclusionTable;
use crate::label::occlusion::{by_mean, distances};
use crate::scene::{Dataset, DepthKind, Occluders, View};
use crate::{Error, Result};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Occluders of `views`, which have masks, by the paper's rule. One depth map is in memory per thread.
pub fn from_depths(
    scene: &Path,
    depths: &Path,
    kind: DepthKind,
    views: &[&View],
) -> Result<BTreeMap<String, Occluders>> {
    let folder = DepthFolder::open(depths, scene)?;
    folder.check_complete(views)?;
    let of_view = |view: &&View| {
        let map = folder.read(view)?;
        Ok((view.name.clone(), by_mean(mask(view)?, &distances(&map, kind))))
    };
    let found: Vec<Result<(String, Occluders)>> = views.par_iter().map(of_view).collect();
    found.into_iter().collect()
}

/// The table that a run starts with, if it does not look for occluders itself.
pub fn for_training(args: &TrainArgs, dataset: &Dataset) -> Result<Option<OcclusionTable>> {
    let views: Vec<&View> = dataset.train.iter().filter(|view| view.mask.is_some()).collect();
    if let (Some(depths), Some(kind)) = (&args.depths, args.depth_kind) {
        let found = from_depths(&args.scene, depths, kind, &views)?;
        return Ok(Some(OcclusionTable::new("depth", found)));
    }
    let Some(path) = &args.occlusion_file else { return Ok(None) };
    let table = OcclusionTable::read(path)?;
    if !views.is_empty() && !views.iter().any(|view| table.views.contains_key(&view.name)) {
        let some = table.views.keys().next().map_or("no view", String::as_str);
        let problem = format!("has none of the scene's views, such as {}; it has {some}", views[0].name);
        return Err(Error::data(path, "views", problem));
    }
    Ok(Some(table))
}
