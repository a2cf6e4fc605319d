//! A scene on the device with the command lists of all modes.

use super::errors::Outcome;
use super::modes::{Mode, Replacements};
use crate::measure::timed;
use labelgs::engine::run::ListKey;
use labelgs::gpu::Gpu;
use labelgs::pass::{self, KernelShape, Stage, Variant};
use labelgs::scheduler::plan::{Buf, PlanOptions};
use labelgs::scheduler::{ListId, SchedulerOptions};
use labelgs::shaders::structs::Counters;
use labelgs::verify::selftest::fixture::Fixture;
use labelgs::verify::selftest::scenes::Scene;
use labelgs::{Error, Result};
use std::collections::BTreeMap;
use std::sync::Arc;

/// One submit.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Milliseconds of each stage.
    pub stages: BTreeMap<Stage, f64>,
    /// CPU time of the process, ms; `None` if the system does not report it.
    pub cpu: Option<f64>,
    /// Counters of the device.
    pub counters: Counters,
}

/// A scene, an engine, and a command list per mode.
pub struct TestBed<'a> {
    fixture: Fixture,
    modes: &'a [(Mode, Replacements)],
    lists: Vec<ListId>,
    /// Stages of the items of every list.
    stages: Vec<Stage>,
}

impl<'a> TestBed<'a> {
    /// Uploads the scene.
    pub fn new(gpu: &Arc<Gpu>, scene: Scene, modes: &'a [(Mode, Replacements)]) -> Result<Self> {
        let shape = KernelShape::for_device(gpu.capabilities());
        // With a barrier before each item, times can be attributed to items; without aliasing, all buffers can be read
        // back.
        let plan = PlanOptions { alias: false, guards: false, barrier_everywhere: true };
        let options = SchedulerOptions { plan, timestamps: true, ..SchedulerOptions::default() };
        let fixture = Fixture::new(Arc::clone(gpu), scene, false, shape, options)?;
        Ok(Self { fixture, modes, lists: Vec::new(), stages: Vec::new() })
    }

    /// Pixels of a tile.
    pub fn tile_pixels(&self) -> u32 {
        self.fixture.engine.shape().tile_pixels()
    }

    /// Without the optimiser, which no mode changes and which would update the model.
    fn variant(&self) -> Variant {
        let size = (self.fixture.scene.camera.width, self.fixture.scene.camera.height);
        let sh_degree = self.fixture.config.sh_degree;
        Variant { sh_degree, update: false, ..Variant::plain(size) }
    }

    fn prepare(&mut self) -> Result<()> {
        let engine = &self.fixture.engine;
        let default = pass::training_step(engine.shape(), engine.capacity(), self.variant());
        let lists = self.modes.iter().map(|(mode, kernels)| mode.list(&default, kernels));
        let lists = lists.collect::<Result<Vec<_>>>()?;
        self.stages = pass::stage::stages(&default).into_iter().map(|(stage, _)| stage).collect();
        self.lists = self.fixture.engine.raw_mut().prepare_all(&lists.iter().collect::<Vec<_>>())?;
        Ok(())
    }

    /// Runs a list. If a buffer was too small, enlarges the memory, records all lists again and repeats.
    pub fn run(&mut self, list: usize) -> Result<Sample> {
        loop {
            if self.lists.is_empty() {
                self.prepare()?;
            }
            let fixture = &mut self.fixture;
            fixture.write()?;
            let ((), cost) = timed(|| fixture.engine.raw_mut().run(self.lists[list], 0))?;
            let report = fixture.engine.report(0)?;
            if fixture.engine.recover(&report)? {
                self.lists.clear();
                continue;
            }
            let times = fixture.engine.raw().timings(self.lists[list], 0)?;
            if times.is_empty() {
                return Err(Error::NoDevice("this device has no timestamps on its compute queue".to_owned()));
            }
            let mut stages = BTreeMap::new();
            for (stage, (_, ns)) in self.stages.iter().zip(times) {
                *stages.entry(*stage).or_default() += ns as f64 * 1e-6;
            }
            let cpu = (cost.cpu > 0.0).then_some(cost.cpu);
            return Ok(Sample { stages, cpu, counters: report.counters });
        }
    }

    /// Returns the image and gradients of the last run.
    pub fn outcome(&mut self) -> Result<Outcome> {
        let pixels = self.fixture.pixels();
        let image = self.fixture.get::<[f32; 4]>(Buf::IMAGE, pixels)?;
        let colours = image.iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)).collect();
        Ok(Outcome { colours, rows: self.fixture.gradient_rows()? })
    }

    /// Checks that the engine's own list produces the image of the default mode bit by bit.
    pub fn check_default(&mut self, outcome: &Outcome) -> Result<()> {
        let key = ListKey::Train(self.variant());
        self.fixture.train_as(key)?;
        let own = self.outcome()?;
        if own.colours == outcome.colours && own.rows == outcome.rows {
            return Ok(());
        }
        Err(Error::Check("the default mode differs from the engine's step".to_owned()))
    }
}
