//! What training and rendering share: one device, one model in its memory, and the pass lists that work on it.

pub mod model;
pub mod uniforms;

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::pass::{self, KernelShape, Variant, loss};
use crate::plan::{Buf, Capacity, MemoryReport, PassList, TABLE};
use crate::scene::Gaussians;
use crate::sched::{ListId, Scheduler, SchedulerOptions, Ticket, limits_of};
use crate::shaders::structs::Counters;
use std::collections::HashMap;
use std::sync::Arc;

/// Room for labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LabelRoom {
    /// Largest id.
    pub max_label: u32,
    /// Objects sampled in one step, at most.
    pub layers: u32,
    /// Labels that one sweep of votes counts, 0 without votes.
    pub vote_columns: u32,
}

/// What the memory of an engine is sized for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    /// Gaussians.
    pub gaussians: u64,
    /// Largest image, px.
    pub size: (u32, u32),
    /// Optimiser state and gradients.
    pub trained: bool,
    /// Labels; none for a scene without masks, which then pays nothing for them.
    pub labels: Option<LabelRoom>,
}

/// Which list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ListKey {
    /// One optimiser step.
    Train(Variant),
    /// One picture, with this degree of the spherical harmonics.
    Render(u32),
    /// Votes of one view; tiles are walked so many times, four labels each.
    Vote(u32),
    /// Count of a densification.
    DensifyCount,
    /// Densification.
    DensifyApply,
    /// Opacity reset.
    OpacityReset,
}

/// What a submitted list reports.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// Counters.
    pub counters: Counters,
    /// Sticky failure bits (glsl/include/step.glsl).
    pub failure: u32,
}

/// A device with a model in its memory.
pub struct Engine {
    sched: Scheduler,
    shape: KernelShape,
    room: Room,
    lists: HashMap<ListKey, ListId>,
    gaussian_count: u32,
}

/// Capacities for some room, before any measurement.
pub fn capacity(shape: &KernelShape, room: &Room) -> Capacity {
    let (width, height) = room.size;
    let (tiles_x, tiles_y) = shape.tiles(width, height);
    let tiles = u64::from(tiles_x) * u64::from(tiles_y);
    let layers = room.labels.map_or(0, |labels| u64::from(labels.layers));
    let labels = room.labels.map_or(0, |labels| u64::from(labels.max_label) + 1);
    let label_words = if labels > 0 { labels.div_ceil(32) * (layers + 1) } else { 0 };
    // Lists bind the model even if it is empty.
    let gaussians = room.gaussians.max(1);
    let instances = (gaussians * 6).max(tiles * 16);
    let mut capacity = Capacity {
        gaussians,
        trained: if room.trained { gaussians } else { 0 },
        labelled: if labels > 0 { gaussians } else { 0 },
        virtual_tiles: tiles * (layers + 1),
        layer_tiles: if layers > 0 { tiles } else { 0 },
        pixels: u64::from(width) * u64::from(height),
        labelled_pixels: if labels > 0 { u64::from(width) * u64::from(height) } else { 0 },
        labels,
        vote_columns: room.labels.map_or(0, |labels| u64::from(labels.vote_columns)),
        vote_cells: room.labels.map_or(0, |labels| u64::from(labels.vote_columns)) * gaussians,
        layers: if labels > 0 { layers + 1 } else { 0 },
        occluder_words: label_words,
        loss_partials: u64::from(loss::partials(shape.subgroup, width, height)),
        segments: 1,
        ..Capacity::default()
    };
    derive(shape, &mut capacity, instances, room.trained);
    capacity
}

