//! Sizes of an engine's memory: initial capacities from known sizes, then growth on demand.

use super::{Engine, EngineSize, LabelSize, Report, predict_for};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::pass::buffers::Capacity;
use crate::pass::{self, KernelShape, Supervision, Update, Variant, loss};
use crate::scheduler::SchedulerOptions;
use crate::scheduler::plan::{Buf, MemoryReport, PassList};
use crate::shaders::constants::{LABEL_ROUNDS, MISSED_ROWS};
use crate::shaders::structs::Counters;
use serde::{Deserialize, Serialize};

/// Grown sizes of an engine's memory. Under a memory limit, they determine the remaining room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GrownSizes {
    /// Gaussians that fit.
    pub gaussians: u32,
    /// (splat, tile) pairs.
    pub instances: u32,
    /// Occupied tiles of object layers.
    pub layer_tiles: u32,
    /// Segments of the longest tile list.
    pub segments: u32,
}

/// Most (Gaussian, label) pairs per vote sweep. At 8 bytes each, they take 128 MiB.
const VOTE_CELLS_MAX: u64 = 1 << 24;
/// Fewest labels per vote sweep, however many Gaussians there are.
const VOTE_COLUMNS_MIN: u64 = 16;

/// Returns initial capacities for `size`, before any measurement.
pub fn capacity(shape: &KernelShape, size: &EngineSize) -> Capacity {
    let (width, height) = size.image;
    let (tiles_x, tiles_y) = shape.tiles(width, height);
    let tiles = u64::from(tiles_x) * u64::from(tiles_y);
    let layers = size.labels.map_or(0, |labels| u64::from(labels.layers));
    let labels = size.labels.map_or(0, |labels| u64::from(labels.max_label) + 1);
    let label_words = if labels > 0 { labels.div_ceil(32) * (layers + 1) } else { 0 };
    // Lists bind the model buffers even if the model is empty.
    let gaussians = size.gaussians.max(1);
    // Typical for trained scenes: larger tiles share fewer Gaussians.
    let instances = if shape.tile_pixels() >= 256 { gaussians * 5 / 2 } else { gaussians * 6 }.max(tiles * 16);
    let trained = if size.trained { gaussians.saturating_sub(u64::from(size.frozen)) } else { 0 };
    let late = if shape.update == Update::Split { 0 } else { trained };
    let mut capacity = Capacity {
        gaussians,
        trained,
        second_moments: if size.half_moments { 0 } else { trained },
        labelled: if labels > 0 { gaussians } else { 0 },
        virtual_tiles: tiles * (layers + 1),
        layer_tiles: if layers > 0 { tiles } else { 0 },
        pixels: u64::from(width) * u64::from(height),
        labelled_pixels: if labels > 0 { u64::from(width) * u64::from(height) } else { 0 },
        labelled_tiles: if labels > 0 { tiles } else { 0 },
        known_depths: if size.depths { u64::from(width) * u64::from(height) } else { 0 },
        label_tables: if labels > 0 { tiles * u64::from(LABEL_ROUNDS) } else { 0 },
        labels,
        vote_columns: vote_columns(size),
        vote_cells: if size.trained { 0 } else { vote_columns(size) * gaussians },
        layers: if labels > 0 { layers + 1 } else { 0 },
        occluder_words: label_words,
        loss_partials: u64::from(loss::partials(shape, width, height)),
        late_gaussians: late,
        missed_rows: if late > 0 { u64::from(MISSED_ROWS) } else { 0 },
        segments: 1,
        shared_rows: u64::from(size.shared_rows),
        ..Capacity::default()
    };
    derive(shape, &mut capacity, instances, size.trained);
    capacity
}

/// Returns the capacities and the list with which a training counts votes; `None` if its usual capacities suffice.
pub(super) fn vote_capacity(
    shape: &KernelShape,
    capacity: &Capacity,
    size: &EngineSize,
) -> Option<(Capacity, PassList)> {
    let mut counting = Capacity { vote_cells: vote_columns(size) * capacity.gaussians, ..*capacity };
    // Counting votes needs no gradients.
    derive(shape, &mut counting, capacity.instances, false);
    let list = || pass::vote_view(shape, &counting, 1, false);
    (size.trained && counting.vote_cells > 0).then(|| (counting, list()))
}

