//! The work of the engine as lists of GPU passes. This module declares passes; the scheduler records them.
//!
//! Start with [`training_step`]: it lists all stages of a step.

mod blend;
pub mod buffers;
pub mod build;
pub(crate) mod densify;
mod gather;
mod kernels;
mod lift;
pub(crate) mod loss;
pub(crate) mod optimize;
pub(crate) mod project;
pub mod scan;
pub(crate) mod shape;
pub mod sort;
pub mod stage;
mod state;
mod tile;
mod update;

pub use build::Builder;
pub(crate) use kernels::compiled;
pub use kernels::{CompiledKernel, STATISTIC_NAMES, compiled_kernels};
pub(crate) use optimize::{Attribute, MODEL_ATTRIBUTES, SHARED_PLANES};
pub use shape::{GroupBlend, KernelShape, Update};
pub(crate) use tile::TileSort;
pub(crate) use update::is_fused;

use crate::pass::buffers::Capacity;
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Grid, PassList};

pub use crate::scheduler::plan::Stage;

/// What a training step compares with the view, besides render and photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Supervision {
    /// Nothing more.
    Photo,
    /// Splat depths with known depths.
    Depth,
    /// Splat labels with the mask.
    Disagreement,
    /// Object layers with the photo inside each mask.
    Layers {
        /// True if the step lifts labels from the mask, as in the paper.
        lift: bool,
    },
}

impl Supervision {
    /// Returns true if the step has object layers.
    pub fn has_layers(self) -> bool {
        matches!(self, Self::Layers { .. })
    }

    /// Returns true if the step lifts labels.
    pub fn lifts(self) -> bool {
        self == Self::Layers { lift: true }
    }
}

/// Options of a training step; each combination has its own recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variant {
    /// What the step compares with the view.
    pub supervision: Supervision,
    /// Active degree of the spherical harmonics.
    pub sh_degree: u32,
    /// Largest image size, px, which loss grids cover.
    pub size: (u32, u32),
    /// True if the step ends with a parameter update.
    pub update: bool,
    /// True if the step counts contributing (pixel, splat) pairs, which costs time.
    pub counts: bool,
    /// True if all missed updates are applied before the step. The engine decides this.
    pub catch_up: bool,
}

impl Variant {
    /// A step without labels, with an update, at full degree.
    pub const fn plain(size: (u32, u32)) -> Self {
        Self { supervision: Supervision::Photo, sh_degree: 3, size, update: true, counts: false, catch_up: false }
    }
}

/// Points where an extension can add passes to a training step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hook {
    /// Before the first pass that uses the camera. The extension may change its pose in `Buf::STEP`.
    Camera,
    /// After `blend_forward`: the picture is complete. The extension may change its colours, which only the photo loss
    /// reads, but not its transmittance.
    Picture,
    /// After the photo loss: its gradient with respect to the picture is complete. The extension may change it.
    Loss,
    /// After `project_backward`: the gradients of the visible Gaussians are complete.
    Gradients,
    /// After Adam, in steps that update the parameters.
    Updated,
}

/// Adds passes to training steps, for a strategy or an owner of shared parameters. `passes` is the number of the
/// extension's variant, from 1; each variant has its own recording.
pub trait Extension: std::fmt::Debug + Send + Sync {
    /// Adds passes at a hook.
    fn extend(&self, _passes: u32, _hook: Hook, _b: &mut Builder) {}

    /// Returns true if Adam also moves Gaussians outside the view, whose gradient is 0, as 3DGS does. Otherwise these
    /// Gaussians and their moments stay unchanged.
    fn updates_unseen(&self, _passes: u32) -> bool {
        true
    }

    /// Returns true if its passes read or change parameters, moments or gradients of Gaussians. Each part of the update
    /// is then a separate pass, and all Gaussians are up to date. Otherwise one kernel may do the whole update without
    /// [`Hook::Gradients`], and Gaussians outside the view may have missed updates.
    fn splits_update(&self, _passes: u32) -> bool {
        true
    }
}

/// Changes nothing.
impl Extension for () {
    fn splits_update(&self, _passes: u32) -> bool {
        false
    }
}

fn begin<'a>(name: &str, shape: &'a KernelShape, capacity: &'a Capacity, sh_degree: u32) -> Builder<'a> {
    let late = capacity.late_gaussians > 0;
    let mut b = Builder { sh_degree, late, ..Builder::new(name, shape, capacity) };
    let (cells, visible_items) = (capacity.look_cells as u32, KernelShape::visible_items(capacity.gaussians));
    pass!(b, step_begin(look: shape.group_walks) {} [cells: cells, visible_items: visible_items], Grid::Groups(cells.div_ceil(4096).clamp(1, 4096), 1, 1));
    b
}

fn end(mut b: Builder) -> PassList {
    b.list.stage = Stage::REPORT;
    b.list.copy(Buf::COUNTERS, Buf::REPORT, 0);
    b.list
}

/// One optimiser step on one view.
pub fn training_step(shape: &KernelShape, capacity: &Capacity, variant: Variant) -> PassList {
    extended_step(shape, capacity, variant, (&(), 0))
}

