//! One stem, four places: every shader has its header, its mirror and its pass; every buffer has its pass.

use labelgs::engine::growth::capacity;
use labelgs::engine::{Engine, EngineSize, LabelSize};
use labelgs::pass::buffers::{Capacity, TABLE};
use labelgs::pass::{GroupBlend, KernelShape, Supervision, Update, Variant};
use labelgs::run::StrategyKind;
use labelgs::scheduler::plan::{Buf, Grid, Limits, PassList, Plan, PlanOptions, Work};
use labelgs::train::shared::exposure::Exposure;
use labelgs::train::shared::poses::Poses;
use labelgs::train::shared::{RowOffsets, SharedParameters};
use labelgs::train::strategy;
use labelgs::{pass, shaders};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const REPOSITORY_ROOT: &str = env!("CARGO_MANIFEST_DIR");
const ENGINE_SIZE: EngineSize = EngineSize::new(10_000, (320, 240))
    .for_training()
    .with_labels(Some(LabelSize { max_label: 40, layers: 8, vote_columns: 9 }))
    .with_shared_rows(5);

/// Stem and text of every compute shader.
fn sources() -> Vec<(String, String)> {
    let families =
        fs::read_dir(Path::new(REPOSITORY_ROOT).join("glsl")).expect("glsl").map(|entry| entry.expect("entry").path());
    let files = families.filter(|path| path.is_dir()).flat_map(|folder| fs::read_dir(folder).expect("folder"));
    let files =
        files.map(|entry| entry.expect("entry").path()).filter(|path| path.extension().is_some_and(|e| e == "comp"));
    let source = |path: PathBuf| {
        let stem = path.file_stem().expect("stem").to_string_lossy().into_owned();
        (stem, fs::read_to_string(path).expect("text"))
    };
    files.map(source).collect()
}

/// Text of a header line of a shader, such as `Mirror`.
fn header<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    text.lines().find_map(|line| line.strip_prefix(&format!("// {key}:"))).map(str::trim)
}

/// Every list that the engine may run, on two kinds of device.
fn lists() -> Vec<(Capacity, PassList)> {
    let mut all = Vec::new();
    let own = [KernelShape::new(8, true), KernelShape::new(32, false)];
    let emulated = own.map(|shape| KernelShape { emulated: true, ..shape });
    let antialiased = own.map(|shape| KernelShape { antialiased: true, ..shape });
    let sweeping = own.into_iter().chain(emulated).chain(antialiased).flat_map(|shape| {
        [false, true].map(|narrow_keys| {
            KernelShape { loss_tile: 16, narrow_labels: true, narrow_keys, ..shape }
                .with_sweeps_of(8)
                .with_group_blend_of(GroupBlend::DEFAULT)
        })
    });
    let one_by_one: Vec<KernelShape> = own.into_iter().chain(emulated).chain(antialiased).chain(sweeping).collect();
    let shared_out: Vec<_> = one_by_one.iter().map(|shape| KernelShape { group_walks: true, ..*shape }).collect();
    let late = shared_out.iter().map(|shape| KernelShape { update: Update::Lazy, ..*shape });
    for shape in one_by_one.iter().chain(&shared_out).copied().chain(late) {
        for (segments, half) in [(1, true), (1, false), (3, false)] {
            let mut capacity = capacity(&shape, &ENGINE_SIZE.with_half_moments(half));
            capacity.segments = segments;
            capacity.segment_pixels = if segments > 1 { 100_000 } else { 0 };
            let size = ENGINE_SIZE.image;
            let mut add = |list| all.push((capacity, list));
            for (supervision, sh_degree, update) in [
                (Supervision::Layers { lift: true }, 3, true),
                (Supervision::Layers { lift: false }, 3, true),
                (Supervision::Layers { lift: true }, 0, false),
                (Supervision::Disagreement, 3, true),
                (Supervision::Depth, 3, true),
                (Supervision::Photo, 3, true),
                (Supervision::Photo, 1, false),
            ] {
                let variant = Variant { supervision, sh_degree, update, ..Variant::plain(size) };
                add(pass::training_step(&shape, &capacity, variant));
            }
            add(pass::render_view(&shape, &capacity, 3, 2));
            add(pass::label_view(&shape, &capacity, 2));
            add(pass::vote_view(&shape, &capacity, 2, false));
            let variant = Variant::plain(size);
            let extension = strategy::make(StrategyKind::Mcmc).extension();
            let all_passes = 15;
            add(pass::extended_step(&shape, &capacity, variant, (&*extension, all_passes)));
            let place = RowOffsets::default();
            for shared in [Exposure::default().extension(place), Poses::default().extension(place)] {
                for supervision in [Supervision::Photo, Supervision::Disagreement, Supervision::Layers { lift: false }]
                {
                    add(pass::extended_step(&shape, &capacity, Variant { supervision, ..variant }, (&*shared, 1)));
                }
            }
            if shape.update != Update::Split {
                let fog = (&*extension, strategy::passes::FREE_SPACE_BIT);
                add(pass::extended_step(&shape, &capacity, Variant { catch_up: true, ..variant }, fog));
                add(pass::catch_up(&shape, &capacity, 3));
            }
            add(pass::weigh_view(&shape, &capacity));
            add(pass::densify_count(&shape, &capacity));
            add(pass::densify_apply(&shape, &capacity, true));
            add(pass::relocate_count(&shape, &capacity));
            add(pass::relocate_apply(&shape, &capacity, true));
            add(pass::opacity_reset(&shape, &capacity));
            add(pass::find_nonfinite(&shape, &capacity, &[Buf::MEANS, Buf::M_SH3, Buf::SHARED]));
        }
    }
    all
}

