//! Known depths of photos, from files or from the reconstruction.

use crate::error::{Error, Result, Setting};
use crate::scene::{Dataset, View};
use crate::scenes::capture::Sightings;
use crate::scenes::{DepthFolder, Lookup};
use crate::train::TrainConfig;
use crate::train::input::known_depths::KnownDepths;
use std::path::Path;

/// Default weight of known depths.
const DEPTH_WEIGHT_DEFAULT: f64 = 0.3;

/// Where known depths come from.
#[derive(Clone, Copy)]
pub(super) struct DepthSource<'a> {
    /// Scene folder or file.
    pub scene: &'a Path,
    /// Where the scene's files are.
    pub lookup: &'a Lookup,
    /// The scene.
    pub dataset: &'a Dataset,
    /// Folder of depth maps that replace the points of the reconstruction.
    pub folder: Option<&'a Path>,
    /// Which photo shows which point.
    pub sightings: &'a Sightings<'a>,
}

/// Decides the weight of known depths and returns them for each training photo; empty if the weight is 0. Only a new
/// run decides the weight.
pub(super) fn decide(
    source: DepthSource,
    config: &TrainConfig,
    is_new: bool,
) -> Result<(TrainConfig, Vec<KnownDepths>)> {
    let DepthSource { scene, dataset, folder, .. } = source;
    let weight = config.depth_weight.unwrap_or(if is_new { DEPTH_WEIGHT_DEFAULT } else { 0.0 });
    let with = |weight: f64| TrainConfig { depth_weight: Some(weight), ..config.clone() };
    if weight == 0.0 {
        let problem = || format!("is read only if {} is above 0", Setting("depth_weight"));
        let unread = || Err(Error::usage(Setting("depths"), problem()));
        return folder.map_or(Ok((with(0.0), Vec::new())), |_| unread());
    }
    let known = match folder {
        Some(folder) => depths_from_maps(folder, source)?,
        None => {
            let points = source.sightings.points()?;
            let of_view = |(view, points): (&View, Vec<_>)| KnownDepths::from_points(view, points.into_iter());
            dataset.train.iter().zip(points).map(of_view).collect()
        }
    };
    let all: usize = known.iter().map(KnownDepths::len).sum();
    if all > 0 {
        tracing::info!("{} known depths per photo on average", all / known.len().max(1));
        return Ok((with(weight), known));
    }
    if let Some(folder) = folder {
        return Err(Error::data(folder, "", "has maps without any depth; expected positive numbers in world units"));
    }
    if config.depth_weight.is_none() {
        return Ok((with(0.0), Vec::new()));
    }
    let problem = format!(
        "has no points with known photos; name a folder of depth maps in {}, or set {}",
        Setting("depths"),
        Setting("depth_weight").to(0)
    );
    Err(Error::data(scene, "points", problem))
}

fn depths_from_maps(folder: &Path, source: DepthSource) -> Result<Vec<KnownDepths>> {
    let maps = DepthFolder::open(folder, source.scene, source.lookup)?;
    let views: Vec<&View> = source.dataset.train.iter().collect();
    maps.check_complete(&views)?;
    views.into_iter().map(|view| maps.read(view).map(|map| KnownDepths::from_map(&map))).collect()
}