/// Returns the labels per vote sweep: all if they fit in [`VOTE_CELLS_MAX`], but at least [`VOTE_COLUMNS_MIN`].
fn vote_columns(size: &EngineSize) -> u64 {
    let fit = (VOTE_CELLS_MAX / size.gaussians.max(1)).max(VOTE_COLUMNS_MIN);
    size.labels.map_or(0, |labels| u64::from(labels.vote_columns)).min(fit)
}

/// Sets the capacities that depend on the numbers of instances and layer tiles.
fn derive(shape: &KernelShape, capacity: &mut Capacity, instances: u64, trained: bool) {
    capacity.instances = instances;
    capacity.key_words = if shape.has_narrow_keys(capacity.virtual_tiles) { instances.div_ceil(2) } else { instances };
    capacity.trained_instances = if trained { instances } else { 0 };
    capacity.layer_pixels = capacity.layer_tiles * u64::from(shape.tile_pixels());
    let tiles = capacity.tiles();
    let jobs = tiles + capacity.layer_tiles;
    capacity.segment_pixels = if capacity.segments > 1 { jobs * u64::from(shape.tile_pixels()) } else { 0 };
    let trained = |chunks: u64| if trained { chunks } else { 0 };
    capacity.chunks = trained(shape.chunks(instances, jobs));
    capacity.chunk_pixels = trained(shape.chunks(instances, 1) * u64::from(shape.tile_pixels()));
    let channels = trained(shape.chunks(instances, tiles) * u64::from(shape.tile_pixels()));
    capacity.chunk_channels = if capacity.labelled + capacity.known_depths > 0 { channels } else { 0 };
    capacity.sweep_cells = shape.sweep_cells(instances.max(capacity.gaussians));
    if !shape.sweeps() {
        capacity.sort_lanes = u64::from(shape.lanes(instances.max(capacity.gaussians)));
        capacity.sort_cells = capacity.sort_lanes << shape.digit_bits;
        capacity.sort_totals = capacity.sort_cells / u64::from(shape.subgroup);
    }
    if shape.group_walks {
        // Splats, pairs, and tiles; or Gaussians twice.
        let looks = [capacity.gaussians, capacity.gaussians, capacity.virtual_tiles].map(KernelShape::look_cells);
        capacity.look_cells = capacity.sweep_cells + looks.iter().sum::<u64>();
    } else {
        capacity.scan_lanes = 2 * u64::from(shape.lanes(capacity.gaussians.max(capacity.virtual_tiles)));
    }
}

/// The training step with the most buffers.
fn widest(size: &EngineSize) -> Variant {
    // Layers need more memory than a disagreement.
    let supervision = match size.labels {
        Some(labels) if labels.layers > 0 => Supervision::Layers { lift: true },
        Some(_) => Supervision::Disagreement,
        None if size.depths => Supervision::Depth,
        None => Supervision::Photo,
    };
    Variant { supervision, ..Variant::plain(size.image) }
}

impl Engine {
    /// Labels per vote sweep; 0 without memory for votes.
    pub(crate) fn vote_columns(&self) -> usize {
        vote_columns(&self.size) as usize
    }

    /// Predicts the memory of an engine of this size, without allocating.
    #[doc(hidden)]
    pub fn predict(gpu: &Gpu, size: &EngineSize, options: SchedulerOptions) -> Result<MemoryReport> {
        predict_for(&KernelShape::for_device(gpu.capabilities()), &options.limits(gpu), size)
    }

    /// Returns the lists that decide the amount of scratch memory.
    #[doc(hidden)]
    pub fn lists_of(shape: &KernelShape, capacity: &Capacity, size: &EngineSize) -> Vec<PassList> {
        let mut lists = vec![pass::render_view(shape, capacity, 3, size.labels.map_or(0, |_| 1))];
        if size.trained {
            lists.insert(0, pass::training_step(shape, capacity, widest(size)));
            lists.push(pass::densify_apply(shape, capacity, size.labels.is_some()));
            lists.push(pass::relocate_apply(shape, capacity, size.labels.is_some()));
        }
        lists
    }

