//! Occluders from depth files, by the rule of the paper.

use super::{distances, occluders_by_mean};
use crate::error::{Error, Result};
use crate::scene::{DepthKind, Occluders, View, parallel};
use crate::scenes::Lookup;
use crate::scenes::depth::DepthFolder;
use std::collections::BTreeMap;
use std::path::Path;

/// Returns the occluders of `views`, which have masks, by name of the view. Each thread keeps one depth map in memory.
pub fn from_depths(
    (scene, lookup): (&Path, &Lookup),
    depths: &Path,
    kind: DepthKind,
    views: &[&View],
) -> Result<BTreeMap<String, Occluders>> {
    let folder = DepthFolder::open(depths, scene, lookup)?;
    folder.check_complete(views)?;
    let of_view = |view: &View| {
        let map = folder.read(view)?;
        let mask = view.mask()?.ok_or_else(|| Error::Bug(format!("{} came without its mask", view.name)))?;
        Ok((view.name.clone(), occluders_by_mean(&mask, &distances(&map, kind))))
    };
    let found: Vec<Result<(String, Occluders)>> = parallel::map_views("reading depth maps", views, of_view);
    found.into_iter().collect()
}
