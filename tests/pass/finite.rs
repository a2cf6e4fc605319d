//! The search for infinities and NaNs in a state equals its mirror.

use super::fixture::readable;
use crate::reference::finite::first_nonfinite;
use crate::support::device;
use crate::support::scenes::generator;
use bytemuck::Zeroable;
use labelgs::engine::{Engine, EngineSize};
use labelgs::pass;
use labelgs::scheduler::plan::Buf;
use labelgs::shaders::structs::StepUniforms;
use rand::Rng;

/// Gaussians: more than the grid has invocations, and a few more.
const ROW_COUNT: usize = 16_400;
/// A plane of one vec4, the widest one, and one of other width.
const CHECKED_PLANES: [(Buf, usize); 3] = [(Buf::MEANS, 4), (Buf::U_SH3, 20), (Buf::DENSIFY_STATS, 2)];

/// A wrong search.
type Mutant = fn(&[f64], usize) -> Option<usize>;

/// Searches that the test must tell from the right one.
const MUTANTS: [(&str, Mutant); 4] = [
    ("infinities pass", |values, words| values.iter().position(|value| value.is_nan()).map(|at| at / words)),
    ("NaNs pass", |values, words| values.iter().position(|value| value.is_infinite()).map(|at| at / words)),
    ("the last one is found", |values, words| values.iter().rposition(|value| !value.is_finite()).map(|at| at / words)),
    ("the last word passes", |values, words| first_nonfinite(&values[..values.len().saturating_sub(1)], words)),
];

#[test]
fn the_first_row_of_each_plane_that_is_not_finite_is_found() {
    let Some(turn) = device() else { return };
    let size = EngineSize::new(ROW_COUNT as u64, (64, 64)).for_training();
    let mut engine = Engine::new(turn.gpu(), size, readable()).expect("the engine starts");
    let list = pass::find_nonfinite(engine.shape(), engine.capacity(), &CHECKED_PLANES.map(|(buf, _)| buf));
    let id = engine.raw_mut().prepare(&list).expect("the list is planned");
    let mut random = generator(91);
    let mut seen = [0; MUTANTS.len()];
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::from_bits(0xff80_0001)];
    let plain = [0.0, -0.0, f32::MAX, f32::MIN, f32::MIN_POSITIVE, f32::from_bits(1), 1.5];
    for turn in 0..20 {
        // All rows, fewer, or none; those behind have NaNs, as rows of removed Gaussians may.
        let rows = [ROW_COUNT, ROW_COUNT - 1, 65, 1, 0][turn % 5];
        let planes = CHECKED_PLANES.map(|(_, words)| {
            let mut values: Vec<f32> =
                (0..ROW_COUNT * words).map(|_| plain[random.random_range(0..plain.len())]).collect();
            values[rows * words..].fill(f32::NAN);
            for place in 0..if rows == 0 { 0 } else { turn % 4 } {
                let at = if place == 0 { rows * words - 1 } else { random.random_range(0..rows * words) };
                values[at] = odd[random.random_range(0..odd.len())];
            }
            values
        });
        let count = rows as u32;
        let step = StepUniforms { gaussian_count: count, trained_count: count, ..StepUniforms::zeroed() };
        let sched = engine.raw_mut();
        sched.upload(Buf::STEP, 0, 0, &[step]).expect("upload");
        for ((buf, _), values) in CHECKED_PLANES.iter().zip(&planes) {
            sched.upload(*buf, 0, 0, values).expect("upload");
        }
        sched.run(id, 0).expect("run");
        sched.check_guards().expect("no pass writes outside of its buffers");
        let found = sched.download::<u32>(Buf::NONFINITE_ROWS, 0, 0, CHECKED_PLANES.len()).expect("download");
        for ((values, (_, words)), found) in planes.iter().zip(CHECKED_PLANES).zip(found) {
            let values: Vec<f64> = values[..rows * words].iter().map(|&value| value.into()).collect();
            let found = (found != u32::MAX).then_some(found as usize);
            assert_eq!(found, first_nonfinite(&values, words), "{rows} rows, turn {turn}");
            for (seen, (_, mutant)) in seen.iter_mut().zip(MUTANTS) {
                *seen += u32::from(mutant(&values, words) != found);
            }
        }
    }
    for (seen, (name, _)) in seen.into_iter().zip(MUTANTS) {
        assert!(seen > 0, "the test does not see that {name}");
    }
}
