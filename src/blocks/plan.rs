//! Divides a scene into as few blocks as the GPU allows.

use super::cells::Cell;
use super::choose::{BlockPhotos, choose};
use super::coarse::CoarseModel;
use super::frame::Frame;
use super::need::{BlockNeed, BlockSize, CommonNeed, TargetGpu};
use crate::engine::{Engine, EngineSize};
use crate::error::{Error, Result, Setting};
use crate::gpu::Gpu;
use crate::scene::Dataset;
use crate::scenes::LoadOptions;
use crate::scheduler::SchedulerOptions;
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;

/// Fewest views of a block: this many, or this share of all views if that is less.
const VIEWS_MIN: usize = 32;
const VIEWS_MIN_SHARE: f64 = 0.25;
/// Default number of Gaussians of the whole scene, per Gaussian of the coarse model.
const GAUSSIANS_PER_COARSE: u64 = 4;
/// Share of the coarse Gaussians outside a zone that its photos are initially assumed to show.
const CONTEXT_SHARE: f64 = 0.25;
/// Most rounds of dividing; each round renders every photo once.
const DIVISION_ROUNDS_MAX: usize = 6;
/// Most blocks: block names have three digits.
pub(super) const BLOCKS_MAX: usize = 1000;

/// Options of [`plan`].
#[derive(Clone, Debug)]
pub struct PlanOptions {
    /// Memory of the GPU that trains the blocks, bytes.
    pub card: u64,
    /// Gaussians of the whole scene at the end of growth; 0 takes four times those of the coarse model.
    pub gaussians: u64,
    /// Fewest blocks.
    pub blocks: usize,
    /// Most views per block; views with the largest share of the core are preferred.
    pub max_views: usize,
    /// Longest photo side in block training, px; 0 for full size.
    pub max_resolution: u32,
    /// Steps of a block with up to 300 views; 0 takes those of the coarse run. Blocks with more views have
    /// proportionally more steps.
    pub steps: u32,
    /// Up direction in the world; `None` derives it from the cameras.
    pub up: Option<DVec3>,
    /// How to read the scene. Photo size and held-out views are those of the coarse run.
    pub load: LoadOptions,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self {
            card: 24 << 30,
            gaussians: 0,
            blocks: 1,
            max_views: 1500,
            max_resolution: 0,
            steps: 0,
            up: None,
            load: LoadOptions::default(),
        }
    }
}

/// A planned block.
#[derive(Clone, Debug)]
pub(super) struct PlannedBlock {
    /// False if too few photos see it.
    pub trained: bool,
    /// Gaussians at the end of growth.
    pub gaussians: u64,
    pub cell: Cell,
    /// Coarse Gaussians in the zone, then frozen ones of the surroundings.
    pub zone_rows: Vec<usize>,
    pub frozen_rows: Vec<usize>,
    /// Indices of its training views, then of its held-out views.
    pub train: Vec<usize>,
    pub test: Vec<usize>,
    pub need: BlockNeed,
}

/// The blocks of a scene.
pub struct Plan {
    /// Far Gaussians of the coarse model, which are in no block's core.
    pub far: u64,
    pub(super) blocks: Vec<PlannedBlock>,
    pub(super) coarse: CoarseModel,
    pub(super) frame: Frame,
    pub(super) extent: f64,
}