    /// Grows the model buffers if `count` Gaussians do not fit. All lists are then recorded again.
    #[doc(hidden)]
    pub fn make_room_for_gaussians(&mut self, count: u64) -> Result<()> {
        if count <= self.size.gaussians {
            return Ok(());
        }
        self.check_idle()?;
        let roomy = self.grown(self.size.gaussians, count);
        let gaussians = if self.fits(&self.with_gaussians(roomy))? { roomy } else { count };
        let gaussians = match self.set_capacity(self.with_gaussians(gaussians)) {
            // Drivers may offer less memory than they report.
            Err(error) if error.is_out_of_memory() && gaussians > count => {
                self.set_capacity(self.with_gaussians(count))?;
                count
            }
            other => other.map(|()| gaussians)?,
        };
        self.size.gaussians = gaussians;
        Ok(())
    }

    /// Adds memory for the labels of a model. No list may be in flight.
    pub(super) fn make_room_for_labels(&mut self) -> Result<()> {
        self.check_idle()?;
        let size = self.size.with_labels(Some(LabelSize::default()));
        self.set_capacity(self.capacity_for(&size))?;
        self.size = size;
        Ok(())
    }

    /// Grows the image buffers to at least `width` x `height` px and keeps the model. No list may be in flight.
    /// All lists are then recorded again.
    pub fn grow_image(&mut self, width: u32, height: u32) -> Result<()> {
        let image = (self.size.image.0.max(width), self.size.image.1.max(height));
        let size = EngineSize { image, ..self.size }.in_bands(&self.shape);
        if size == self.size {
            return Ok(());
        }
        self.check_idle()?;
        size.check(&self.shape)?;
        self.set_capacity(self.capacity_for(&size))?;
        self.size = size;
        Ok(())
    }

    /// Returns the largest number of Gaussians, up to `wanted`, that fits in memory; at least the current room.
    pub(crate) fn most_gaussians(&self, wanted: u64) -> Result<u64> {
        let (mut fits, mut too_many) = (self.size.gaussians, wanted + 1);
        if wanted <= fits || self.fits(&self.with_gaussians(wanted))? {
            return Ok(wanted);
        }
        while fits + 1 < too_many {
            let middle = fits.midpoint(too_many);
            if self.fits(&self.with_gaussians(middle))? {
                fits = middle;
            } else {
                too_many = middle;
            }
        }
        Ok(fits)
    }

    fn grown(&self, current: u64, needed: u64) -> u64 {
        Capacity::grown(current, needed, !self.gpu().is_cpu())
    }

    fn with_gaussians(&self, gaussians: u64) -> Capacity {
        self.capacity_for(&EngineSize { gaussians, ..self.size })
    }

    /// Returns capacities for a larger size, with at least the pairs, tiles and segments needed so far.
    fn capacity_for(&self, size: &EngineSize) -> Capacity {
        let old = &self.capacity;
        let mut new = capacity(&self.shape, size);
        new.layer_tiles = new.layer_tiles.max(old.layer_tiles);
        new.segments = old.segments;
        let instances = new.instances.max(old.instances);
        derive(&self.shape, &mut new, instances, self.size.trained);
        new
    }

    /// Returns true if the memory suffices for these capacities and all lists.
    fn fits(&self, capacity: &Capacity) -> Result<bool> {
        let mut lists = Self::lists_of(&self.shape, capacity, &self.size);
        if self.size.trained && self.passes > 0 {
            let variant = widest(&self.size);
            lists.push(pass::extended_step(&self.shape, capacity, variant, (&*self.extension, self.passes)));
        }
        let fit = |capacity: &Capacity, lists: &[PassList]| match self.sched.predict_here(&capacity.counts(), lists) {
            Ok(_) => Ok(true),
            Err(Error::OutOfMemory { .. }) => Ok(false),
            Err(other) => Err(other),
        };
        let counting = vote_capacity(&self.shape, capacity, &self.size);
        Ok(fit(capacity, &lists)? && counting.map_or(Ok(true), |(counting, list)| fit(&counting, &[list]))?)
    }

