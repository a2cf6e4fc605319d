//! The files of a scene that is trained in blocks: `blocks.json` for all blocks, and `block.json` for each.

use crate::error::{Error, Result};
use crate::files::{atomic, read};
use crate::scene::{Camera, ColourMatrix, Zone};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// File that lists all blocks, in the folder of the blocks and in the merged model's folder.
pub(crate) const BLOCKS_FILE: &str = "blocks.json";
/// File of a block, in the block's folder and in its run's folder.
pub(crate) const BLOCK_FILE: &str = "block.json";
/// Model of the Gaussians that no block trains.
pub(crate) const REST_MODEL_FILE: &str = "rest.ply";
/// Version of both file formats.
pub(crate) const SCHEMA_VERSION: u32 = 1;

/// Bounds of a box along the ground axes; `None` is open.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Lower corner, world units.
    pub low: [Option<f64>; 3],
    /// Upper corner, exclusive, world units.
    pub high: [Option<f64>; 3],
}

impl Bounds {
    /// The whole space.
    pub const ALL: Self = Self { low: [None; 3], high: [None; 3] };

    /// Returns the box in the world, given the ground axes.
    pub fn zone(&self, axes: [[f64; 3]; 3]) -> Zone {
        let corner = |sides: [Option<f64>; 3], open: f64| DVec3::from_array(sides.map(|side| side.unwrap_or(open)));
        let (low, high) = (corner(self.low, f64::NEG_INFINITY), corner(self.high, f64::INFINITY));
        Zone { axes: axes.map(DVec3::from_array), low, high }
    }
}

/// A block, as training needs it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockFile {
    /// Version of the layout.
    pub schema_version: u32,
    /// Name, such as `b007`.
    pub id: String,
    /// CRC-32 of the `blocks.json` that it belongs to.
    pub blocks: u32,
    /// Axes of the boxes, unit vectors in the world.
    pub axes: [[f64; 3]; 3],
    /// Box of the Gaussians that the merged model takes from it.
    pub core: Bounds,
    /// Where Gaussians grow.
    pub zone: Bounds,
    /// Extent of the whole scene, world units.
    pub extent: f64,
    /// Near plane, world units.
    pub near: f64,
    /// Views to train on, by name.
    pub views: Vec<String>,
    /// Held-out views that it is scored on.
    pub test: Vec<String>,
    /// Every N-th view of the scene is held out; 0 holds out none.
    pub test_every: u32,
    /// CRC-32 of the poses of all these views.
    pub poses: u32,
    /// Fixed exposure matrices of the photos.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub exposures: BTreeMap<String, ColourMatrix>,
    /// Random seed.
    pub seed: u64,
    /// Number of steps.
    pub steps: u32,
    /// Gaussians at the end of growth, without the frozen ones.
    pub gaussians: u64,
    /// Frozen Gaussians at the end of its first model.
    pub frozen: u32,
    /// Factors of the learning rates of positions and of scales.
    pub rate_factors: [f64; 2],
}

/// A block in the list of all blocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockRow {
    /// Name.
    pub id: String,
    /// False if too few photos see it: the merged model has the coarse Gaussians there.
    pub trained: bool,
    /// Box of the Gaussians that the merged model takes from it.
    pub core: Bounds,
    /// Where its Gaussians grow.
    pub zone: Bounds,
    /// Number of views to train on.
    pub views: u64,
    /// Gaussians at the start.
    pub start: u64,
    /// Gaussians at the end of growth, without the frozen ones.
    pub gaussians: u64,
    /// Gaussians of the surroundings.
    pub frozen: u64,
    /// Predicted memory of the device, MiB.
    pub device_mib: u64,
    /// Predicted memory of the host, MiB.
    pub host_mib: u64,
    /// Number of steps.
    pub steps: u32,
    /// Predicted time, minutes, at the pace of the coarse run; null if unknown.
    pub minutes: Option<f64>,
}

/// The list of all blocks of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlocksFile {
    /// Version of the layout.
    pub schema_version: u32,
    /// Version of labelgs that wrote it.
    pub labelgs: String,
    /// CRC-32 of the coarse model.
    pub model: u32,
    /// CRC-32 of the poses of all training views.
    pub poses: u32,
    /// Axes of the boxes, unit vectors in the world; the third is up.
    pub axes: [[f64; 3]; 3],
    /// Mean camera position, world units.
    pub centre: [f64; 3],
    /// Gaussians farther than this from the centre stay coarse, world units.
    pub far: f64,
    /// Extent of the scene, world units.
    pub extent: f64,
    /// Near plane, world units.
    pub near: f64,
    /// Every N-th view is held out; 0 holds out none.
    pub test_every: u32,
    /// Gaussians of the coarse model in `rest.ply`: far ones and those of untrained blocks.
    pub rest: u64,
    /// The blocks.
    pub blocks: Vec<BlockRow>,
}

impl BlocksFile {
    /// Reads the file in a folder. Also returns the checksum that blocks refer to it by.
    pub fn read(folder: &Path) -> Result<(Self, u32)> {
        let path = folder.join(BLOCKS_FILE);
        require(&path, folder, "blocks")?;
        let text = read::bytes(&path)?;
        let file: Self = read::parse_json(&path, &text, "expected the list of all blocks; split the scene again")?;
        check_version(&path, file.schema_version)?;
        Ok((file, crc32fast::hash(&text)))
    }

    /// Returns the content of the file.
    pub fn text(&self) -> Result<Vec<u8>> {
        serde_json::to_vec_pretty(self).map_err(|error| Error::Bug(format!("JSON: {error}")))
    }

    /// Returns true for a position in the region that always stays coarse.
    pub fn is_far(&self, world: DVec3) -> bool {
        world.distance(DVec3::from_array(self.centre)) > self.far
    }
}

impl BlockFile {
    /// Reads the file in the folder of a block.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(BLOCK_FILE);
        require(&path, folder, "a block")?;
        let file: Self = read::json(&path, "expected the file of a block; split the scene again")?;
        check_version(&path, file.schema_version)?;
        if file.views.is_empty() {
            return Err(Error::data(&path, "views", "lists no training views; split the scene again"));
        }
        Ok(file)
    }

    /// Writes the file.
    pub fn write(&self, folder: &Path) -> Result<()> {
        atomic::write_json(&folder.join(BLOCK_FILE), self)
    }

    /// Returns the names of all views.
    pub fn names(&self) -> BTreeSet<String> {
        self.views.iter().chain(&self.test).cloned().collect()
    }

    /// Returns the path of the first model.
    pub fn init(folder: &Path) -> PathBuf {
        folder.join("init.ply")
    }
}

/// Refuses a folder of another kind.
fn require(path: &Path, folder: &Path, what: &str) -> Result<()> {
    if path.is_file() {
        return Ok(());
    }
    let name = path.file_name().unwrap_or_default().display();
    Err(Error::data(folder, "", format!("is not a folder of {what}: it has no {name}; split a scene first")))
}

fn check_version(path: &Path, found: u32) -> Result<()> {
    if found == SCHEMA_VERSION {
        return Ok(());
    }
    let problem = format!("has version {found}, labelgs reads {SCHEMA_VERSION}; split the scene again");
    Err(Error::data(path, "schema_version", problem))
}

/// Returns the CRC-32 of poses, independent of photo sizes.
pub(crate) fn poses_crc<'a>(cameras: impl Iterator<Item = &'a Camera>) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for camera in cameras {
        let pose = camera.rotation.to_cols_array().into_iter().chain(camera.translation.to_array());
        pose.for_each(|value| hasher.update(&value.to_le_bytes()));
    }
    hasher.finalize()
}