/// Fills in what follows from the number of instances and of layer tiles.
fn derive(shape: &KernelShape, capacity: &mut Capacity, instances: u64, trained: bool) {
    capacity.instances = instances;
    capacity.trained_instances = if trained { instances } else { 0 };
    capacity.layer_pixels = capacity.layer_tiles * u64::from(shape.tile_pixels());
    let jobs = (capacity.pixels.div_ceil(u64::from(shape.tile_pixels())) * 2) + capacity.layer_tiles;
    capacity.segment_pixels = if capacity.segments > 1 { jobs * u64::from(shape.tile_pixels()) } else { 0 };
    capacity.sort_lanes = u64::from(shape.lanes(instances.max(capacity.gaussians)));
    capacity.sort_cells = capacity.sort_lanes << shape.digit_bits;
    capacity.scan_lanes = 2 * u64::from(shape.lanes(capacity.gaussians.max(capacity.virtual_tiles)));
}

impl Engine {
    /// Allocates for `room`.
    pub fn new(gpu: Arc<Gpu>, room: Room, options: SchedulerOptions) -> Result<Self> {
        let shape = KernelShape::new(gpu.subgroup_size(), gpu.is_cpu());
        Self::with_shape(gpu, shape, room, options)
    }

    /// As [`Engine::new`], with kernels of a given shape.
    pub fn with_shape(gpu: Arc<Gpu>, shape: KernelShape, room: Room, options: SchedulerOptions) -> Result<Self> {
        shape.check()?;
        let (tiles_x, tiles_y) = shape.tiles(room.size.0, room.size.1);
        // A splat may touch every tile, once more in its object's layer, and one loop walks them (65,535 rounds).
        let most = if room.labels.is_some() { 32_500 } else { 65_000 };
        if u64::from(tiles_x) * u64::from(tiles_y) > most {
            return Err(Error::usage(
                "--max-resolution",
                format!(
                    "{} x {} px make {tiles_x} x {tiles_y} tiles, at most {most} are supported; choose a smaller size",
                    room.size.0, room.size.1
                ),
            ));
        }
        let sched = Scheduler::new(gpu, TABLE, capacity(&shape, &room), options)?;
        Ok(Self { sched, shape, room, lists: HashMap::new(), gaussian_count: 0 })
    }

    /// The memory that an engine for `room` would take, before anything is allocated.
    pub fn predict(gpu: &Gpu, room: &Room) -> Result<MemoryReport> {
        let shape = KernelShape::new(gpu.subgroup_size(), gpu.is_cpu());
        let capacity = capacity(&shape, room);
        let lists = Self::lists_of(&shape, &capacity, room);
        Scheduler::predict(TABLE, &capacity, &lists, &limits_of(gpu))
    }

    /// The lists that decide how much scratch memory is needed.
    pub fn lists_of(shape: &KernelShape, capacity: &Capacity, room: &Room) -> Vec<PassList> {
        let mut lists = vec![pass::render_view(shape, capacity, 3)];
        if room.trained {
            let variant = Variant {
                labels: room.labels.is_some(),
                lift: room.labels.is_some(),
                sh_degree: 3,
                size: room.size,
                update: true,
            };
            lists.insert(0, pass::training_step(shape, capacity, variant));
            lists.push(pass::densify_apply(shape, capacity, room.labels.is_some()));
        }
        lists
    }

    /// The scheduler underneath.
    pub fn sched(&self) -> &Scheduler {
        &self.sched
    }

    /// The scheduler underneath, for uploads and downloads.
    pub fn sched_mut(&mut self) -> &mut Scheduler {
        &mut self.sched
    }

    /// Shape of the kernels.
    pub fn shape(&self) -> &KernelShape {
        &self.shape
    }

    /// What the memory is sized for.
    pub fn room(&self) -> &Room {
        &self.room
    }

    /// Gaussians of the model.
    pub fn gaussian_count(&self) -> u32 {
        self.gaussian_count
    }

    /// Says that the device now holds so many Gaussians (after a densification).
    pub fn set_gaussian_count(&mut self, count: u32) {
        self.gaussian_count = count;
    }

    /// Puts a model into the device's memory; moments and statistics start at 0.
    pub fn upload_model(&mut self, gaussians: &Gaussians) -> Result<()> {
        self.make_room_for_gaussians(gaussians.len() as u64)?;
        model::upload(&mut self.sched, gaussians, self.room.labels.is_some())?;
        self.gaussian_count = gaussians.len() as u32;
        Ok(())
    }

