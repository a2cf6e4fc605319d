//! Writes the block folders.

use super::plan::{Plan, PlannedBlock};
use crate::error::Result;
use crate::files::atomic;
use crate::files::label_table::LabelTable;
use crate::formats::write_model;
use crate::records::block_file::{
    BLOCKS_FILE, BlockFile, BlockRow, BlocksFile, REST_MODEL_FILE, SCHEMA_VERSION, poses_crc,
};
use crate::scene::View;
use std::path::Path;

/// Factor of the position learning rates: a block continues from the coarse model (CityGaussian).
const POSITION_RATE_FACTOR: f64 = 0.4;
/// Factor of the scale learning rate, for the same reason.
const SCALE_RATE_FACTOR: f64 = 0.8;
const BYTES_PER_MIB: u64 = 1 << 20;

/// Writes a folder per block into the new folder `out`, then the untrained rest, and finally the list of all blocks.
///
/// # Errors
///
/// The folder is not empty, or a file cannot be written.
pub fn split(plan: &Plan, out: &Path) -> Result<()> {
    atomic::require_empty("output", out)?;
    let train = &plan.coarse.dataset.train;
    let (frame, is_rest) = (&plan.frame, plan.is_rest());
    let rest = plan.coarse.model.filtered(|row| is_rest[row]);
    let file = BlocksFile {
        schema_version: SCHEMA_VERSION,
        labelgs: env!("CARGO_PKG_VERSION").to_owned(),
        model: plan.coarse.crc,
        poses: poses_crc(train.iter().map(|view| &view.camera)),
        axes: frame.axes.map(|axis| axis.to_array()),
        centre: frame.centre.to_array(),
        far: frame.far,
        extent: plan.extent,
        near: plan.coarse.near.into(),
        test_every: plan.coarse.settings.read.test_every,
        rest: rest.len() as u64,
        blocks: plan.rows(),
    };
    let text = file.text()?;
    let crc = crc32fast::hash(&text);
    for (index, block) in plan.blocks.iter().enumerate().filter(|(_, block)| block.trained) {
        let folder = out.join(name(index));
        // Trained rows come first: only these have moments.
        let rows: Vec<usize> = block.zone_rows.iter().chain(&block.frozen_rows).copied().collect();
        write_model(BlockFile::init(&folder), &plan.coarse.model.picked(&rows))?;
        plan.file(index, block, crc).write(&folder)?;
    }
    write_model(out.join(REST_MODEL_FILE), &rest)?;
    LabelTable::write_or_remove(plan.coarse.names.as_ref(), &out.join(crate::files::label_table::FILE_NAME))?;
    atomic::write(out.join(BLOCKS_FILE), |to| to.write_all(&text))
}

fn name(index: usize) -> String {
    format!("b{index:03}")
}

fn row((index, block): (usize, &PlannedBlock)) -> BlockRow {
    BlockRow {
        id: name(index),
        trained: block.trained,
        core: block.cell.core,
        zone: block.cell.zone(),
        views: block.train.len() as u64,
        start: block.zone_rows.len() as u64,
        gaussians: block.gaussians,
        frozen: block.frozen_rows.len() as u64,
        device_mib: block.need.device.div_ceil(BYTES_PER_MIB),
        host_mib: block.need.host.div_ceil(BYTES_PER_MIB),
        steps: block.need.steps,
        minutes: block.need.minutes,
    }
}

impl Plan {
    /// Returns the block list as [`split`] writes it.
    pub fn rows(&self) -> Vec<BlockRow> {
        self.blocks.iter().enumerate().map(row).collect()
    }

    /// Returns which coarse Gaussians the merged model keeps: far ones, and those in untrained cores.
    fn is_rest(&self) -> Vec<bool> {
        let mut is_rest = vec![true; self.coarse.model.len()];
        for block in self.blocks.iter().filter(|block| block.trained) {
            block.cell.rows.iter().for_each(|&row| is_rest[row] = false);
        }
        is_rest
    }

    fn file(&self, index: usize, block: &PlannedBlock, blocks: u32) -> BlockFile {
        let pick = |of: &[usize], views: &[View]| of.iter().map(|&at| views[at].clone()).collect::<Vec<View>>();
        let (train, test) = (&self.coarse.dataset.train, &self.coarse.dataset.test);
        let (train, test) = (pick(&block.train, train), pick(&block.test, test));
        let names = |views: &[View]| views.iter().map(|view| view.name.clone()).collect::<Vec<_>>();
        let exposure = |view: &View| Some((view.name.clone(), *self.coarse.exposures.get(&view.name)?));
        BlockFile {
            schema_version: SCHEMA_VERSION,
            id: name(index),
            blocks,
            axes: self.frame.axes.map(|axis| axis.to_array()),
            core: block.cell.core,
            zone: block.cell.zone(),
            extent: self.extent,
            near: self.coarse.near.into(),
            views: names(&train),
            test: names(&test),
            test_every: self.coarse.settings.read.test_every,
            poses: poses_crc(train.iter().chain(&test).map(|view| &view.camera)),
            exposures: train.iter().filter_map(exposure).collect(),
            seed: seed(self.coarse.settings.train.seed, index),
            steps: block.need.steps,
            gaussians: block.gaussians,
            frozen: block.frozen_rows.len() as u32,
            rate_factors: [POSITION_RATE_FACTOR, SCALE_RATE_FACTOR],
        }
    }
}

/// Returns the seed of a block, at most 63 bits because of TOML.
fn seed(run: u64, index: usize) -> u64 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&run.to_le_bytes());
    hasher.update(name(index).as_bytes());
    u64::from(hasher.finalize())
}
