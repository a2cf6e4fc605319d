//! The passes of a training step, from the engine itself, as `labelgs plan` prints them.

use labelgs::Result;
use labelgs::engine::{EngineSize, LabelSize};
use labelgs::internals::engine::capacity;
use labelgs::internals::pass::stage::stages;
use labelgs::internals::pass::{KernelShape, Stage, Variant, training_step};
use labelgs::internals::scheduler::plan::{Limits, PassDecl, PassList, Plan, PlanOptions, TABLE, Work};

/// An item of a step's list.
pub struct Item {
    /// Its stage.
    pub stage: Stage,
    /// Its name, shared by variants.
    pub title: String,
    /// The pass; none for fills and copies.
    pub pass: Option<PassDecl>,
    /// Bytes that a fill or copy reads and writes.
    pub moved: (f64, f64),
    /// True if there is a barrier before it.
    pub barrier: bool,
}

/// A step for a typical card: subgroups of 32, no texel buffers.
pub struct Subject {
    /// Gaussians.
    pub gaussians: u64,
    /// Size of the picture, px.
    pub size: (u32, u32),
    /// Objects of the step.
    pub layers: u32,
    /// Degree of the spherical harmonics.
    pub sh_degree: u32,
}

impl Subject {
    /// Shape of the kernels.
    pub fn shape() -> KernelShape {
        KernelShape::new(32, false)
    }

    /// The items of the step's plan.
    pub fn items(&self) -> Result<Vec<Item>> {
        let shape = Self::shape();
        let labels = (self.layers > 0).then_some(LabelSize { max_label: 255, layers: self.layers, vote_columns: 16 });
        let room = EngineSize::new(self.gaussians, self.size).for_training().with_labels(labels);
        let capacity = capacity(&shape, &room);
        let variant = Variant { labels: self.layers > 0, sh_degree: self.sh_degree, ..Variant::plain(self.size) };
        // Of an ideal card: what fits is the matter of `labelgs plan`.
        let much = 1 << 60;
        let limits = Limits { max_storage_range: much, max_allocation: much, max_memory: much, ..Limits::default() };
        let list = training_step(&shape, &capacity, variant);
        items(&list, &Plan::new(TABLE, &capacity, &list, &limits, PlanOptions::default())?)
    }
}

/// The items of a planned list.
pub fn items(list: &PassList, plan: &Plan) -> Result<Vec<Item>> {
    let mut items = Vec::new();
    for ((work, planned), (stage, title)) in list.work.iter().zip(&plan.items).zip(stages(list)) {
        let (pass, moved) = match work {
            Work::Pass(pass) => (Some(pass.clone()), (0.0, 0.0)),
            Work::Fill { buf, .. } => (None, (0.0, plan.placement(*buf)?.bytes as f64)),
            Work::Copy { from, to, bytes, .. } => {
                let most = plan.placement(*from)?.bytes.min(plan.placement(*to)?.bytes);
                let bytes = if *bytes == 0 { most } else { *bytes } as f64;
                (None, (bytes, bytes))
            }
        };
        items.push(Item { stage, title, pass, moved, barrier: planned.barrier.is_some() });
    }
    Ok(items)
}
