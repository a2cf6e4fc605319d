//! Shared parameters: one row of the scene and one of each photo, with gradients from kernels of this test.

use crate::invariants::training::{config, small};
use crate::pass::fixture::prove;
use crate::reference::adam::adam_value;
use crate::scheduler::{R, RW, S, W, toy_shader};
use crate::support::compare::{Tolerance, close};
use crate::support::device::Turn;
use crate::support::{device, toy};
use labelgs::engine::growth::capacity;
use labelgs::engine::{Engine, EngineSize};
use labelgs::pass::buffers::TABLE;
use labelgs::pass::{Builder, Extension, Hook, KernelShape, Variant, training_step};
use labelgs::run::{LabelRule, TrainConfig};
use labelgs::scene::Dataset;
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::scheduler::plan::{Buf, Domain, Grid, Limits, MemoryReport, PassDecl, PlanOptions, Work};
use labelgs::shaders::ShaderDesc;
use labelgs::train::Trainer;
use labelgs::train::setup::TrainerOptions;
use labelgs::train::shared::{RowOffsets, SharedLayout, SharedParameters};
use labelgs::train::state::TrainState;
use labelgs::train::strategy::StepContext;
use std::sync::Arc;

/// Views of the scene.
const VIEWS: usize = 5;
/// Rows: the scene's, and one of each photo.
const ROWS: usize = VIEWS + 1;
/// Pixels of a photo.
const PIXELS: usize = 72 * 52;
const RATES: [[f32; 4]; 2] = [[0.02, 0.02, 0.3, 0.1], [0.05, 0.001, 0.05, 0.05]];

toy_shader!(
    pull,
    [],
    [("step_rows", R, S, 4), ("shared_parameters", R, S, 16), ("v_shared", W, S, 16)],
    "layout(local_size_x = 64) in;
    layout(std430, set=0, binding=0) readonly buffer step_rows_block { uint step_rows[]; };
    layout(std430, set=0, binding=1) readonly buffer shared_block { vec4 shared_parameters[]; };
    layout(std430, set=0, binding=2) writeonly buffer v_shared_block { vec4 v_shared[]; };
    void main() {
        uint k = gl_GlobalInvocationID.x;
        uint row = k < 6u ? step_rows[k] : ~0u;
        if (row != ~0u) v_shared[row] = (shared_parameters[row] - vec4(row, 0.5, -1, 3)) * vec4(1, 0.01, 100, 1e-13);
    }"
);

toy_shader!(
    brighten,
    [],
    [("step_rows", R, S, 4), ("shared_parameters", R, S, 16), ("image", RW, S, 16)],
    "layout(local_size_x = 64) in;
    layout(std430, set=0, binding=0) readonly buffer step_rows_block { uint step_rows[]; };
    layout(std430, set=0, binding=1) readonly buffer shared_block { vec4 shared_parameters[]; };
    layout(std430, set=0, binding=2) buffer image_block { vec4 image[]; };
    void main() {
        uint p = gl_GlobalInvocationID.x;
        if (p < 3744u) image[p].rgb += shared_parameters[step_rows[1]].rgb;
    }"
);

toy_shader!(
    darken,
    [],
    [("step_rows", R, S, 4), ("shared_parameters", R, S, 16), ("image", RW, S, 16)],
    "layout(local_size_x = 64) in;
    layout(std430, set=0, binding=0) readonly buffer step_rows_block { uint step_rows[]; };
    layout(std430, set=0, binding=1) readonly buffer shared_block { vec4 shared_parameters[]; };
    layout(std430, set=0, binding=2) buffer image_block { vec4 image[]; };
    void main() {
        uint p = gl_GlobalInvocationID.x;
        if (p < 3744u) image[p].rgb -= shared_parameters[step_rows[1]].rgb;
    }"
);