#[test]
fn every_shader_says_what_it_does() {
    let sources = sources();
    assert!(sources.len() > 20, "{}", sources.len());
    for (stem, text) in sources {
        let title = text.lines().find(|line| line.starts_with("// ")).unwrap_or_default();
        assert!(title.starts_with(&format!("// {stem} — ")), "{stem}: {title}");
        for key in ["Work", "Reads", "Writes", "Mirror"] {
            assert!(header(&text, key).is_some_and(|value| value.len() > 3), "{stem} has no line `// {key}:`");
        }
    }
}

#[test]
fn every_mirror_is_there() {
    for (stem, text) in sources() {
        let mirror = header(&text, "Mirror").expect("see the test above");
        if let Some(reason) = mirror.strip_prefix("none (") {
            assert!(reason.len() > 4, "{stem}: without a mirror the reason is needed");
            // Instead of a mirror, the header may name the test that covers the kernel.
            let named = reason.split([' ', ')', ';']).filter(|word| word.starts_with("tests/"));
            named.for_each(|file| {
                assert!(Path::new(REPOSITORY_ROOT).join(file).is_file(), "{stem}: there is no {file}")
            });
            continue;
        }
        for part in mirror.split(", ") {
            let (file, function) = part.split_once("::").unwrap_or_else(|| panic!("{stem}: {part} names no function"));
            let file = Path::new(REPOSITORY_ROOT).join("src/reference").join(file.trim_start_matches("src/reference/"));
            let reference =
                fs::read_to_string(&file).unwrap_or_else(|error| panic!("{stem}: {}: {error}", file.display()));
            assert!(
                reference.contains(&format!("pub fn {function}")),
                "{stem}: no function {function} in {}",
                file.display()
            );
        }
    }
}

#[test]
fn every_shader_runs_in_some_list() {
    let mut used = BTreeSet::new();
    for (_, list) in lists() {
        used.extend(list.work.iter().filter_map(|work| match work {
            Work::Pass(pass) => Some(pass.shader.name),
            Work::Fill { .. } | Work::Copy { .. } => None,
        }));
    }
    let unused: Vec<&str> = shaders::ALL.iter().map(|shader| shader.name).filter(|name| !used.contains(name)).collect();
    assert_eq!(unused, Vec::<&str>::new());
}

#[test]
fn every_buffer_is_used_by_some_list() {
    let mut used = BTreeSet::new();
    for (_, list) in lists() {
        for work in &list.work {
            match work {
                Work::Pass(pass) => {
                    used.extend(pass.buffers.iter().copied());
                    used.extend(if let Grid::Indirect(buf, _) = pass.grid { Some(buf) } else { None });
                }
                Work::Fill { buf, .. } => _ = used.insert(*buf),
                Work::Copy { from, to, .. } => used.extend([*from, *to]),
            }
        }
    }
    let unused = TABLE.iter().enumerate().filter(|(index, _)| !used.iter().any(|buf| buf.index() == *index));
    assert_eq!(unused.map(|(_, decl)| decl.name).collect::<Vec<_>>(), Vec::<&str>::new());
}

/// Strips of the loss and butterflies end at 64 lanes.
#[test]
fn subgroups_without_kernels_have_no_shape() {
    for subgroup in [4, 8, 16, 32, 64] {
        KernelShape::new(subgroup, false).check().expect("kernels");
    }
    for subgroup in [1, 2, 128] {
        assert!(KernelShape::new(subgroup, false).check().is_err(), "subgroups of {subgroup}");
    }
}