    /// Begins a vote sweep with all votes at 0. During training, votes take the memory of gradients and scratch until
    /// [`Engine::end_votes`]. No list may be in flight.
    pub(crate) fn begin_votes(&mut self) -> Result<()> {
        self.check_idle()?;
        match vote_capacity(&self.shape, &self.capacity, &self.size) {
            Some((counting, _)) => self.set_capacity(counting),
            None => Ok(()),
        }
    }

    /// Ends a vote sweep.
    pub(crate) fn end_votes(&mut self) -> Result<()> {
        if !self.trades_votes() {
            return Ok(());
        }
        let mut steps = Capacity { vote_cells: 0, ..self.capacity };
        derive(&self.shape, &mut steps, self.capacity.instances, true);
        self.set_capacity(steps)
    }

    /// True while a training has votes instead of gradients.
    fn trades_votes(&self) -> bool {
        self.size.trained && self.capacity.vote_cells > 0
    }

    /// Grows the buffers that were too small for a failed list, and clears the failure. Returns true if a buffer grew;
    /// the lists in flight then had no effect.
    #[doc(hidden)]
    pub fn recover(&mut self, report: &Report) -> Result<bool> {
        if report.counters.failure == 0 {
            return Ok(false);
        }
        self.abandon()?;
        let needed = &report.counters;
        let grown = self.capacity_of(needed, |current, needed| self.grown(current, needed));
        // If growth with reserves does not fit, allocate exactly what is needed.
        let least = self.capacity_of(needed, |_, needed| needed);
        let new = if self.fits(&grown)? { grown } else { least };
        if new == self.capacity {
            return Err(Error::Bug(format!(
                "failure {}, but all buffers are large enough: {needed:?}",
                report.counters.failure
            )));
        }
        tracing::debug!(
            "buffers grow: {} instances, {} layer tiles, {} segments",
            new.instances,
            new.layer_tiles,
            new.segments
        );
        match self.set_capacity(new) {
            Err(error) if error.is_out_of_memory() && new != least => self.set_capacity(least)?,
            other => other?,
        }
        self.sched.fill(Buf::COUNTERS, 0)?;
        Ok(true)
    }

    /// Returns the current capacities, grown where they were too small.
    fn capacity_of(&self, needed: &Counters, grown: impl Fn(u64, u64) -> u64) -> Capacity {
        let mut new = self.capacity;
        let follow = |have: &mut u64, needed: u32| {
            if u64::from(needed) > *have {
                *have = grown(*have, u64::from(needed));
            }
        };
        follow(&mut new.instances, needed.instance_count);
        follow(&mut new.layer_tiles, needed.layer_tile_count);
        new.segments = new.segments.max(u64::from(needed.longest_list.div_ceil(self.shape.segment_length)));
        let instances = new.instances;
        derive(&self.shape, &mut new, instances, self.size.trained && !self.trades_votes());
        new
    }

    /// Returns the grown sizes.
    pub(crate) fn sizes(&self) -> GrownSizes {
        let capacity = &self.capacity;
        let word = |size: u64| u32::try_from(size).unwrap_or(u32::MAX);
        GrownSizes {
            gaussians: word(self.size.gaussians),
            instances: word(capacity.instances),
            layer_tiles: word(capacity.layer_tiles),
            segments: word(capacity.segments),
        }
    }

    /// Grows a new engine's memory to the sizes of an earlier engine.
    pub(crate) fn grow_to(&mut self, sizes: GrownSizes) -> Result<()> {
        let gaussians = self.size.gaussians.max(u64::from(sizes.gaussians));
        let mut new = capacity(&self.shape, &EngineSize { gaussians, ..self.size });
        if new.layer_tiles > 0 {
            new.layer_tiles = new.layer_tiles.max(u64::from(sizes.layer_tiles));
        }
        new.segments = new.segments.max(u64::from(sizes.segments));
        let instances = new.instances.max(u64::from(sizes.instances));
        derive(&self.shape, &mut new, instances, self.size.trained);
        self.set_capacity(new)?;
        self.size.gaussians = gaussians;
        Ok(())
    }

    /// Changes the capacities; all lists are then recorded again.
    #[doc(hidden)]
    pub fn set_capacity(&mut self, capacity: Capacity) -> Result<()> {
        self.lists.clear();
        self.sched.set_counts(capacity.counts())?;
        self.capacity = capacity;
        Ok(())
    }
}
