//! What the engine does, as lists of GPU passes. Declares, never records.
//!
//! [`training_step`] is the table of contents of the engine.

mod blend;
pub mod build;
mod densify;
mod gather;
mod lift;
pub mod loss;
mod optimize;
mod project;
pub mod scan;
mod separate;
pub mod shape;
pub mod sort;
pub mod stage;
mod tile;

pub use build::Builder;
pub use optimize::ATTRIBUTES;
pub use separate::separate_step;
pub use shape::KernelShape;

use crate::pass;
use crate::scheduler::plan::{Buf, Capacity, PassList};

pub use crate::scheduler::plan::Stage;

/// What a recorded list depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Object layers are in the list.
    pub labels: bool,
    /// So is the paper's lift of labels from the view; only with `labels`.
    pub lift: bool,
    /// Active degree of the spherical harmonics.
    pub sh_degree: u32,
    /// Largest image, px; bounds the grids of the loss.
    pub size: (u32, u32),
    /// Parameters are updated at the end.
    pub update: bool,
    /// The (pixel, splat) pairs that have a weight are counted, which takes time.
    pub counts: bool,
}

fn begin<'a>(name: &str, shape: &'a KernelShape, capacity: &'a Capacity, labels: bool, sh_degree: u32) -> Builder<'a> {
    let mut b = Builder { shape, capacity, labels, sh_degree, counts: false, list: PassList::new(name) };
    pass!(b, step_begin { step: Buf::STEP, counters: Buf::COUNTERS, dispatch_args: Buf::DISPATCH_ARGS } [],
        build::ONE);
    b
}

fn end(mut b: Builder) -> PassList {
    b.list.stage = Stage::Report;
    b.list.copy(Buf::COUNTERS, Buf::REPORT, 0);
    b.list.copy(Buf::FAILURE, Buf::REPORT_FAILURE, 0);
    b.list
}

/// One optimiser step on one view.
pub fn training_step(shape: &KernelShape, capacity: &Capacity, variant: Variant) -> PassList {
    let mut b = begin("training step", shape, capacity, variant.labels, variant.sh_degree);
    b.counts = variant.counts;
    project::visible_splats(&mut b);
    let pairs = tile::bin_splats(&mut b);
    blend::blend_forward(&mut b, pairs, variant.lift);
    loss::photo_loss(&mut b, variant.size.0, variant.size.1);
    blend::blend_backward(&mut b, pairs);
    gather::gather(&mut b);
    project::project_backward(&mut b);
    if variant.update {
        optimize::adam(&mut b);
    }
    if variant.lift {
        lift::resolve(&mut b);
    }
    end(b)
}

/// One picture of the scene: colour, transmittance, main Gaussian and its weight, depth.
pub fn render_view(shape: &KernelShape, capacity: &Capacity, sh_degree: u32) -> PassList {
    let mut b = begin("render", shape, capacity, false, sh_degree);
    project::visible_splats(&mut b);
    let pairs = tile::bin_splats(&mut b);
    blend::blend_forward_main(&mut b, pairs);
    end(b)
}

/// What one view says about the label of every Gaussian; a tile is walked `rounds` times, four labels each.
pub fn vote_view(shape: &KernelShape, capacity: &Capacity, rounds: u32) -> PassList {
    let mut b = begin("votes", shape, capacity, false, 0);
    project::visible_splats(&mut b);
    let pairs = tile::bin_splats(&mut b);
    lift::vote(&mut b, pairs, rounds);
    end(b)
}

/// How many Gaussians densification would leave.
pub fn densify_count(shape: &KernelShape, capacity: &Capacity) -> PassList {
    let mut b = begin("densify: count", shape, capacity, false, 0);
    densify::mark(&mut b);
    end(b)
}

/// Densification; the model must have room for the count that [`densify_count`] found.
pub fn densify_apply(shape: &KernelShape, capacity: &Capacity, labels: bool) -> PassList {
    let mut b = begin("densify", shape, capacity, labels, 0);
    densify::mark(&mut b);
    densify::apply(&mut b);
    end(b)
}

/// Opacity reset.
pub fn opacity_reset(shape: &KernelShape, capacity: &Capacity) -> PassList {
    let mut b = begin("opacity reset", shape, capacity, false, 0);
    optimize::opacity_reset(&mut b);
    end(b)
}