#[test]
fn every_list_can_be_planned_and_printed() {
    for (capacity, list) in lists() {
        let limits = Limits { max_storage_buffers: 64, ..Limits::default() };
        let plan = Plan::new(TABLE, &capacity.counts(), &list, &limits, PlanOptions::default());
        let plan = plan.unwrap_or_else(|error| panic!("{}: {error}", list.name));
        let text = plan.report();
        assert_eq!(plan.items.len(), list.work.len());
        assert!(plan.items.iter().all(|item| text.contains(&item.label)), "{text}");
        assert!(list.work.len() < 2 || plan.barrier_count() > 0, "{}", list.name);
    }
}

/// More tiles of layers than workgroups of an axis: `--label-samples all` in a view full of objects.
#[test]
fn two_hundred_layers_can_be_planned() {
    let labels = Some(LabelSize { max_label: 200, layers: 200, vote_columns: 16 });
    let room = EngineSize::new(100_000, (1920, 1080)).for_training().with_labels(labels);
    let shape = KernelShape::new(8, true);
    let capacity = capacity(&shape, &room);
    assert!(capacity.virtual_tiles.div_ceil(64) > 65_535, "an axis would do");
    let limits = Limits { max_storage_range: 1 << 32, max_allocation: 1 << 34, ..Limits::default() };
    for list in Engine::lists_of(&shape, &capacity, &room) {
        let plan = Plan::new(TABLE, &capacity.counts(), &list, &limits, PlanOptions::default());
        plan.unwrap_or_else(|error| panic!("{}: {error}", list.name));
    }
}

#[test]
fn a_scene_without_masks_pays_nothing_for_labels() {
    let shape = KernelShape::new(8, true);
    let bytes = |room: &EngineSize| {
        let capacity = capacity(&shape, room);
        let lists = Engine::lists_of(&shape, &capacity, room);
        let report = labelgs::scheduler::plan::MemoryReport::predict(
            TABLE,
            &capacity.counts(),
            &lists,
            &Limits::default(),
            PlanOptions::default(),
        );
        let report = report.expect("fits");
        let labels = ["labels", "label_keys", "view_labels", "layer_state"];
        let named = report.rows.iter().filter(|row| labels.contains(&row.name)).map(|row| row.bytes).sum::<u64>();
        (named, report.total)
    };
    let (with, without) = (bytes(&ENGINE_SIZE), bytes(&EngineSize { labels: None, ..ENGINE_SIZE }));
    assert!(without.0 < 2048 && without.0 < with.0, "{without:?} {with:?}");
    assert!(without.1 < with.1, "{without:?} {with:?}");
}

/// The file of a module of the tests, such as `cli::words` or `scheduler::faults`, or of the tests of a crate, such as
/// `scenes::colmap`.
fn module_file(path: &[&str]) -> Option<PathBuf> {
    let (first, rest) = path.split_first()?;
    let in_crate = rest
        .iter()
        .fold(Path::new(REPOSITORY_ROOT).join("src").join(first).join("tests"), |folder, part| folder.join(part));
    let place = path.iter().fold(Path::new(REPOSITORY_ROOT).join("tests"), |folder, part| folder.join(part));
    [place.with_extension("rs"), place.join("mod.rs"), in_crate.with_extension("rs")]
        .into_iter()
        .find(|file| file.is_file())
}

/// Each test and module that `tests/README.md` names exists.
#[test]
fn every_test_that_the_list_of_faults_names_is_there() {
    let text = fs::read_to_string(Path::new(REPOSITORY_ROOT).join("tests/README.md")).expect("the list");
    let cells = text.lines().filter_map(|line| line.strip_suffix(" |")?.rsplit_once(" | ")).map(|(_, tests)| tests);
    let names: Vec<&str> = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect();
    assert!(names.len() > 80, "{}", names.len());
    for name in names.into_iter().filter(|name| !name.starts_with("tools/")) {
        let parts: Vec<&str> = name.split("::").collect();
        let (test, module) = parts.split_last().expect("a name");
        let is_test = || {
            let text = fs::read_to_string(module_file(module)?).ok()?;
            let function =
                |test: &str| test.lines().find(|line| !line.starts_with("#["))?.strip_prefix("fn ").map(str::to_owned);
            let mut functions = text.split("#[test]\n").skip(1).filter_map(function);
            functions.any(|function| function.starts_with(&format!("{test}()"))).then_some(())
        };
        assert!(module_file(&parts).is_some() || is_test().is_some(), "there is no test {name}");
    }
}
