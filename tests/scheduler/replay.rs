//! Recorded lists, submitted again and again with two steps in flight.

use super::*;

toy_shader!(
    accumulate,
    [],
    [("uniforms", R, S, 4), ("totals", RW, S, 4), ("report", W, S, 4)],
    "layout(local_size_x = 16) in;
    layout(std430, set=0, binding=0) readonly buffer uniforms_block { uint uniforms[]; };
    layout(std430, set=0, binding=1) buffer totals_block { uint totals[]; };
    layout(std430, set=0, binding=2) writeonly buffer report_block { uint report[]; };
    void main() {
        uint i = gl_GlobalInvocationID.x;
        totals[i] = totals[i] * 3 + uniforms[i % 4];
        report[i] = totals[i];
    }"
);

toy_shader!(
    arguments,
    [],
    [("uniforms", R, S, 4), ("arguments", W, S, 4)],
    "layout(local_size_x = 1) in;
    layout(std430, set=0, binding=0) readonly buffer uniforms_block { uint uniforms[]; };
    layout(std430, set=0, binding=1) writeonly buffer arguments_block { uint arguments[]; };
    void main() { arguments[1] = uniforms[0]; arguments[2] = 1; arguments[3] = 1; }"
);

toy_shader!(
    mark,
    [],
    [("marks", W, S, 4)],
    "layout(local_size_x = 32) in;
    layout(std430, set=0, binding=0) writeonly buffer marks_block { uint marks[]; };
    void main() { marks[gl_GlobalInvocationID.x] = 1; }"
);

#[test]
fn a_hundred_steps_in_flight_are_exact() {
    let Some(gpu) = device() else { return };
    for as_card in [false, true] {
        let options = SchedulerOptions { as_card, ..SchedulerOptions::default() };
        steps_in_flight(Scheduler::new(gpu.gpu(), TABLE, pixels(16), options).unwrap());
    }
}

fn steps_in_flight(mut scheduler: Scheduler) {
    let frames = scheduler.frames();
    let mut list = PassList::new("step");
    list.pass(PassDecl::new(accumulate(), vec![UNIFORMS, TOTALS, REPORT], Grid::Groups(1, 1, 1)));
    let id = scheduler.prepare(&list).unwrap();
    let (mut expected, mut history) = ([0_u32; 16], Vec::new());
    for step in 0..100_u32 {
        let frame = step as usize % frames;
        if let Some(oldest) = (step as usize).checked_sub(frames) {
            // Waits for the oldest alone: the steps between are still in flight.
            let report = scheduler.download_all::<u32>(REPORT, frame).unwrap();
            assert_eq!(report, history[oldest], "report of step {oldest}");
        }
        let uniforms = [step, step * 7, 1, step ^ 5];
        scheduler.upload(UNIFORMS, frame, 0, &uniforms).unwrap();
        scheduler.submit(id, frame).unwrap();
        for (i, total) in expected.iter_mut().enumerate() {
            *total = total.wrapping_mul(3).wrapping_add(uniforms[i % 4]);
        }
        history.push(expected.to_vec());
    }
    assert_eq!(scheduler.download_all::<u32>(TOTALS, 0).unwrap(), expected);
}

#[test]
fn an_earlier_pass_writes_the_grid_of_a_later() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(4096), SchedulerOptions::default()).unwrap();
    let mut list = PassList::new("indirect");
    list.fill(A, 0);
    list.pass(PassDecl::new(arguments(), vec![UNIFORMS, ARGUMENTS], Grid::Groups(1, 1, 1)));
    list.pass(PassDecl::new(mark(), vec![A], Grid::Indirect(ARGUMENTS, 4)));
    list.copy(A, REPORT, 0);
    let id = scheduler.prepare(&list).unwrap();
    for (frame, groups) in [(0, 3_u32), (1, 0), (0, 128), (1, 77)] {
        scheduler.upload(UNIFORMS, frame, 0, &[groups]).unwrap();
        scheduler.run(id, frame).unwrap();
        let marks = scheduler.download_all::<u32>(REPORT, frame).unwrap();
        let expected = (0..4096).map(|i| u32::from(i < groups * 32)).collect::<Vec<_>>();
        assert_eq!(marks, expected, "{groups} workgroups");
    }
}

#[test]
fn lists_run_in_the_order_of_their_submits() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(100_000), SchedulerOptions::default()).unwrap();
    // Both lists use the same bytes of scratch and pass data through `model`.
    let lists = [(2, 1), (3, 0)].map(|(factor, term)| {
        let mut list = PassList::new(format!("times {factor}"));
        list.copy(MODEL, A, 0);
        list.pass(scaled(A, B, factor, term, 100));
        list.copy(B, MODEL, 400);
        list
    });
    let ids = scheduler.prepare_all(&[&lists[0], &lists[1]]).unwrap();
    let mut expected = 1_u32;
    scheduler.upload(MODEL, 0, 0, &[1_u32; 100]).unwrap();
    for step in 0..20 {
        scheduler.submit(ids[step % 3 % 2], step % 2).unwrap();
        expected = if step % 3 % 2 == 0 { expected.wrapping_mul(2).wrapping_add(1) } else { expected.wrapping_mul(3) };
    }
    assert_eq!(scheduler.download_all::<u32>(MODEL, 0).unwrap(), vec![expected; 100]);
}
