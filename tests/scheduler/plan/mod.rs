//! The planner, without a GPU.

mod checker;
mod limits;

use checker::Random;
use labelgs::pass;
use labelgs::pass::buffers::{Capacity, TABLE};
use labelgs::pass::{KernelShape, Supervision, Variant};
use labelgs::scheduler::plan::{Buf, Grid, Limits, MemoryReport, Page, PassDecl, PassList, Plan, PlanOptions, Work};
use labelgs::shaders::{Access, BindingDesc, BindingKind, LocalSize, ShaderDesc};

/// Buffers of the random lists: all classes, and sizes that do not divide each other.
mod table {
    use labelgs::scheduler::plan::{Buf, BufferDecl, Class, Domain, Table, TexelFormat};
    labelgs::buffers! { || "lower something".to_owned(); consts;
        MODEL "model": 16, Domain::GAUSSIANS, Class::Model, Some(TexelFormat::Rgba32Sfloat), "Kept.";
        LABELS "labels": 4, Domain::GAUSSIANS, Class::Model, None, "Kept.";
        TOTALS "totals": 4, Domain::ONE, Class::Persistent, None, "Kept.";
        UNIFORMS "uniforms": 4, Domain::fixed(20), Class::PerFrame, None, "From the host.";
        REPORT "report": 4, Domain::ONE, Class::Report, None, "To the host.";
        A "a": 4, Domain::PIXELS, Class::Step, Some(TexelFormat::R32Uint), "Scratch.";
        B "b": 12, Domain::PIXELS, Class::Step, None, "Scratch.";
        C "c": 4, Domain::fixed(100), Class::Step, None, "Scratch.";
        D "d": 48, Domain::INSTANCES, Class::Step, None, "Scratch.";
        E "e": 4, Domain::INSTANCES, Class::Step, None, "Scratch.";
        F "f": 4, Domain::INSTANCES, Class::Step, None, "Scratch.";
        G "g": 16, Domain::PIXELS, Class::Step, None, "Scratch.";
        H "h": 4, Domain::ONE, Class::Step, None, "Scratch.";
    }
}
use table::*;

fn counts() -> Vec<u64> {
    Capacity { gaussians: 1000, pixels: 777, instances: 1234, ..Capacity::default() }.counts()
}

