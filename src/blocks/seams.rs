//! Score groups of a merged model: its blocks, and the seams between them.

use crate::error::Result;
use crate::eval::PlaceGroups;
use crate::records::block_file::{BLOCKS_FILE, BlocksFile};
use crate::scene::Zone;
use glam::DVec3;
use std::path::Path;

/// Groups besides the blocks: far or empty space, overlaps of zones, and everything else.
const EXTRA_GROUP_NAMES: [&str; 3] = ["far", "seams", "off the seams"];

/// The blocks of a merged model, as score groups.
pub struct Seams {
    file: BlocksFile,
    cores: Vec<Zone>,
    zones: Vec<Zone>,
}

impl Seams {
    /// Reads the blocks of the model in a folder; `None` if the model was not merged.
    ///
    /// # Errors
    ///
    /// The block file cannot be read.
    pub fn for_model(folder: &Path) -> Result<Option<Self>> {
        if !folder.join(BLOCKS_FILE).is_file() {
            return Ok(None);
        }
        let (file, _) = BlocksFile::read(folder)?;
        let cores = file.blocks.iter().map(|block| block.core.zone(file.axes)).collect();
        let zones = file.blocks.iter().map(|block| block.zone.zone(file.axes)).collect();
        Ok(Some(Self { file, cores, zones }))
    }
}

impl PlaceGroups for Seams {
    fn names(&self) -> Vec<String> {
        self.file.blocks.iter().map(|block| block.id.clone()).chain(EXTRA_GROUP_NAMES.map(str::to_owned)).collect()
    }

    fn groups_at(&self, world: DVec3) -> Vec<usize> {
        let first = self.cores.len();
        if self.file.is_far(world) {
            return vec![first];
        }
        let is_seam = self.zones.iter().filter(|zone| zone.contains(world)).count() > 1;
        let block = self.cores.iter().position(|core| core.contains(world));
        block.into_iter().chain([first + if is_seam { 1 } else { 2 }]).collect()
    }
}