toy_shader!(
    sum_up,
    [],
    [("step_rows", R, S, 4), ("v_image", R, S, 16), ("v_shared", W, S, 16)],
    "layout(local_size_x = 64) in;
    layout(std430, set=0, binding=0) readonly buffer step_rows_block { uint step_rows[]; };
    layout(std430, set=0, binding=1) readonly buffer v_image_block { vec4 v_image[]; };
    layout(std430, set=0, binding=2) writeonly buffer v_shared_block { vec4 v_shared[]; };
    shared vec3 sums[64];
    void main() {
        uint lane = gl_LocalInvocationID.x;
        vec3 sum = vec3(0);
        for (uint p = lane; p < 3744u; p += 64u) sum += v_image[p].rgb;
        sums[lane] = sum;
        barrier();
        if (lane != 0u) return;
        for (uint other = 1u; other < 64u; other++) sum += sums[other];
        v_shared[step_rows[1]] = vec4(sum, 0);
    }"
);

/// Rows that are drawn to places of their own.
#[derive(Debug)]
struct Pulled;

/// Brightness of each photo, which is not part of the model.
#[derive(Debug)]
struct Brightness;

impl Extension for Pulled {
    fn extend(&self, _passes: u32, hook: Hook, b: &mut Builder) {
        if hook == Hook::Gradients {
            b.list.pass(PassDecl::new(pull(), vec![Buf::STEP_ROWS, Buf::SHARED, Buf::V_SHARED], Grid::Groups(1, 1, 1)));
        }
    }
}

impl Extension for Brightness {
    fn extend(&self, _passes: u32, hook: Hook, b: &mut Builder) {
        let mut pass = |shader, buffers: [Buf; 2], groups| {
            let buffers = [Buf::STEP_ROWS].into_iter().chain(buffers).collect();
            b.list.pass(PassDecl::new(shader, buffers, Grid::Groups(groups, 1, 1)));
        };
        let groups = PIXELS.div_ceil(64) as u32;
        match hook {
            Hook::Picture => pass(brighten(), [Buf::SHARED, Buf::IMAGE], groups),
            Hook::Loss => {
                pass(darken(), [Buf::SHARED, Buf::IMAGE], groups);
                pass(sum_up(), [Buf::V_IMAGE, Buf::V_SHARED], 1);
            }
            Hook::Camera | Hook::Gradients | Hook::Updated => {}
        }
    }
}

impl SharedParameters for Pulled {
    fn name(&self) -> &'static str {
        "pulled"
    }

    fn layout(&self) -> SharedLayout {
        SharedLayout { scene: 1, photo: 1 }
    }

    fn start(&self, view: Option<usize>) -> Vec<[f32; 4]> {
        vec![view.map_or([0.25; 4], |view| [view as f32, 0.0, 2.0, 3.1])]
    }

    fn rates(&self, at: StepContext) -> Vec<[f32; 4]> {
        // The row of the scene is skipped in every fourth step.
        vec![if at.step.is_multiple_of(4) { [0.0; 4] } else { RATES[0] }, RATES[1]]
    }

    fn extension(&self, _place: RowOffsets) -> Arc<dyn Extension> {
        Arc::new(Self)
    }
}

impl SharedParameters for Brightness {
    fn name(&self) -> &'static str {
        "brightness"
    }

    fn layout(&self) -> SharedLayout {
        SharedLayout { scene: 1, photo: 1 }
    }

    fn start(&self, _view: Option<usize>) -> Vec<[f32; 4]> {
        vec![[0.0; 4]]
    }

    fn rates(&self, _at: StepContext) -> Vec<[f32; 4]> {
        vec![[0.0; 4], [0.01, 0.01, 0.01, 0.0]]
    }

    fn extension(&self, _place: RowOffsets) -> Arc<dyn Extension> {
        Arc::new(Self)
    }
}

fn with(parameters: impl SharedParameters + 'static) -> TrainerOptions {
    TrainerOptions { shared: parameters.into(), ..TrainerOptions::default() }
}

fn trainer(turn: &Turn, scene: Dataset, config: TrainConfig, options: impl Into<TrainerOptions>) -> Trainer {
    let start = initial_gaussians(&scene, 0, 100).expect("points");
    Trainer::new(turn.gpu(), config, &scene, &start, options).expect("a trainer")
}

fn settings() -> TrainConfig {
    TrainConfig { iterations: 30, ..config(LabelRule::Votes) }
}

