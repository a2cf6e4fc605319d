//! A device with a model in its memory.
//!
//! [`Engine::for_model`] opens one that is ready to [`render`](crate::render::render()). Inside the crate, higher
//! modules use the scheduler through this module: `Engine::run` runs a pass list and waits for it, `Engine::submit` and
//! `Engine::retire` keep steps in flight, and transfers are typed.

mod ahead;
mod bands;
mod card;
mod data;
pub mod growth;
mod input;
mod label_ids;
mod late;
mod missed;
pub(crate) mod model;
mod moments;
pub mod run;
mod size;
pub(crate) mod state;
pub(crate) mod uniforms;

pub(crate) use bands::Band;
#[cfg(feature = "cli")]
pub(crate) use card::predict_votes;
pub(crate) use card::{card, predict_for};
pub(crate) use growth::{GrownSizes, capacity};
pub(crate) use input::{Input, LayerInput, SharedRow, TrainInput, VoteInput};
pub(crate) use label_ids::tell_apart;
pub(crate) use run::{InFlight, ListKey, Recording, Report};
pub use size::{EngineSize, LabelSize};

use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::buffers::{Capacity, TABLE};
use crate::pass::{Extension, KernelShape};
use crate::scene::{Camera, Gaussians, Zone};
use crate::scheduler::{ListId, Scheduler, SchedulerOptions};
use crate::shaders::structs::StepUniforms;
use ahead::KernelCompiler;
use glam::DVec3;
use label_ids::LabelIds;
use missed::MissedUpdates;
use std::collections::HashMap;
use std::sync::Arc;

/// A device with a model in its memory.
pub struct Engine {
    sched: Scheduler,
    capacity: Capacity,
    shape: KernelShape,
    size: EngineSize,
    lists: HashMap<ListKey, ListId>,
    gaussian_count: u32,
    sh_degree: u32,
    ids: LabelIds,
    /// World position of the model's local origin.
    origin: DVec3,
    /// Passes that extended steps add.
    extension: Arc<dyn Extension>,
    /// Variant of these passes that memory predictions include; 0 for none.
    passes: u32,
    /// Walks per tile with which label maps start; grows to the number needed so far.
    label_rounds: u32,
    /// Stamp of the last submit; 0 before the first.
    stamp: u32,
    last_frame: usize,
    /// Frames with an unread report.
    in_flight: Vec<bool>,
    /// What Gaussians have missed.
    missed: MissedUpdates,
    /// Compiles kernels of later lists.
    ahead: Option<KernelCompiler>,
    /// Every run is checked for out-of-bounds writes.
    has_guards: bool,
}

impl Engine {
    /// Creates an engine with memory for `size`.
    #[doc(hidden)]
    pub fn new(gpu: Arc<Gpu>, size: EngineSize, options: SchedulerOptions) -> Result<Self> {
        let shape = KernelShape::for_device(gpu.capabilities());
        Self::with_shape(gpu, shape, size, options)
    }

    /// Opens an engine with `model` on the device, ready to [`render`](crate::render::render) pictures of up to the
    /// largest of `images`, (width, height) in px.
    pub fn for_model(gpu: Arc<Gpu>, model: &Gaussians, images: impl IntoIterator<Item = (u32, u32)>) -> Result<Self> {
        let size = EngineSize::for_model(model, images.into_iter());
        let mut engine = Self::new(gpu, size, SchedulerOptions::default())?;
        engine.upload_model(model)?;
        Ok(engine)
    }

    /// Same as [`Engine::new`], with kernels of a given shape.
    #[doc(hidden)]
    pub fn with_shape(gpu: Arc<Gpu>, shape: KernelShape, size: EngineSize, options: SchedulerOptions) -> Result<Self> {
        shape.check()?;
        let size = size.in_bands(&shape);
        size.check(&shape)?;
        let shape = shape.for_labels(size.labels.map_or(0, |labels| labels.max_label));
        let capacity = capacity(&shape, &size);
        let sched = Scheduler::new(gpu, TABLE, capacity.counts(), options)?;
        Ok(Self {
            in_flight: vec![false; sched.frames()],
            sched,
            capacity,
            shape,
            size,
            lists: HashMap::new(),
            gaussian_count: 0,
            sh_degree: 0,
            ids: LabelIds::default(),
            origin: DVec3::ZERO,
            extension: Arc::new(()),
            passes: 0,
            label_rounds: 1,
            stamp: 0,
            last_frame: 0,
            missed: MissedUpdates::default(),
            ahead: None,
            has_guards: options.plan.guards,
        })
    }

    /// The device.
    pub fn gpu(&self) -> &Arc<Gpu> {
        self.sched.gpu()
    }