/// One optimiser step with the passes of an extension's variant.
pub fn extended_step(
    shape: &KernelShape,
    capacity: &Capacity,
    variant: Variant,
    (extension, passes): (&dyn Extension, u32),
) -> PassList {
    let mut b = begin("training step", shape, capacity, variant.sh_degree);
    (b.supervision, b.counts) = (variant.supervision, variant.counts);
    b.long_list = blend::long_list(&b);
    b.late = is_fused(shape, (extension, passes));
    if variant.catch_up {
        update::catch_up(&mut b);
    }
    extension.extend(passes, Hook::Camera, &mut b);
    b.marks_near &= variant.update;
    project::visible_splats(&mut b);
    let pairs = tile::bin_splats(&mut b);
    blend::blend_forward(&mut b, pairs);
    optimize::clear_shared(&mut b);
    extension.extend(passes, Hook::Picture, &mut b);
    loss::photo_loss(&mut b, variant.size.0, variant.size.1);
    extension.extend(passes, Hook::Loss, &mut b);
    blend::blend_backward(&mut b, pairs);
    loss::reduce_disagreement(&mut b);
    if b.late {
        update::update(&mut b, variant.update);
    } else {
        gather::gather(&mut b);
        project::project_backward(&mut b);
        extension.extend(passes, Hook::Gradients, &mut b);
    }
    if variant.update {
        if !b.late {
            optimize::adam(&mut b, extension.updates_unseen(passes));
        }
        optimize::adam_shared(&mut b);
        extension.extend(passes, Hook::Updated, &mut b);
    }
    if variant.supervision.lifts() {
        lift::resolve(&mut b);
    }
    end(b)
}

/// One picture of the scene: colour, transmittance, main Gaussian and its weight, depth. If `label_rounds` is above 0,
/// it also has a label map, with at most that many walks per tile.
pub fn render_view(shape: &KernelShape, capacity: &Capacity, sh_degree: u32, label_rounds: u32) -> PassList {
    let mut b = begin("render", shape, capacity, sh_degree);
    project::visible_splats(&mut b);
    let pairs = tile::bin_splats(&mut b);
    // The picture is last, because it is read from scratch memory.
    lift::label_map(&mut b, pairs, label_rounds);
    blend::blend_forward_main(&mut b, pairs);
    end(b)
}

/// The label map of one view, with up to `rounds` walks per tile of four labels each.
pub fn label_view(shape: &KernelShape, capacity: &Capacity, rounds: u32) -> PassList {
    let mut b = begin("label map", shape, capacity, 0);
    project::visible_splats(&mut b);
    let pairs = tile::bin_splats(&mut b);
    lift::label_map(&mut b, pairs, rounds);
    end(b)
}

/// Votes of one view for the label of every Gaussian, with `rounds` walks per tile of four labels each. With `alone`,
/// occlusion is ignored.
pub fn vote_view(shape: &KernelShape, capacity: &Capacity, rounds: u32, alone: bool) -> PassList {
    let mut b = begin("votes", shape, capacity, 0);
    project::visible_splats(&mut b);
    let pairs = tile::bin_splats(&mut b);
    lift::vote(&mut b, pairs, rounds, alone);
    end(b)
}

/// Adds the blending weights of one view to the x of the densification statistic.
pub fn weigh_view(shape: &KernelShape, capacity: &Capacity) -> PassList {
    let mut b = begin("weights", shape, capacity, 0);
    b.long_list = blend::long_list(&b);
    project::visible_splats(&mut b);
    let pairs = tile::bin_splats(&mut b);
    blend::blend_forward(&mut b, pairs);
    b.list.fill(Buf::V_IMAGE, 1.0_f32.to_bits());
    blend::blend_backward(&mut b, pairs);
    gather::weigh(&mut b);
    end(b)
}

/// Applies all missed updates.
pub fn catch_up(shape: &KernelShape, capacity: &Capacity, sh_degree: u32) -> PassList {
    let mut b = begin("catch up", shape, capacity, sh_degree);
    b.list.stage = Stage::OPTIMISE;
    update::catch_up(&mut b);
    end(b)
}

/// Counts the Gaussians after a densification, without changing the model.
pub fn densify_count(shape: &KernelShape, capacity: &Capacity) -> PassList {
    let mut b = begin("densify: count", shape, capacity, 0);
    densify::mark(&mut b);
    end(b)
}

/// Densifies the model, which must have room for the count from [`densify_count`].
pub fn densify_apply(shape: &KernelShape, capacity: &Capacity, labels: bool) -> PassList {
    let mut b = begin("densify", shape, capacity, 0);
    densify::mark(&mut b);
    densify::apply(&mut b, labels);
    end(b)
}

/// Sums the weights of the Gaussians that a relocation draws from, and counts those that it removes.
pub fn relocate_count(shape: &KernelShape, capacity: &Capacity) -> PassList {
    let mut b = begin("relocation: count", shape, capacity, 0);
    densify::weigh(&mut b);
    end(b)
}

/// Removes Gaussians and copies others at random; the model must have room for them.
pub fn relocate_apply(shape: &KernelShape, capacity: &Capacity, labels: bool) -> PassList {
    let mut b = begin("relocation", shape, capacity, 0);
    densify::relocate(&mut b);
    densify::apply(&mut b, labels);
    end(b)
}

/// Searches these state planes for values that are not finite.
pub fn find_nonfinite(shape: &KernelShape, capacity: &Capacity, planes: &[Buf]) -> PassList {
    let mut b = begin("finite state", shape, capacity, 0);
    state::find_nonfinite(&mut b, planes);
    end(b)
}

/// Opacity reset.
pub fn opacity_reset(shape: &KernelShape, capacity: &Capacity) -> PassList {
    let mut b = begin("opacity reset", shape, capacity, 0);
    optimize::opacity_reset(&mut b);
    end(b)
}
