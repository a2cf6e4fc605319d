//! A training step with separate passes for every sampled object, as in the reference code of LabelGS. For each object,
//! the step culls, sorts, projects, bins, blends and differentiates its Gaussians again, and adds the gradients to the
//! scene's.
//!
//! The result equals that of [`training_step`](super::training_step) up to the order of sums. It exists to measure the
//! gain from one traversal of all layers: kernels and culling are the same, only the structure differs. Each object is
//! layer 1 of passes without other layers, so one recording serves all objects.

use super::build::{Builder, ONE};
use super::{Variant, begin, blend, end, gather, lift, loss, optimize, project, tile};
use crate::pass::KernelShape;
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Capacity, PassList, Stage, Work};

/// (Buffer of the step, buffer that replaces it in the passes of an object).
const OF_OBJECT: [(Buf, Buf); 5] = [
    (Buf::STEP, Buf::OBJECT_STEP),
    (Buf::LABEL_FROM_LAYER, Buf::OBJECT_LABEL),
    (Buf::LAYER_WEIGHTS, Buf::OBJECT_WEIGHT),
    (Buf::LAYER_OCCLUDERS, Buf::OBJECT_OCCLUDERS),
    (Buf::SPLAT_FROM_GAUSSIAN, Buf::OBJECT_SPLATS),
];

/// One optimiser step on one view with `objects` sampled objects, one after another.
pub fn separate_step(shape: &KernelShape, capacity: &Capacity, variant: Variant, objects: u32) -> PassList {
    let mut b = begin("training step, objects one by one", shape, capacity, false, variant.sh_degree);
    project::visible_splats(&mut b);
    // The kernel variant with labels does the lift; here it finds its layers empty.
    b.labels = variant.lift;
    let pairs = tile::bin_scene(&mut b);
    blend::blend_forward(&mut b, pairs, variant.lift);
    b.labels = false;
    loss::photo_loss(&mut b, variant.size.0, variant.size.1);
    blend::blend_backward(&mut b, pairs);
    gather::gather(&mut b);
    project::project_backward(&mut b);
    if objects > 0 {
        b.list.fill(Buf::OBJECT, 0);
        let object = object_passes(shape, capacity, variant.sh_degree);
        for _ in 0..objects {
            next_object(&mut b);
            b.list.work.extend(object.iter().cloned());
        }
        next_object(&mut b);
    }
    if variant.update {
        optimize::adam(&mut b, true);
    }
    if variant.lift {
        lift::resolve(&mut b);
    }
    end(b)
}

fn next_object(b: &mut Builder) {
    b.list.stage = Stage::Project;
    pass!(b, next_object {
        step: Buf::STEP, label_from_layer: Buf::LABEL_FROM_LAYER, layer_weights: Buf::LAYER_WEIGHTS,
        layer_occluders: Buf::LAYER_OCCLUDERS, object: Buf::OBJECT, object_counters: Buf::OBJECT_COUNTERS,
        counters: Buf::COUNTERS, object_step: Buf::OBJECT_STEP, object_label: Buf::OBJECT_LABEL,
        object_weight: Buf::OBJECT_WEIGHT, object_occluders: Buf::OBJECT_OCCLUDERS,
    } [], ONE);
}

/// The passes of one object.
fn object_passes(shape: &KernelShape, capacity: &Capacity, sh_degree: u32) -> Vec<Work> {
    let tiles = capacity.virtual_tiles / capacity.layers.max(1);
    let capacity = Capacity { virtual_tiles: 2 * tiles, ..*capacity };
    let list = PassList::new("object");
    let mut b = Builder {
        shape,
        capacity: &capacity,
        labels: false,
        sh_degree,
        disagreement: false,
        depth: false,
        counts: false,
        list,
    };
    project::visible_splats_of_object(&mut b);
    b.labels = true;
    let pairs = tile::bin_object(&mut b);
    blend::blend_forward(&mut b, pairs, false);
    loss::label_loss(&mut b);
    blend::blend_backward(&mut b, pairs);
    gather::gather_object(&mut b);
    let mut work = b.list.work;
    for item in &mut work {
        if let Work::Pass(pass) = item {
            pass.buffers.iter_mut().for_each(|buf| *buf = of_object(*buf));
        }
    }
    // The gradients stay indexed by the scene's splats.
    let list = PassList { work, ..PassList::default() };
    let mut b = Builder {
        shape,
        capacity: &capacity,
        labels: true,
        sh_degree,
        disagreement: false,
        depth: false,
        counts: false,
        list,
    };
    project::project_backward_of_object(&mut b, Buf::SPLAT_FROM_GAUSSIAN);
    b.list.work
}

fn of_object(buf: Buf) -> Buf {
    OF_OBJECT.iter().find(|(step, _)| *step == buf).map_or(buf, |(_, object)| *object)
}