/// Divides the scene at `scene` into the fewest blocks that fit the GPU, using its coarse model in the folder `model`.
/// `open` opens the device that renders the coarse model.
///
/// # Errors
///
/// The model is not from a finished run of this scene; the target GPU is too small for what the photos show; the device
/// is too small for the coarse model.
pub fn plan(scene: &Path, model: &Path, options: &PlanOptions, open: &dyn Fn() -> Result<Arc<Gpu>>) -> Result<Plan> {
    if options.blocks == 0 || options.blocks > BLOCKS_MAX {
        return Err(Error::usage(Setting("blocks"), format!("is {}, needs 1 to {BLOCKS_MAX}", options.blocks)));
    }
    let mut coarse = CoarseModel::open(scene, model, options.load.clone())?;
    let cameras: Vec<_> = coarse.dataset.train.iter().map(|view| &view.camera).collect();
    let extent = coarse.dataset.extent();
    let frame = Frame::from_cameras(&cameras, extent, options.up);
    let places = coarse.settle(&frame);
    if places.is_empty() {
        let problem = format!("has no Gaussian within {:.3} world units of the cameras", frame.far);
        return Err(Error::data(model, "", problem));
    }
    let card = TargetGpu::new(options.card);
    let planner = Planner { common: common(&coarse, options)?, card, options, coarse: &coarse, frame: &frame };
    let mut engine = engine(open()?, &coarse)?;
    let blocks = planner.blocks(&mut engine, &places)?;
    let far = (coarse.model.len() - places.len()) as u64;
    Ok(Plan { blocks, far, coarse, frame, extent })
}

fn sizes(dataset: &Dataset) -> Vec<(u32, u32)> {
    dataset.all().into_iter().map(|view| (view.camera.width, view.camera.height)).collect()
}

fn engine(gpu: Arc<Gpu>, coarse: &CoarseModel) -> Result<Engine> {
    let sizes = sizes(&coarse.dataset).into_iter();
    let size = EngineSize::for_model(&coarse.model, sizes).with_labels(None).for_training();
    let mut engine = Engine::new(gpu, size, SchedulerOptions::default())?;
    engine.upload_model(&coarse.model)?;
    Ok(engine)
}

fn common(coarse: &CoarseModel, options: &PlanOptions) -> Result<CommonNeed> {
    let own = sizes(&coarse.dataset);
    let area = own.iter().map(|&(width, height)| u64::from(width) * u64::from(height)).max().unwrap_or(1);
    let trained = if options.max_resolution == coarse.settings.read.max_resolution {
        own
    } else {
        let max_resolution = (options.max_resolution > 0).then_some(options.max_resolution);
        let load = LoadOptions { max_resolution, photos: false, masks: None, ..options.load.clone() };
        sizes(&crate::scenes::open(&coarse.dataset.root, &load)?)
    };
    Ok(CommonNeed {
        image: trained.iter().fold((1, 1), |a, b| (a.0.max(b.0), a.1.max(b.1))),
        max_label: coarse.max_label(),
        pace: coarse.pace,
        coarse: (area, coarse.model.len() as u64),
    })
}

struct Planner<'a> {
    common: CommonNeed,
    card: TargetGpu,
    options: &'a PlanOptions,
    coarse: &'a CoarseModel,
    frame: &'a Frame,
}

