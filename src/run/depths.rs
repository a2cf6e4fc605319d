//! Depths that photos are known to have, from files or from the reconstruction.

use crate::error::{Error, Result};
use crate::io::{DepthFolder, capture};
use crate::scene::{Dataset, View};
use crate::train::TrainConfig;
use crate::train::depths::KnownDepths;
use std::path::Path;

/// Returns those of each training photo; none with a weight of 0. `folder` has depth maps in place of the points of the
/// reconstruction.
pub(super) fn known(
    (scene, dataset): (&Path, &Dataset),
    config: &TrainConfig,
    folder: Option<&Path>,
) -> Result<Vec<KnownDepths>> {
    if config.depth_weight == 0.0 {
        let unread = || Err(Error::usage("known_depths", "is only read with a `depth_weight` above 0"));
        return folder.map_or(Ok(Vec::new()), |_| unread());
    }
    let known: Vec<KnownDepths> = match folder {
        Some(folder) => {
            let maps = DepthFolder::open(folder, scene)?;
            let views: Vec<&View> = dataset.train.iter().collect();
            maps.check_complete(&views)?;
            views.into_iter().map(|view| maps.read(view).map(|map| KnownDepths::of_map(&map))).collect::<Result<_>>()?
        }
        None => {
            let points = capture::observed_points(scene, dataset)?;
            let of_view = |(view, points): (&View, Vec<_>)| KnownDepths::of_points(view, points.into_iter());
            dataset.train.iter().zip(points).map(of_view).collect()
        }
    };
    let all: usize = known.iter().map(KnownDepths::len).sum();
    if all == 0 {
        let problem = "has no points of which it is known what photo shows them; name a folder of depth maps in \
                       `known_depths`, or set `depth_weight` to 0";
        return Err(Error::data(scene, "points", problem));
    }
    tracing::info!("{} known depths in a photo, on average", all / known.len().max(1));
    Ok(known)
}
