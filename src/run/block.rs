//! Trains a block of a larger scene as a region.

use super::Settings;
use super::resume::ResumePoint;
use crate::error::{Error, Result};
use crate::records::block_file::{self, BlockFile, poses_crc};
use crate::scene::{ColourMatrix, Dataset, View};
use crate::scenes::LoadOptions;
use crate::train::ExposureMode;
use crate::train::setup::region::Region;
use crate::train::shared::exposure;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The folder of a block, with its parsed file.
#[derive(Debug)]
pub(super) struct Block {
    folder: PathBuf,
    file: BlockFile,
}

impl Block {
    /// Reads a block.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        Ok(Self { folder: folder.to_owned(), file: BlockFile::read(folder)? })
    }

    /// Returns the path of its first model.
    pub(super) fn init(&self) -> PathBuf {
        BlockFile::init(&self.folder)
    }

    /// Restricts scene reading to the block's views.
    pub(super) fn limit(&self, options: &mut LoadOptions) {
        options.only = Some(Arc::new(self.file.names()));
    }

    /// Refuses a scene other than the one that was split.
    pub(super) fn check_scene(&self, dataset: &Dataset) -> Result<()> {
        let path = self.folder.join(block_file::BLOCK_FILE);
        for (which, wanted, found) in
            [("views", &self.file.views, &dataset.train), ("test", &self.file.test, &dataset.test)]
        {
            let missing = wanted.iter().find(|name| !found.iter().any(|view| view.name == **name));
            if let Some(name) = missing {
                let problem = format!("lists view {name}, which is missing in {}", dataset.root.display());
                return Err(Error::data(&path, which, format!("{problem}; split the scene again")));
            }
        }
        let all: Vec<&View> = dataset.train.iter().chain(&dataset.test).collect();
        if poses_crc(all.iter().map(|view| &view.camera)) != self.file.poses {
            let problem = format!("{} has other poses than when it was split", dataset.root.display());
            return Err(Error::data(&path, "poses", format!("{problem}; split it again")));
        }
        Ok(())
    }

    /// Returns the region of the block.
    pub(super) fn region(&self) -> Result<Region> {
        let rows = |(name, matrix): (&String, &ColourMatrix)| {
            let problem = || format!("{matrix:?} of {name} is not a valid exposure matrix; split the scene again");
            let error = || Error::data(self.folder.join(block_file::BLOCK_FILE), "exposures", problem());
            Ok((name.clone(), exposure::rows_of(matrix).ok_or_else(error)?))
        };
        Ok(Region {
            frozen: self.file.frozen,
            zone: self.file.zone.zone(self.file.axes),
            extent: self.file.extent,
            exposures: self.file.exposures.iter().map(rows).collect::<Result<_>>()?,
        })
    }

    fn apply(&self, settings: &mut Settings) {
        let (file, train) = (&self.file, &mut settings.train);
        settings.read.test_every = file.test_every;
        train.iterations = file.steps;
        train.seed = file.seed;
        train.near = file.near as f32;
        train.max_gaussians = 0;
        train.budget = file.gaussians + u64::from(file.frozen);
        train.position_lr_init *= file.rate_factors[0];
        train.position_lr_final *= file.rate_factors[0];
        train.scaling_lr *= file.rate_factors[1];
        train.exposure = if file.exposures.is_empty() { ExposureMode::Off } else { ExposureMode::On };
    }
}

/// Decides which block a run in `out` trains, and copies its file there.
///
/// # Errors
///
/// The run resumes with another block than before, or without its block.
pub(super) fn settle(block: Option<&Block>, resumed: Option<&ResumePoint>, out: &Path) -> Result<()> {
    let path = out.join(block_file::BLOCK_FILE);
    let before = if path.is_file() { Some(BlockFile::read(out)?) } else { None };
    if resumed.is_some() && before.as_ref() != block.map(|block| &block.file) {
        let name = |file: Option<&BlockFile>| file.map_or("no block".to_owned(), |file| format!("block {}", file.id));
        let (then, now) = (name(before.as_ref()), name(block.map(|block| &block.file)));
        let problem = if then == now { format!("{then} was split again since") } else { format!("{now} is given now") };
        let problem =
            format!("contains a run of {then}, but {problem}; resume with the same block, or name a new folder");
        return Err(Error::data(out, "", problem));
    }
    match block {
        Some(block) => block.file.write(out),
        None if before.is_some() => std::fs::remove_file(&path).map_err(Error::write(&path)),
        None => Ok(()),
    }
}

impl Settings {
    /// Applies the settings that a block decides: seed, steps, number of Gaussians, near plane, learning rates,
    /// held-out views.
    ///
    /// # Errors
    ///
    /// The folder is not a block folder.
    pub fn for_block(&mut self, folder: &Path) -> Result<()> {
        Block::read(folder)?.apply(self);
        Ok(())
    }
}