impl Planner<'_> {
    /// Divides until all blocks fit: first by estimating what their photos show, then by rendering it.
    fn blocks(&self, engine: &mut Engine, places: &[(usize, DVec3)]) -> Result<Vec<PlannedBlock>> {
        let mut guessed = vec![self.guessed(Cell::whole(places))?];
        while let Some(at) = self.next_to_halve(&guessed) {
            let [low, high] = self.halves(&guessed[at].0, guessed.len())?;
            guessed.splice(at..=at, [self.guessed(low)?, self.guessed(high)?]);
        }
        let mut cells: Vec<Cell> = guessed.into_iter().map(|(cell, _)| cell).collect();
        for _ in 0..DIVISION_ROUNDS_MAX {
            let chosen = choose(engine, self.coarse, self.frame, &cells)?;
            let blocks: Vec<PlannedBlock> =
                cells.iter().zip(chosen).map(|(cell, chosen)| self.block(cell, chosen)).collect::<Result<_>>()?;
            let too_large: Vec<usize> =
                (0..blocks.len()).filter(|&at| blocks[at].trained && !self.card.fits(&blocks[at].need)).collect();
            if too_large.is_empty() {
                return Ok(blocks);
            }
            for at in too_large.into_iter().rev() {
                let halves = self.halves(&cells[at], cells.len())?;
                cells.splice(at..=at, halves);
            }
        }
        let problem = format!(
            "is {} bytes, too little for the surroundings that a block's photos show; use a GPU with more memory, a \
             lower {}, or a smaller coarse model",
            self.options.card,
            Setting("gaussians")
        );
        Err(Error::usage(Setting("card"), problem))
    }

    /// Returns a cell, and true if it is estimated not to fit.
    fn guessed(&self, cell: Cell) -> Result<(Cell, bool)> {
        let zone = self.zone_rows(&cell).len();
        let outside = self.coarse.model.len() - zone;
        let need = self.need(zone, (CONTEXT_SHARE * outside as f64) as u64, self.coarse.dataset.train.len())?;
        Ok((cell, !self.card.fits(&need)))
    }

    /// Returns the largest cell that does not fit, or the largest of all cells while there are too few.
    fn next_to_halve(&self, cells: &[(Cell, bool)]) -> Option<usize> {
        let few = cells.len() < self.options.blocks;
        let candidates = (0..cells.len()).filter(|&at| cells[at].1 || few);
        candidates.min_by_key(|&at| (!cells[at].1, std::cmp::Reverse(cells[at].0.rows.len()), at))
    }

    /// Halves one of `count` cells.
    fn halves(&self, cell: &Cell, count: usize) -> Result<[Cell; 2]> {
        if count >= BLOCKS_MAX {
            let problem = format!("is too small: more than {BLOCKS_MAX} blocks would be needed");
            return Err(Error::usage(Setting("card"), problem));
        }
        cell.halves(|row| self.frame.place(self.coarse.model.world(row)))
    }

    /// Returns the rows of the near Gaussians in the zone of a cell.
    fn zone_rows(&self, cell: &Cell) -> Vec<usize> {
        let zone = self.frame.zone(&cell.zone());
        self.coarse.near_rows.iter().copied().filter(|&row| zone.contains(self.coarse.model.world(row))).collect()
    }

    /// Returns the number of Gaussians after growth from this many coarse Gaussians.
    fn grown(&self, start: usize) -> u64 {
        let all = self.coarse.model.len() as f64;
        let total =
            if self.options.gaussians > 0 { self.options.gaussians as f64 } else { GAUSSIANS_PER_COARSE as f64 * all };
        ((total * start as f64 / all).round() as u64).max(start as u64)
    }

    fn need(&self, start: usize, frozen: u64, views: usize) -> Result<BlockNeed> {
        let steps = if self.options.steps > 0 { self.options.steps } else { self.coarse.settings.train.iterations };
        self.common.need(&self.card, BlockSize { gaussians: self.grown(start), frozen, views }, steps)
    }

    fn block(&self, cell: &Cell, mut chosen: BlockPhotos) -> Result<PlannedBlock> {
        chosen.train.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        chosen.train.truncate(self.options.max_views);
        let mut train: Vec<usize> = chosen.train.iter().map(|(index, _)| *index).collect();
        train.sort_unstable();
        let zone_rows = self.zone_rows(cell);
        let mut in_zone = vec![false; self.coarse.model.len()];
        zone_rows.iter().for_each(|&row| in_zone[row] = true);
        let frozen_rows: Vec<usize> = (0..in_zone.len()).filter(|&row| chosen.is_seen[row] && !in_zone[row]).collect();
        let least = VIEWS_MIN.min((VIEWS_MIN_SHARE * self.coarse.dataset.train.len() as f64).ceil() as usize);
        let (start, frozen) = (zone_rows.len(), frozen_rows.len() as u64);
        Ok(PlannedBlock {
            trained: train.len() >= least,
            gaussians: self.grown(start),
            need: self.need(start, frozen, train.len())?,
            cell: cell.clone(),
            zone_rows,
            frozen_rows,
            train,
            test: chosen.test,
        })
    }
}