fn go_on(trainer: &mut Trainer, until: u32) -> TrainState {
    while trainer.steps_done() < until {
        trainer.step().expect("a step");
    }
    trainer.state().expect("a state")
}

/// Values and moments of each row.
fn rows(trainer: &mut Trainer) -> Vec<[[f32; 4]; 3]> {
    trainer.drain().expect("reports");
    let values = trainer.engine_mut().shared().expect("rows");
    let raw = trainer.engine_mut().raw_mut();
    let mut read = |buf| raw.download::<[f32; 4]>(buf, 0, 0, values.len()).expect("moments");
    let (m, u) = (read(Buf::M_SHARED), read(Buf::U_SHARED));
    values.into_iter().zip(m.into_iter().zip(u)).map(|(value, (m, u))| [value, m, u]).collect()
}

/// Each step starts from the device's previous state; each row counts its own updates.
#[test]
fn shared_rows_are_updated_as_the_mirror_says_and_others_rest() {
    let Some(turn) = device() else { return };
    let mut trainer = trainer(&turn, small(), settings(), with(Pulled));
    let mut before = rows(&mut trainer);
    assert_eq!(before.len(), ROWS);
    assert_eq!(before[3], [[2.0, 0.0, 2.0, 3.1], [0.0; 4], [0.0; 4]]);
    let (mut updates, mut steps) = ([0; ROWS], Vec::new());
    for step in 1..=17 {
        trainer.step().expect("a step");
        let after = rows(&mut trainer);
        let changed: Vec<usize> = (0..ROWS).filter(|&row| after[row] != before[row]).collect();
        // Steps that densify update nothing; the row of the scene is skipped in every fourth step.
        let of_photos = usize::from(step % 8 != 0);
        let of_scene = usize::from(step % 4 != 0);
        assert_eq!(changed.len(), of_photos + of_scene, "step {step}: {changed:?}");
        assert_eq!(changed.contains(&0), of_scene == 1, "step {step}: {changed:?}");
        for row in changed {
            updates[row] += 1;
            steps.push((row, updates[row], before[row], after[row]));
        }
        before = after;
    }
    assert!(updates[0] == 13 && updates[1..].iter().all(|&count| count >= 2), "{updates:?}");
    prove("adam of shared rows", &["adam_beta1", "adam_beta2", "adam_eps"], |rules| {
        let (mut errors, zeros) = (Vec::new(), vec![0.0; steps.len() * 12]);
        for (row, step, before, after) in &steps {
            let goal = [*row as f32, 0.5, -1.0, 3.0];
            let scale = [1.0, 0.01, 100.0, 1e-13];
            for i in 0..4 {
                let g = f64::from((before[0][i] - goal[i]) * scale[i]);
                let rate = f64::from(RATES[usize::from(*row > 0)][i]);
                let was = before.map(|values| f64::from(values[i]));
                let [value, m, u] = adam_value(rules, rate, *step, was, g);
                let of_m = 1e-6 * m.abs() + 3e-6 * u.sqrt();
                let units = [1e-7 * value.abs() + 1e-5 * rate, of_m + 1e-30, 1e-6 * u + 1e-36];
                let found = after.map(|values| f64::from(values[i]));
                errors.extend([value, m, u].iter().zip(found).zip(units).map(|((e, a), unit)| (a - e) / unit));
            }
        }
        close(&errors, &zeros, Tolerance { absolute: 1.0, relative: 0.0 })
    });
}

