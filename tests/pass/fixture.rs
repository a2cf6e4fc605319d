//! The fixture of the self-test on the shared device; errors panic.

use crate::reference::splat::{Splat, SplatGradient};
use crate::reference::{Row, Rules};
use crate::support::compare::{Verdict, check};
use crate::support::device::Turn;
use crate::support::mutants::mutants;
use crate::support::scenes::Scene;
use bytemuck::Pod;
use labelgs::engine::EngineSize;
use labelgs::engine::run::{ListKey, Report};
use labelgs::pass::{GroupBlend, KernelShape};
use labelgs::scheduler::SchedulerOptions;
use labelgs::scheduler::plan::Buf;
use labelgs::verify::selftest::fixture;
use labelgs::verify::selftest::order::DepthOrder;
use std::ops::{Deref, DerefMut};

pub use fixture::{GRADIENT_PLANES, MOMENTS_1, MOMENTS_2, PARAMETER_PLANES, VOTE_COLUMNS, readable};

/// A scene, an engine with its model, and the step that is run.
pub struct Fixture {
    inner: fixture::Fixture,
    // Last, so that its drop sees all messages of the validation layer.
    _turn: Turn,
}

impl Deref for Fixture {
    type Target = fixture::Fixture;

    fn deref(&self) -> &fixture::Fixture {
        &self.inner
    }
}

impl DerefMut for Fixture {
    fn deref_mut(&mut self) -> &mut fixture::Fixture {
        &mut self.inner
    }
}

/// Both forms of the blends; chunks are short, so that lists have several, and some are walked in parts.
pub const BLENDS: [Option<GroupBlend>; 2] =
    [None, Some(GroupBlend { chunk_length: 16, long_list: 48, ..GroupBlend::DEFAULT })];

impl Fixture {
    /// The scene on the shared device, with or without labels, with the device's kernel shape.
    pub fn new(turn: Turn, scene: Scene, labels: bool) -> Self {
        let shape = KernelShape::for_device(turn.capabilities());
        Self::with_shape(turn, scene, labels, shape)
    }

    /// As `new`, with kernels of a given shape.
    pub fn with_shape(turn: Turn, scene: Scene, labels: bool, shape: KernelShape) -> Self {
        Self::with_options(turn, scene, labels, shape, readable())
    }

    /// As `new`, with blends of one form or the other.
    pub fn blending(turn: Turn, scene: Scene, labels: bool, form: Option<GroupBlend>) -> Self {
        let shape = KernelShape::for_device(turn.capabilities());
        let shape = form.map_or(KernelShape { group_blend: None, ..shape }, |form| shape.with_group_blend_of(form));
        Self::with_shape(turn, scene, labels, shape)
    }

    /// As `with_shape`, with options of the scheduler; without `readable` only some buffers can be read back.
    pub fn with_options(turn: Turn, scene: Scene, labels: bool, shape: KernelShape, options: SchedulerOptions) -> Self {
        let inner = fixture::Fixture::new(turn.gpu(), scene, labels, shape, options).expect("the engine starts");
        Self { inner, _turn: turn }
    }

    /// As `with_shape`, with updates of the shape.
    pub fn with_update(turn: Turn, scene: Scene, labels: bool, shape: KernelShape) -> Self {
        Self::with_moments(turn, scene, labels, shape, false)
    }

    /// As `with_update`, with full or packed moments.
    pub fn with_moments(turn: Turn, scene: Scene, labels: bool, shape: KernelShape, half: bool) -> Self {
        let with = |room: EngineSize| room.with_half_moments(half);
        let inner = fixture::Fixture::with_room(turn.gpu(), scene, labels, (shape, readable()), with);
        Self { inner: inner.expect("the engine starts"), _turn: turn }
    }

    /// The device's sorted pairs: keys, and places before the sort.
    pub fn sorted_pairs(&mut self, count: usize) -> (Vec<u32>, Vec<u32>) {
        self.inner.sorted_pairs(count).expect("the pairs can be read")
    }

    /// The splats of the sorted (splat, tile) pairs.
    pub fn sorted_splats(&mut self, count: usize) -> Vec<u32> {
        self.inner.sorted_splats(count).expect("the pairs can be read")
    }

    /// Runs a training step; no pass may write outside of its buffers.
    pub fn train(&mut self) -> Report {
        self.inner.train().expect("the step runs and its buffers can grow")
    }

    /// Runs a training step as another list.
    pub fn train_as(&mut self, key: ListKey) -> Report {
        self.inner.train_as(key).expect("the step runs and its buffers can grow")
    }

    /// Runs the list of a render.
    pub fn render(&mut self) -> Report {
        self.inner.render().expect("the list runs and its buffers can grow")
    }

    /// The first `count` values of a buffer.
    pub fn get<T: Pod>(&mut self, buf: Buf, count: usize) -> Vec<T> {
        self.inner.get(buf, count).expect("the buffer can be read")
    }

    /// Splats that the device projected, by depth.
    pub fn splats(&mut self) -> Vec<Splat> {
        self.inner.splats().expect("the splats can be read")
    }

    /// Sums of the gradient records of each splat, by depth.
    pub fn splat_records(&mut self) -> Vec<[f32; 12]> {
        let order = DepthOrder::read(self).expect("an order");
        let records = self.get(Buf::V_SPLATS, order.splats.len());
        order.sorted(&records)
    }

    /// Gradients of the splats.
    pub fn splat_gradients(&mut self, splats: &[Splat]) -> Vec<SplatGradient> {
        self.inner.splat_gradients(splats).expect("the gradients can be read")
    }

    /// `count` rows of a set of planes (parameters, moments or gradients).
    pub fn rows(&mut self, planes: [Buf; 7], count: usize) -> Vec<Row> {
        self.inner.rows(planes, count).expect("the planes can be read")
    }

    /// The gradients of the last step by Gaussian; 0 where it has no splat.
    pub fn gradient_rows(&mut self) -> Vec<Row> {
        self.inner.gradient_rows().expect("the gradients can be read")
    }
}

/// Checks with the rules, then with each named constant changed, which must fail. Prints the largest error.
#[track_caller]
pub fn prove(name: &str, bearing: &[&str], compare: impl Fn(&Rules) -> Verdict) {
    let summary = check(name, compare(&Rules::default()));
    println!("{name}: {:.3}, as a whole {:.3} of the tolerance, {} flips", summary.worst, summary.whole, summary.flips);
    let all = mutants();
    for wanted in bearing {
        let mutant = all.iter().find(|mutant| mutant.name == *wanted).unwrap_or_else(|| panic!("no mutant {wanted}"));
        assert!(compare(&mutant.rules).is_err(), "{name} does not see a change of {wanted}");
    }
}
