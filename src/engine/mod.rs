//! What training and rendering share: one device, one model in its memory, and the pass lists that work on it.

mod growth;
pub mod model;
pub mod state;
pub mod uniforms;

pub use growth::{GrownSizes, capacity};

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::pass::{self, KernelShape, Variant};
use crate::scene::Gaussians;
use crate::scheduler::plan::{Buf, TABLE};
use crate::scheduler::{ListId, Scheduler, SchedulerOptions, Ticket};
use crate::shaders::structs::Counters;
use glam::DVec3;
use std::collections::HashMap;
use std::sync::Arc;

/// Room for labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LabelSize {
    /// Largest id.
    pub max_label: u32,
    /// Objects sampled in one step, at most.
    pub layers: u32,
    /// Labels that one sweep of votes counts, 0 without votes.
    pub vote_columns: u32,
}

/// What the memory of an engine is sized for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EngineSize {
    /// Gaussians.
    pub gaussians: u64,
    /// Largest image, px.
    pub size: (u32, u32),
    /// Optimiser state and gradients.
    pub trained: bool,
    /// Labels; none for a scene without masks, which then pays nothing for them.
    pub labels: Option<LabelSize>,
}

/// Which list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ListKey {
    /// One optimiser step.
    Train(Variant),
    /// One optimiser step with so many sampled objects that have passes of their own, see [`pass::separate_step`].
    #[cfg(feature = "lab")]
    Separate(Variant, u32),
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
    room: EngineSize,
    lists: HashMap<ListKey, ListId>,
    gaussian_count: u32,
    /// What the positions of the model are relative to.
    origin: DVec3,
}

impl Engine {
    /// Allocates for `room`.
    pub fn new(gpu: Arc<Gpu>, room: EngineSize, options: SchedulerOptions) -> Result<Self> {
        let shape = KernelShape::of(gpu.capabilities());
        Self::with_shape(gpu, shape, room, options)
    }

    /// As [`Engine::new`], with kernels of a given shape.
    pub fn with_shape(gpu: Arc<Gpu>, shape: KernelShape, room: EngineSize, options: SchedulerOptions) -> Result<Self> {
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
        Ok(Self { sched, shape, room, lists: HashMap::new(), gaussian_count: 0, origin: DVec3::ZERO })
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
    pub fn room(&self) -> &EngineSize {
        &self.room
    }

    /// Gaussians of the model.
    pub fn gaussian_count(&self) -> u32 {
        self.gaussian_count
    }

    /// The world position that the positions on the device are relative to.
    pub fn origin(&self) -> DVec3 {
        self.origin
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
        self.origin = gaussians.origin;
        Ok(())
    }

    /// Reads the model back.
    pub fn download_model(&mut self, sh_degree: u32) -> Result<Gaussians> {
        self.sched.wait_all()?;
        let labels = self.room.labels.is_some();
        let model = model::download(&mut self.sched, self.gaussian_count as usize, sh_degree, labels)?;
        Ok(Gaussians { origin: self.origin, ..model })
    }

    /// The recorded list for a key; recorded on first use.
    pub fn list(&mut self, key: ListKey) -> Result<ListId> {
        if let Some(&id) = self.lists.get(&key) {
            return Ok(id);
        }
        let (shape, capacity) = (&self.shape, self.sched.capacity());
        let list = match key {
            ListKey::Train(variant) => pass::training_step(shape, capacity, variant),
            #[cfg(feature = "lab")]
            ListKey::Separate(variant, objects) => pass::separate_step(shape, capacity, variant, objects),
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

    /// Submits a list with the host's data of a frame.
    pub fn submit(&mut self, key: ListKey, frame: usize) -> Result<Ticket> {
        let id = self.list(key)?;
        self.sched.submit(id, frame)
    }

    /// What the last list of a frame reports; waits for it.
    pub fn report(&mut self, frame: usize) -> Result<Report> {
        self.sched.wait_frame(frame)?;
        let counters = self.sched.download::<Counters>(Buf::REPORT, frame, 0, 1)?[0];
        let failure = self.sched.download::<u32>(Buf::REPORT_FAILURE, frame, 0, 1)?[0];
        Ok(Report { counters, failure })
    }
}
