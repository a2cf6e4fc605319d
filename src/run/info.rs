//! `run.json`: command, device, inputs and warnings of a run. The report uses it.

use super::history::Entry;
use super::passes::Pass;
use super::{Request, Run};
use crate::engine::Engine;
use crate::error::Result;
use crate::files::atomic;
use crate::gpu::Gpu;
use crate::phases;
use crate::scene::Dataset;
use crate::scheduler::SchedulerOptions;
use crate::train::Trainer;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// Name of the file.
pub(crate) const RUN_FILE: &str = "run.json";
/// Most warnings stored per start of the run.
const WARNINGS_MAX: usize = 200;
/// Most buffers listed, largest first.
const LISTED_BUFFERS_MAX: usize = 12;

/// The record of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Info {
    pub schema_version: u32,
    pub scene: String,
    pub masks: Option<String>,
    pub train_views: u64,
    pub test_views: u64,
    /// Every start or resumption of the run, in order.
    pub parts: Vec<ProgramStart>,
    pub memory: Memory,
    /// Seconds by phase of the last start, until its last step.
    pub phases: BTreeMap<String, f64>,
    /// The end; `None` while the run is in progress or after it was killed.
    pub ended: Option<RunEnd>,
    /// Views with pictures, worst first.
    pub pictures: Vec<PicturedView>,
    /// Times by pass at the end of the run.
    pub passes: Vec<Pass>,
}

/// One start or resumption of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ProgramStart {
    /// The command line.
    pub command: Option<String>,
    /// Version, commit and features of labelgs.
    pub labelgs: String,
    pub device: String,
    /// Step of the checkpoint it resumed from; 0 for a new run.
    pub after: u32,
    /// Start time, seconds since 1970.
    pub began: u64,
    pub warnings: Vec<String>,
}

/// Planned and measured memory, bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Memory {
    /// Planned device memory for the first model.
    pub planned_start: Option<u64>,
    /// Planned device memory for the last model.
    pub planned_end: Option<u64>,
    /// Peak size of all device buffers.
    pub device_peak: Option<u64>,
    /// Peak host memory of the process.
    pub host_peak: Option<u64>,
    /// The largest buffers of the last plan.
    pub buffers: Vec<(String, u64)>,
}

/// The end of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunEnd {
    /// True if the observer stopped the run.
    pub stopped: bool,
    /// Total training time, s.
    pub seconds: f64,
}

/// A view with pictures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct PicturedView {
    pub view: String,
    pub psnr: Option<f64>,
    pub ssim: Option<f64>,
    pub iou: Option<f64>,
    /// The view's pictures are `NUMBER-KIND` in the pictures folder.
    pub number: u32,
}

impl Info {
    /// Starts the record of a run, or continues the one in the folder.
    pub(super) fn new(request: &Request, after: u32, masks: Option<&Path>, dataset: &Dataset, gpu: &Gpu) -> Self {
        let before = if after > 0 { Self::read(&request.output.join(RUN_FILE)) } else { Ok(None) };
        let before = before.unwrap_or_else(|error| {
            tracing::warn!("{error}; the report will miss everything before step {after}");
            None
        });
        let mut info = before.unwrap_or_default();
        let found = gpu.capabilities();
        info.parts.push(ProgramStart {
            command: request.command.clone(),
            labelgs: crate::version::text(),
            device: format!("{} ({} {})", found.name, found.driver_name, found.driver_info),
            after,
            began: SystemTime::UNIX_EPOCH.elapsed().map_or(0, |since| since.as_secs()),
            warnings: Vec::new(),
        });
        Self {
            schema_version: 1,
            scene: request.scene.display().to_string(),
            masks: masks.map(|masks| masks.display().to_string()),
            train_views: dataset.train.len() as u64,
            test_views: dataset.test.len() as u64,
            ended: None,
            pictures: Vec::new(),
            passes: Vec::new(),
            ..info
        }
    }

    /// Records the planned memory of the first model. A resumed run keeps its original value.
    pub(super) fn plan(&mut self, trainer: &mut Trainer) {
        let engine = trainer.engine_mut();
        let plan = Engine::predict(engine.gpu(), engine.size(), SchedulerOptions::default());
        self.memory.planned_start = self.memory.planned_start.or(plan.ok().map(|plan| plan.total));
    }

    /// Records the time by phase.
    pub(super) fn note_phases(&mut self) {
        self.phases = phases::take().into_iter().map(|(name, seconds)| (name.to_owned(), seconds)).collect();
    }

    /// Reads the file; `None` if it does not exist.
    pub(crate) fn read(path: &Path) -> Result<Option<Self>> {
        super::report::json(path)
    }

    /// Writes the file.
    pub(super) fn write(&self, out: &Path) -> Result<()> {
        atomic::write_json(&out.join(RUN_FILE), self)
    }

    /// Adds a warning unless it is already stored.
    fn warned(&mut self, text: &str) {
        let is_known = self.parts.iter().any(|part| part.warnings.iter().any(|known| known == text));
        if let Some(part) = self.parts.last_mut().filter(|_| !is_known) {
            match part.warnings.len() {
                0..WARNINGS_MAX => part.warnings.push(text.to_owned()),
                WARNINGS_MAX => part.warnings.push("more warnings were given than are stored here".to_owned()),
                _ => {}
            }
        }
    }
}

impl Run<'_> {
    /// Records a warning of the run itself.
    pub(super) fn note_warning(&mut self, text: &str) {
        self.history.put(&Entry::Warning { step: self.trainer.steps_done(), text: text.to_owned() });
        self.info.warned(text);
    }

    /// Writes `run.json` with the warnings so far.
    pub(super) fn write_info(&mut self) -> Result<()> {
        if let Some(log) = self.request.warnings {
            log().iter().for_each(|text| self.info.warned(text));
        }
        self.info.write(&self.request.output)
    }

    /// Records planned and used memory.
    pub(super) fn note_memory(&mut self) {
        let engine = self.trainer.engine_mut();
        let (gpu, size): (Arc<Gpu>, _) = (Arc::clone(engine.gpu()), *engine.size());
        let memory = &mut self.info.memory;
        memory.device_peak = memory.device_peak.max(Some(gpu.peak_memory()));
        memory.host_peak = memory.host_peak.max(host_peak());
        if let Ok(plan) = Engine::predict(&gpu, &size, SchedulerOptions::default()) {
            memory.planned_end = Some(plan.total);
            let mut rows: Vec<(String, u64)> = plan.rows.iter().map(|row| (row.name.to_owned(), row.bytes)).collect();
            rows.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
            rows.truncate(LISTED_BUFFERS_MAX);
            memory.buffers = rows;
        }
    }
}

/// Returns the peak memory of this process; `None` if the system does not report it.
#[expect(clippy::disallowed_methods, reason = "a file of the system, and no input")]
fn host_peak() -> Option<u64> {
    let text = std::fs::read_to_string(PathBuf::from("/proc/self/status")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib << 10)
}