    /// Shape of the kernels.
    #[doc(hidden)]
    pub fn shape(&self) -> &KernelShape {
        &self.shape
    }

    /// Current capacities of the buffers.
    #[doc(hidden)]
    pub fn capacity(&self) -> &Capacity {
        &self.capacity
    }

    /// Sizes of the memory.
    pub fn size(&self) -> &EngineSize {
        &self.size
    }

    /// Number of Gaussians in the model.
    pub fn gaussian_count(&self) -> u32 {
        self.gaussian_count
    }

    /// Number of trained Gaussians; frozen ones follow them.
    pub fn trained_count(&self) -> u32 {
        self.gaussian_count.saturating_sub(self.size.frozen)
    }

    /// Sets the number of Gaussians on the device, after a densification.
    pub(crate) fn set_gaussian_count(&mut self, count: u32) {
        self.gaussian_count = count;
    }

    /// World position of the model's local origin: positions on the device are relative to it.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Degree of the model's spherical harmonics.
    pub fn sh_degree(&self) -> u32 {
        self.sh_degree
    }

    /// Changes the degree of the model; bands without uploaded coefficients are 0.
    pub(crate) fn set_sh_degree(&mut self, sh_degree: u32) {
        self.sh_degree = sh_degree;
    }

    /// Sets whether pictures are antialiased ([`Gaussians::antialiased`]).
    pub(crate) fn set_antialiased(&mut self, antialiased: bool) {
        if self.shape.antialiased != antialiased {
            self.shape.antialiased = antialiased;
            self.lists.clear();
        }
    }

    /// Sets the passes that [`ListKey::Extended`] adds; call it before the first such step. Memory predictions include
    /// the variant `passes`; 0 for none.
    pub(crate) fn set_extension(&mut self, extension: Arc<dyn Extension>, passes: u32) {
        (self.extension, self.passes) = (extension, passes);
    }

    /// Copies a model into the device's memory; moments and statistics become 0. A rendering engine allocates label
    /// memory when it gets the first model with labels. Labels above [`LABEL_MAX`](crate::scene::LABEL_MAX) are for
    /// rendering only.
    pub fn upload_model(&mut self, gaussians: &Gaussians) -> Result<()> {
        if gaussians.labels.is_some() && self.size.labels.is_none() && !self.size.trained {
            self.make_room_for_labels()?;
        }
        self.make_room_for_gaussians(gaussians.len() as u64)?;
        self.ids = model::upload(&mut self.sched, gaussians, &self.size)?;
        self.gaussian_count = gaussians.len() as u32;
        (self.sh_degree, self.origin) = (gaussians.sh_degree, gaussians.origin);
        self.set_antialiased(gaussians.antialiased);
        self.start_updates()
    }

    /// Reads the model back.
    pub fn download_model(&mut self) -> Result<Gaussians> {
        self.sched.wait_all()?;
        let late = self.late()?;
        let count = self.gaussian_count as usize;
        let model = model::download(&mut self.sched, late.as_ref(), count, self.sh_degree)?;
        let labels = if self.size.labels.is_some() { Some(self.labels()?) } else { None };
        Ok(Gaussians { labels, origin: self.origin, antialiased: self.shape.antialiased, ..model })
    }

    /// Returns the camera's part of the uniforms for the model; all other fields are 0.
    pub(crate) fn view_uniforms(&self, camera: &Camera, near: f32, background: [f32; 3]) -> StepUniforms {
        uniforms::view_uniforms(camera, self.origin, &self.shape, near, background, self.gaussian_count)
    }

    /// Adds the box in which Gaussians grow.
    pub(crate) fn with_grow_box(&self, uniforms: StepUniforms, zone: &Zone) -> StepUniforms {
        let [grow_axis0, grow_axis1, grow_axis2] = zone.axes.map(|axis| axis.as_vec3().to_array());
        let origin = zone.to_axes(self.origin);
        // Open sides stay open.
        let corner = |at: DVec3| (at - origin).clamp(DVec3::splat(f32::MIN.into()), DVec3::splat(f32::MAX.into()));
        let (grow_low, grow_high) = (corner(zone.low).as_vec3().to_array(), corner(zone.high).as_vec3().to_array());
        StepUniforms { grow_axis0, grow_axis1, grow_axis2, grow_low, grow_high, ..uniforms }
    }

    /// Adds free space on the way to another camera.
    pub(crate) fn with_free_space(&self, uniforms: StepUniforms, camera: &Camera, near: f32) -> StepUniforms {
        let free_centre = camera.relative_to(self.origin).centre().as_vec3().to_array();
        StepUniforms { free_centre, free_near: near, ..uniforms }
    }
}
