//! A scene on the device with the lists of all modes.

use super::errors::Outcome;
use super::modes::Mode;
use super::patch::Replacements;
use crate::measure::cpu_time;
use labelgs::engine::ListKey;
use labelgs::gpu::Gpu;
use labelgs::pass::{self, KernelShape, Stage, Variant};
use labelgs::scheduler::plan::{Buf, PassList, PlanOptions};
use labelgs::scheduler::{ListId, SchedulerOptions};
use labelgs::shaders::structs::Counters;
use labelgs::verify::selftest::fixture::Fixture;
use labelgs::verify::selftest::scenes::Scene;
use labelgs::{Error, Result};
use std::sync::Arc;
use std::time::Duration;

/// One submit.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Stage, name and nanoseconds of each item of the list.
    pub items: Vec<(Stage, String, u64)>,
    /// Processor time of the process.
    pub cpu: Option<Duration>,
    /// What the device counted.
    pub counters: Counters,
}

impl Sample {
    /// Milliseconds of the items of some stages.
    pub fn ms(&self, of: impl Fn(Stage) -> bool) -> f64 {
        self.items.iter().filter(|(stage, ..)| of(*stage)).map(|(.., ns)| *ns as f64 * 1e-6).sum()
    }
}

/// A scene, an engine, and a list for each mode; after them the default with the optimiser, which trains nothing.
pub struct Bed<'a> {
    fixture: Fixture,
    modes: &'a [(Mode, Replacements)],
    lists: Vec<ListId>,
    stages: Vec<Vec<(Stage, String)>>,
}

impl<'a> Bed<'a> {
    /// Uploads the scene.
    pub fn new(gpu: &Arc<Gpu>, scene: Scene, modes: &'a [(Mode, Replacements)]) -> Result<Self> {
        let shape = KernelShape::of(gpu.capabilities());
        // With a barrier before each item, times belong to their items; without aliasing, all can be read back.
        let plan = PlanOptions { alias: false, guards: false, barrier_everywhere: true };
        let options = SchedulerOptions { plan, timestamps: true, ..SchedulerOptions::default() };
        let mut fixture = Fixture::new(Arc::clone(gpu), scene, false, shape, options)?;
        let config = &mut fixture.config;
        (config.position_lr_init, config.position_lr_final) = (f64::MIN_POSITIVE, f64::MIN_POSITIVE);
        (config.feature_lr, config.opacity_lr, config.scaling_lr, config.rotation_lr) = (0.0, 0.0, 0.0, 0.0);
        Ok(Self { fixture, modes, lists: Vec::new(), stages: Vec::new() })
    }

    /// Number of the list with the optimiser; those before it are the modes.
    pub fn full_step(&self) -> usize {
        self.modes.len()
    }

    /// Pixels of a tile.
    pub fn tile_pixels(&self) -> u32 {
        self.fixture.engine.shape().tile_pixels()
    }

    fn variant(&self, update: bool) -> Variant {
        let size = (self.fixture.scene.camera.width, self.fixture.scene.camera.height);
        Variant { labels: false, lift: false, sh_degree: self.fixture.config.sh_degree, size, update, counts: false }
    }

    fn default_list(&self, update: bool) -> PassList {
        pass::training_step(self.fixture.engine.shape(), self.fixture.engine.raw().capacity(), self.variant(update))
    }

    fn prepare(&mut self) -> Result<()> {
        let (default, digit_bits) = (self.default_list(false), self.fixture.engine.shape().digit_bits);
        let lists = self.modes.iter().map(|(mode, shaders)| mode.list(&default, shaders, digit_bits));
        let mut lists = lists.collect::<Result<Vec<_>>>()?;
        lists.push(self.default_list(true));
        self.stages = lists.iter().map(pass::stage::stages).collect();
        self.lists = self.fixture.engine.raw_mut().prepare_all(&lists.iter().collect::<Vec<_>>())?;
        Ok(())
    }

    /// Runs one list; again with more memory, and all lists recorded anew, if a buffer was too small.
    pub fn run(&mut self, list: usize) -> Result<Sample> {
        loop {
            if self.lists.is_empty() {
                self.prepare()?;
            }
            let fixture = &mut self.fixture;
            fixture.write()?;
            let before = cpu_time();
            fixture.engine.raw_mut().run(self.lists[list], 0)?;
            let cpu = cpu_time().saturating_sub(before);
            let report = fixture.engine.report(0)?;
            if fixture.engine.recover(&report)? {
                self.lists.clear();
                continue;
            }
            let times = fixture.engine.raw().timings(self.lists[list], 0)?;
            if times.is_empty() {
                return Err(Error::NoDevice("this device has no timestamps on its compute queue".to_owned()));
            }
            let named = self.stages[list].iter().cloned().zip(times);
            let items = named.map(|((stage, name), (_, ns))| (stage, name, ns)).collect();
            return Ok(Sample { items, cpu: (!cpu.is_zero()).then_some(cpu), counters: report.counters });
        }
    }

    /// Picture and gradients of the last run.
    pub fn outcome(&mut self) -> Result<Outcome> {
        let pixels = self.fixture.pixels();
        let image = self.fixture.get::<[f32; 4]>(Buf::IMAGE, pixels)?;
        let colours = image.iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)).collect();
        Ok(Outcome { colours, rows: self.fixture.gradient_rows()? })
    }

    /// The engine's own list gives the picture of the default mode, to the bit.
    pub fn check_default(&mut self, outcome: &Outcome) -> Result<()> {
        let key = ListKey::Train(self.variant(false));
        self.fixture.train_as(key)?;
        let own = self.outcome()?;
        if own.colours == outcome.colours && own.rows == outcome.rows {
            return Ok(());
        }
        Err(Error::Check("the default mode is not the step of the engine".to_owned()))
    }
}
