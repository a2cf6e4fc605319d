//! The planner, without a GPU.

use labelgs::pass::{self, KernelShape, Variant};
use labelgs::plan::{Capacity, Limits, Plan, PlanOptions, TABLE};

#[test]
fn the_lists_of_the_engine_can_be_planned() {
    let shape = KernelShape::new(8, true);
    let capacity = Capacity {
        gaussians: 10_000,
        trained: 10_000,
        labelled: 10_000,
        instances: 100_000,
        trained_instances: 100_000,
        virtual_tiles: 4096,
        layer_tiles: 1024,
        layer_pixels: 65_536,
        pixels: 65_536,
        labelled_pixels: 65_536,
        labels: 16,
        layers: 4,
        occluder_words: 4,
        scan_lanes: 64,
        sort_cells: 64 * 256,
        loss_partials: 1024,
        sort_lanes: 64,
        segments: 16,
    };
    let variant = Variant { labels: true, sh_degree: 3, size: (256, 256), update: true };
    for list in [
        pass::training_step(&shape, &capacity, variant),
        pass::render_view(&shape, &capacity, 3),
        pass::densify_count(&shape, &capacity),
        pass::densify_apply(&shape, &capacity, true),
        pass::opacity_reset(&shape, &capacity),
    ] {
        match Plan::new(TABLE, &capacity, &list, &Limits::default(), PlanOptions::default()) {
            Ok(plan) => println!("{}{}", plan.report(), plan.arena_report()),
            Err(error) => println!("ERROR {}: {error}", list.name),
        }
    }
}