/// A shader that does nothing, with these bindings; only its interface counts here.
fn shader(name: &'static str, accesses: &[Access]) -> &'static ShaderDesc {
    let kind = BindingKind::Storage;
    let bindings = accesses.iter().enumerate().map(|(binding, &access)| BindingDesc {
        name: "buffer",
        binding: binding as u32,
        kind,
        access,
        element_bytes: 4,
    });
    Box::leak(Box::new(ShaderDesc {
        stem: name,
        name,
        macros: &[],
        spirv: &[],
        bindings: Box::leak(bindings.collect::<Vec<_>>().into_boxed_slice()),
        spec: &[],
        local_size: [LocalSize::Fixed(1); 3],
        uses_subgroups: false,
    }))
}

fn pass(name: &'static str, buffers: &[(Buf, Access)], grid: Grid) -> PassDecl {
    let accesses = buffers.iter().map(|(_, access)| *access).collect::<Vec<_>>();
    PassDecl::new(shader(name, &accesses), buffers.iter().map(|(buf, _)| *buf).collect(), grid)
}

/// A small list with every kind of item.
fn small_list() -> PassList {
    let mut list = PassList::new("small");
    list.fill(A, 0);
    list.pass(pass("count", &[(UNIFORMS, Access::Read), (C, Access::Write)], Grid::Groups(4, 1, 1)));
    list.pass(pass("project", &[(MODEL, Access::Read), (B, Access::Write)], Grid::Indirect(C, 12)));
    list.pass(pass("blend", &[(B, Access::Read), (A, Access::ReadWrite)], Grid::Indirect(C, 24)));
    list.pass(pass("gather", &[(A, Access::Read), (G, Access::Write)], Grid::Groups(13, 1, 1)));
    list.pass(pass("update", &[(G, Access::Read), (MODEL, Access::ReadWrite)], Grid::Groups(16, 1, 1)));
    list.pass(pass("sum", &[(G, Access::Read), (TOTALS, Access::Write)], Grid::Groups(1, 1, 1)));
    list.copy(TOTALS, REPORT, 0);
    list
}

#[test]
fn the_text_of_a_small_plan_equals_the_stored_one() {
    let list = small_list();
    let plan = Plan::new(table::TABLE, &counts(), &list, &Limits::default(), PlanOptions::default()).unwrap();
    let options = PlanOptions::default();
    let memory = MemoryReport::predict(table::TABLE, &counts(), &[list], &Limits::default(), options).unwrap();
    let text = format!("{}\n{}\n{}", memory.report(), plan.report(), plan.arena_report());
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/plan.txt");
    if std::env::var("LABELGS_BLESS").is_ok_and(|name| name == "plan") {
        std::fs::write(path, &text).unwrap();
    }
    assert_eq!(text, std::fs::read_to_string(path).unwrap(), "LABELGS_BLESS=plan writes it anew");
}

/// All lists of the engine for a small scene.
pub fn engine_lists(shape: KernelShape) -> (Capacity, Vec<PassList>) {
    let capacity = Capacity {
        gaussians: 10_000,
        trained: 10_000,
        second_moments: 10_000,
        labelled: 10_000,
        instances: 100_000,
        key_words: 100_000,
        trained_instances: 100_000,
        virtual_tiles: 4096,
        layer_tiles: 1024,
        segment_pixels: 1,
        chunks: 0,
        chunk_pixels: 0,
        chunk_channels: 0,
        layer_pixels: 65_536,
        pixels: 65_536,
        labelled_pixels: 65_536,
        labelled_tiles: 1024,
        known_depths: 65_536,
        label_tables: 4096,
        labels: 16,
        vote_columns: 9,
        vote_cells: 90_000,
        layers: 4,
        occluder_words: 4,
        scan_lanes: 64,
        sort_cells: 64 * 256,
        sort_totals: 8 * 256,
        look_cells: 0,
        sweep_cells: 0,
        loss_partials: 1024,
        sort_lanes: 64,
        late_gaussians: 0,
        missed_rows: 0,
        shared_rows: 70,
        segments: 2,
    };
    let variant = Variant { supervision: Supervision::Layers { lift: true }, ..Variant::plain((256, 256)) };
    let lists = vec![
        pass::training_step(&shape, &capacity, variant),
        pass::training_step(&shape, &capacity, Variant { supervision: Supervision::Photo, sh_degree: 0, ..variant }),
        pass::render_view(&shape, &capacity, 3, 2),
        pass::label_view(&shape, &capacity, 2),
        pass::densify_count(&shape, &capacity),
        pass::densify_apply(&shape, &capacity, true),
        pass::opacity_reset(&shape, &capacity),
    ];
    (capacity, lists)
}

#[test]
fn the_lists_of_the_engine_have_no_race() {
    let (capacity, lists) = engine_lists(KernelShape::new(8, true));
    for list in &lists {
        for options in checker::all_options() {
            let plan = Plan::new(TABLE, &capacity.counts(), list, &Limits::default(), options).unwrap();
            checker::check_places(&plan, &Limits::default());
            assert_eq!(checker::first_race(&plan), None, "{}", plan.report());
        }
    }
    let options = PlanOptions::default();
    // The list of objects one by one is for benchmarks; its scratch lives longer.
    let lists: Vec<PassList> = lists.into_iter().filter(|list| !list.name.contains("one by one")).collect();
    let memory = MemoryReport::predict(TABLE, &capacity.counts(), &lists, &Limits::default(), options).unwrap();
    assert!(memory.step_pages.iter().sum::<u64>() * 3 < memory.step_unaliased * 2, "{}", memory.report());
}

#[test]
fn random_lists_have_places_without_overlap_and_barriers_without_gaps() {
    let small_pages =
        Limits { max_allocation: 65_536, storage_alignment: 16, texel_alignment: 16, ..Limits::default() };
    for seed in 0..200 {
        let list = Random::new(seed).list();
        for limits in [Limits::default(), small_pages] {
            for options in checker::all_options() {
                let plan = Plan::new(table::TABLE, &counts(), &list, &limits, options).unwrap();
                checker::check_places(&plan, &limits);
                assert_eq!(checker::first_race(&plan), None, "{}", plan.report());
                let again = Plan::new(table::TABLE, &counts(), &list, &limits, options).unwrap();
                assert_eq!(format!("{plan:?}"), format!("{again:?}"), "the same plan for the same input");
            }
        }
    }
}

#[test]
fn no_barrier_can_be_left_out() {
    let mut left_out = 0;
    for seed in 0..50 {
        let list = Random::new(seed).list();
        let plan = Plan::new(table::TABLE, &counts(), &list, &Limits::default(), PlanOptions::default()).unwrap();
        for item in 0..plan.items.len() {
            let mut without = plan.clone();
            if without.items[item].barrier.take().is_some() {
                assert_ne!(checker::first_race(&without), None, "barrier {item} of\n{}", plan.report());
                left_out += 1;
            }
        }
    }
    assert!(left_out > 100, "the lists have barriers");
}

#[test]
fn independent_items_run_without_barriers() {
    let mut list = PassList::new("independent");
    for buf in [A, B, C, D] {
        list.pass(pass("one", &[(MODEL, Access::Read), (buf, Access::Write)], Grid::Groups(1, 1, 1)));
    }
    let plan = Plan::new(
        table::TABLE,
        &counts(),
        &list,
        &Limits::default(),
        PlanOptions { alias: false, ..PlanOptions::default() },
    );
    assert_eq!(plan.unwrap().barrier_count(), 0);
}