#[test]
fn shared_rows_go_on_from_a_checkpoint() {
    let Some(turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state");
    let mut straight = trainer(&turn, small(), settings(), with(Pulled));
    go_on(&mut straight, 17).write(&file).expect("a file");
    let expected = go_on(&mut straight, 30);
    let read = || TrainState::read(&file).expect("a state");
    let mut resumed = Trainer::resume(turn.gpu(), &small(), read(), with(Pulled)).expect("it goes on");
    let found = go_on(&mut resumed, 30);
    assert!(found.planes.iter().any(|plane| plane.name == "w_shared" && plane.data.len() == 2 * ROWS));
    assert_eq!((found.shared, found.planes), (expected.shared, expected.planes));
    straight.restore(&read()).expect("it goes back");
    assert_eq!(straight.state().expect("a state").planes, read().planes);
    for (options, now) in [(TrainerOptions::default(), "none"), (with(Brightness), "brightness")] {
        let refused = Trainer::resume(turn.gpu(), &small(), read(), options);
        let error = refused.err().expect("other parameters").to_string();
        assert!(error.contains("were pulled (1 rows") && error.contains(&format!("there are {now}")), "{error}");
    }
    let mut cut = read();
    cut.planes.retain(|plane| plane.name != "m_shared");
    cut.write(&file).expect("a file");
    let error = TrainState::read(&file).expect_err("a plane is missing").to_string();
    assert!(error.contains("the plane m_shared is missing"), "{error}");
}

/// As in an exposure model: a kernel changes the picture between blending and loss, and sums up its gradient.
#[test]
fn a_brightness_of_each_photo_is_found() {
    let Some(turn) = device() else { return };
    let mut scene = small();
    for view in scene.train.iter_mut().skip(1).step_by(2) {
        let darken = |[r, g, b, _]: &mut [u8; 4]| [r, g, b].into_iter().for_each(|v| *v = v.saturating_sub(50));
        let photo = view.photo.as_mut().expect("a photo");
        photo.edit(|photo| photo.rgba.iter_mut().for_each(darken)).expect("in memory");
    }
    let config = TrainConfig { iterations: 60, densify_from: Some(1000), ..TrainConfig::adc() };
    let mut trainer = trainer(&turn, scene, config, with(Brightness));
    go_on(&mut trainer, 60);
    let found: Vec<f32> = trainer.engine_mut().shared().expect("rows")[1..].iter().map(|row| row[0]).collect();
    let darkest = found.iter().step_by(2).copied().fold(f32::MAX, f32::min);
    let brightest = found.iter().skip(1).step_by(2).copied().fold(f32::MIN, f32::max);
    assert!(darkest > brightest + 0.05, "{found:?}");
}

#[test]
fn a_training_without_shared_rows_pays_nothing_for_them() {
    let shape = KernelShape::new(8, true);
    let room = EngineSize::new(1000, (64, 48)).for_training();
    let variant = Variant::plain(room.image);
    let work = |room: &EngineSize| {
        let list = training_step(&shape, &capacity(&shape, room), variant);
        let text = |work: &Work| match work {
            Work::Pass(pass) => format!("{} {:?} {:?} {:?}", pass.label, pass.buffers, pass.spec, pass.grid),
            Work::Fill { .. } | Work::Copy { .. } => format!("{work:?}"),
        };
        list.work.iter().map(text).collect::<Vec<_>>()
    };
    let (without, with) = (work(&room), work(&room.with_shared_rows(3)));
    let is_added = |text: &&String| text.starts_with("adam_shared") || text.contains(&format!("{:?}", Buf::V_SHARED));
    assert_eq!((with.iter().filter(is_added).count(), without.iter().filter(is_added).count()), (2, 0));
    assert_eq!(with.iter().filter(|text| !is_added(text)).collect::<Vec<_>>(), without.iter().collect::<Vec<_>>());
    let own: Vec<&str> =
        TABLE.iter().filter(|decl| decl.domain.count == Domain::SHARED_ROWS.count).map(|decl| decl.name).collect();
    let reported = |room: &EngineSize| {
        let capacity = capacity(&shape, room);
        let lists = Engine::lists_of(&shape, &capacity, room);
        let report =
            MemoryReport::predict(TABLE, &capacity.counts(), &lists, &Limits::default(), PlanOptions::default());
        let rows = report.expect("it fits").rows;
        rows.iter().filter(|row| own.contains(&row.name)).count()
    };
    assert_eq!((own.len(), reported(&room), reported(&room.with_shared_rows(3))), (7, 0, 7));
    let Some(turn) = device() else { return };
    let state = go_on(&mut trainer(&turn, small(), settings(), SchedulerOptions::default()), 2);
    assert!(state.shared.is_none() && state.planes.iter().all(|plane| !own.contains(&&plane.name[..])));
}