    /// Reads the model back.
    pub fn download_model(&mut self, sh_degree: u32) -> Result<Gaussians> {
        self.sched.wait_all()?;
        model::download(&mut self.sched, self.gaussian_count as usize, sh_degree, self.room.labels.is_some())
    }

    /// The recorded list for a key; recorded on first use.
    pub fn list(&mut self, key: ListKey) -> Result<ListId> {
        if let Some(&id) = self.lists.get(&key) {
            return Ok(id);
        }
        let (shape, capacity) = (&self.shape, self.sched.capacity());
        let list = match key {
            ListKey::Train(variant) => pass::training_step(shape, capacity, variant),
            ListKey::Render(sh_degree) => pass::render_view(shape, capacity, sh_degree),
            ListKey::Vote(rounds) => pass::vote_view(shape, capacity, rounds),
            ListKey::DensifyCount => pass::densify_count(shape, capacity),
            ListKey::DensifyApply => pass::densify_apply(shape, capacity, self.room.labels.is_some()),
            ListKey::OpacityReset => pass::opacity_reset(shape, capacity),
        };
        let id = self.sched.prepare(&list)?;
        self.lists.insert(key, id);
        Ok(id)
    }

    /// Submits a list with the host's data of a slot.
    pub fn submit(&mut self, key: ListKey, slot: usize) -> Result<Ticket> {
        let id = self.list(key)?;
        self.sched.submit(id, slot)
    }

    /// What the last list of a slot reports; waits for it.
    pub fn report(&mut self, slot: usize) -> Result<Report> {
        self.sched.wait_slot(slot)?;
        let counters = self.sched.download::<Counters>(Buf::REPORT, slot, 0, 1)?[0];
        let failure = self.sched.download::<u32>(Buf::REPORT_FAILURE, slot, 0, 1)?[0];
        Ok(Report { counters, failure })
    }

    /// Grows the model's buffers if `count` Gaussians do not fit. All lists are recorded again.
    pub fn make_room_for_gaussians(&mut self, count: u64) -> Result<()> {
        if count <= self.room.gaussians {
            return Ok(());
        }
        self.room.gaussians = Capacity::grown(self.room.gaussians, count);
        let old = *self.sched.capacity();
        let mut new = capacity(&self.shape, &self.room);
        new.layer_tiles = new.layer_tiles.max(old.layer_tiles);
        new.segments = old.segments;
        let instances = new.instances.max(old.instances);
        derive(&self.shape, &mut new, instances, self.room.trained);
        self.set_capacity(new)
    }

    /// Grows what a failed list needed, and clears the failure. True if something grew.
    pub fn recover(&mut self, report: &Report) -> Result<bool> {
        if report.failure == 0 {
            return Ok(false);
        }
        self.sched.wait_all()?;
        let (needed, mut new) = (&report.counters, *self.sched.capacity());
        if u64::from(needed.instance_count) > new.instances {
            new.instances = Capacity::grown(new.instances, u64::from(needed.instance_count));
        }
        if u64::from(needed.layer_tile_count) > new.layer_tiles {
            new.layer_tiles = Capacity::grown(new.layer_tiles, u64::from(needed.layer_tile_count));
        }
        new.segments = new.segments.max(u64::from(needed.longest_list.div_ceil(self.shape.segment_length)));
        let instances = new.instances;
        derive(&self.shape, &mut new, instances, self.room.trained);
        if new == *self.sched.capacity() {
            return Err(Error::Bug(format!("failure {} without a need: {needed:?}", report.failure)));
        }
        tracing::debug!(
            "buffers grow: {} instances, {} layer tiles, {} segments",
            new.instances,
            new.layer_tiles,
            new.segments
        );
        self.set_capacity(new)?;
        self.sched.fill(Buf::FAILURE, 0)?;
        Ok(true)
    }

    fn set_capacity(&mut self, capacity: Capacity) -> Result<()> {
        self.lists.clear();
        self.sched.set_capacity(capacity)
    }
}
