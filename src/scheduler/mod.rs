//! The scheduler: plans pass lists ([`plan`], pure), owns the memory of all buffers, and replays recordings.
//!
//! Several steps are in flight, one per frame, on one queue with one timeline. Every recording begins with a full
//! barrier, so lists run in submission order. Inside a list, the plan's barriers order the items.

mod guard;
mod loads;
mod packed;
pub mod plan;
pub(crate) mod profiler;
mod recorder;
mod recording;
mod snapshot;
mod storage;
mod transfer;

pub use loads::{DataKey, Traffic};
pub use profiler::{PassTime, Profiler};
pub use snapshot::Snapshot;

use crate::error::{Error, Result, Setting};
use crate::gpu::{CommandBuffer, Gpu, Lane, Timeline};
use crate::phases::{self, Phase};
use crate::scheduler::plan::{Buf, BufferDecl, Limits, MemoryReport, PassList, Plan, PlanOptions, Table, memory};
use crate::stage::Stage;
use loads::Loads;
use recorder::Recorder;
use recording::Recording;
use std::sync::{Arc, Weak};
use storage::Storage;
use transfer::Staging;

/// Options of a scheduler.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SchedulerOptions {
    /// Options of the plans. With `barrier_everywhere`, each measured time belongs to one pass.
    pub plan: PlanOptions,
    /// Writes a timestamp after each item, see [`Scheduler::timings`].
    pub timestamps: bool,
    /// Fills scratch memory with 0xFFFFFFFF (NaN) whenever a list is prepared.
    pub poison_step: bool,
    /// Each item writes a crash marker; when the device is lost, the error names the last item.
    pub crash_markers: bool,
    /// Upper limit on the device memory in use, bytes.
    pub memory_limit: Option<u64>,
    /// Treats any device like a GPU for steps in flight and their data.
    pub as_card: bool,
}

impl SchedulerOptions {
    /// Returns the device limits for plans.
    pub fn limits(&self, gpu: &Gpu) -> Limits {
        let limits = gpu.limits().plan;
        let limits = Limits { max_memory: self.memory_limit.unwrap_or(u64::MAX).min(limits.max_memory), ..limits };
        if self.as_card { limits.for_gpu() } else { limits }
    }
}

/// A prepared pass list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ListId {
    index: usize,
    /// Changing counts discards all lists; ids of earlier generations are refused.
    generation: u64,
}

/// A submit to wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticket(u64);

struct List {
    plan: Plan,
    /// One per frame.
    recordings: Vec<Recording>,
}

/// Executes pass lists.
pub struct Scheduler {
    lists: Vec<List>,
    storage: Storage,
    staging: Staging,
    /// For transfers outside of lists.
    immediate: CommandBuffer,
    timeline: Arc<Timeline>,
    /// Timeline value of the last submit.
    submitted: u64,
    /// Timeline value of the last submit of each frame.
    frame_busy: Vec<u64>,
    /// Set on devices whose data go through staging.
    loads: Option<Loads>,
    traffic: Traffic,
    /// Snapshots whose memory is not free yet.
    snapshots: Vec<Weak<()>>,
    /// The list that was prepared or submitted last; `upload` and `download` access its scratch buffers.
    current: Option<usize>,
    generation: u64,
    /// Numbers of elements, which domains refer to.
    counts: Vec<u64>,
    options: SchedulerOptions,
    limits: Limits,
    table: &'static Table,
    // Last field, so that the device outlives everything made from it.
    gpu: Arc<Gpu>,
}

impl Scheduler {
    /// Allocates everything except scratch memory; model and persistent buffers start as zeros.
    pub fn new(gpu: Arc<Gpu>, table: &'static Table, counts: Vec<u64>, options: SchedulerOptions) -> Result<Self> {
        let limits = options.limits(&gpu);
        MemoryReport::predict(table, &counts, &[], &limits, options.plan)?;
        let mut scheduler = Self {
            lists: Vec::new(),
            storage: Storage::new(table.len()),
            staging: Staging::new(&gpu)?,
            immediate: CommandBuffer::new(&gpu, Lane::Compute)?,
            timeline: Arc::new(Timeline::new(&gpu)?),
            submitted: 0,
            frame_busy: vec![0; limits.frames],
            loads: limits.stages.then(|| Loads::new(&gpu, limits.frames)).transpose()?,
            traffic: Traffic::default(),
            snapshots: Vec::new(),
            current: None,
            generation: 0,
            counts,
            options,
            limits,
            table,
            gpu,
        };
        scheduler.allocate_own()?;
        Ok(scheduler)
    }

    /// Predicts the memory of lists with other counts, under the limits and options of this scheduler.
    pub fn predict_here(&self, counts: &[u64], lists: &[PassList]) -> Result<MemoryReport> {
        MemoryReport::predict(self.table, counts, lists, &self.limits, self.options.plan)
    }

    /// Plans and records a list.
    pub fn prepare(&mut self, list: &PassList) -> Result<ListId> {
        let ids = self.prepare_all(&[list])?;
        ids.first().copied().ok_or_else(|| Error::Bug("no list was prepared".to_owned()))
    }

    /// Plans and records several lists; this is cheaper than one by one if scratch memory must grow.
    pub fn prepare_all(&mut self, lists: &[&PassList]) -> Result<Vec<ListId>> {
        phases::timed(Phase::Compile, || self.plan_and_record(lists))
    }

    fn plan_and_record(&mut self, lists: &[&PassList]) -> Result<Vec<ListId>> {
        self.replace_lost()?;
        let mut plans = Vec::new();
        for list in lists {
            plans.push(Plan::new(self.table, &self.counts, list, &self.limits, self.options.plan)?);
        }
        let all = self.lists.iter().map(|list| &list.plan).chain(&plans).collect::<Vec<_>>();
        let total = MemoryReport::from_plans(self.table, &self.counts, &all, &self.limits, self.options.plan)?.total;
        let pages = memory::merge_pages(all.iter().map(|plan| plan.step_pages.as_slice()));
        self.make_room(total)?;
        self.grow_arena(&pages)?;
        if self.options.poison_step {
            self.poison()?;
        }
        // Kernels compile on first use, which may take long with a new driver.
        let _stage = Stage::new("compiling kernels", 0);
        let passes = plans.iter().flat_map(|plan| plan.list.passes().map(move |pass| (plan, pass)));
        let kernels = passes.map(|(plan, pass)| Ok((pass.shader, &pass.spec[..], self.windows(plan, pass)?)));
        self.gpu.compile(&kernels.collect::<Result<Vec<_>>>()?)?;
        let mut ids = Vec::new();
        for plan in plans {
            let recordings = self.record(&plan)?;
            self.lists.push(List { plan, recordings });
            self.current = Some(self.lists.len() - 1);
            ids.push(ListId { index: self.lists.len() - 1, generation: self.generation });
        }
        Ok(ids)
    }

    /// Submits a prepared list with the host-visible buffers of a frame.
    ///
    /// Allocates nothing. Blocks only if the same list is still running in the same frame or, with staging, if any list
    /// is.
    pub fn submit(&mut self, id: ListId, frame: usize) -> Result<Ticket> {
        let index = self.index(id)?;
        self.check_frame(frame)?;
        self.wait(Ticket(self.lists[index].recordings[frame].busy))?;
        if self.loads.is_some() {
            self.wait_frame(frame)?;
        }
        let recording = &self.lists[index].recordings[frame];
        if let Some(markers) = &recording.markers {
            markers.reset()?;
        }
        let value = self.submitted + 1;
        let loads =
            self.loads.as_mut().map(|loads| loads.submit(&self.gpu, &self.storage, frame)).transpose()?.flatten();
        let submitted = self.gpu.submit(Lane::Compute, &[&recording.command], loads, (&self.timeline, value));
        submitted.map_err(|error| self.name_pass(error))?;
        self.submitted = value;
        self.frame_busy[frame] = value;
        self.lists[index].recordings[frame].busy = value;
        self.current = Some(index);
        Ok(Ticket(value))
    }

    /// Submits a list and waits for it.
    pub fn run(&mut self, id: ListId, frame: usize) -> Result<()> {
        let ticket = self.submit(id, frame)?;
        self.wait(ticket)
    }

    /// Blocks until a submit is done.
    pub fn wait(&self, ticket: Ticket) -> Result<()> {
        if ticket.0 == 0 {
            return Ok(());
        }
        self.timeline.wait(ticket.0).map_err(|error| {
            // After this error the caller may free memory that is in use, so wait. A lost device returns immediately.
            let _ = self.gpu.wait_idle();
            self.name_pass(error)
        })
    }

    /// Returns true if a submit is done, and does not block.
    pub fn is_done(&self, ticket: Ticket) -> Result<bool> {
        self.timeline.is_reached(ticket.0).map_err(|error| self.name_pass(error))
    }

    /// Blocks until all submits are done.
    pub fn wait_all(&self) -> Result<()> {
        self.wait(Ticket(self.submitted))
    }

    /// Blocks until the host may touch the host-visible buffers of a frame.
    pub fn wait_frame(&self, frame: usize) -> Result<()> {
        self.check_frame(frame)?;
        self.wait(Ticket(self.frame_busy[frame]))
    }

    /// Changes the counts. Model buffers keep their contents (the common prefix; new elements are 0), all other buffers
    /// are reset, and all lists are discarded. If memory does not suffice, the old counts remain in effect.
    pub fn set_counts(&mut self, counts: Vec<u64>) -> Result<()> {
        self.wait_all()?;
        phases::timed(Phase::Grow, || self.replace_counts(counts))
    }

    fn replace_counts(&mut self, counts: Vec<u64>) -> Result<()> {
        let total = MemoryReport::predict(self.table, &counts, &[], &self.limits, self.options.plan)?.total;
        self.make_room(total)?;
        self.lists.clear();
        self.current = None;
        self.generation += 1;
        self.storage.drop_arena();
        match self.resize_own(counts.clone()) {
            // Drivers may offer less memory than they report.
            Err(error) if error.is_out_of_memory() && self.free_more()? => self.resize_own(counts),
            other => other,
        }
    }

    /// Sets whether future lists measure the time of each item, and whether a barrier precedes each item. Discards all
    /// existing lists.
    pub fn time_items(&mut self, timestamps: bool, barriers: bool) -> Result<()> {
        (self.options.timestamps, self.options.plan.barrier_everywhere) = (timestamps, barriers);
        self.set_counts(self.counts.clone())
    }

    /// Returns the current counts.
    pub fn counts(&self) -> &[u64] {
        &self.counts
    }

    /// Most steps in flight.
    pub fn frames(&self) -> usize {
        self.limits.frames
    }

    /// True if the host works ahead of the device.
    pub fn runs_ahead(&self) -> bool {
        self.limits.runs_ahead
    }

    /// Bytes between host and device so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// The device.
    pub fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    /// Allocated bytes of each buffer, each scratch page and the staging memory.
    pub fn memory(&self) -> Vec<(String, u64)> {
        let mut rows = self.storage.memory(self.table);
        rows.push(("staging".to_owned(), self.staging.bytes()));
        rows.extend(self.loads.as_ref().map(|loads| ("kept data".to_owned(), loads.kept_bytes())));
        rows
    }

    /// Returns the total of allocated bytes.
    pub fn memory_total(&self) -> u64 {
        self.memory().iter().map(|(_, bytes)| bytes).sum()
    }

    /// Returns the plan of a list, for reports.
    pub fn plan(&self, id: ListId) -> Result<&Plan> {
        Ok(&self.lists[self.index(id)?].plan)
    }

    /// Returns the nanoseconds of each item of a list, from its last submit with a frame. Waits for that submit.
    ///
    /// Without `barrier_everywhere`, items overlap, and an entry is the additional time of the item. The result is
    /// empty if timestamps were off when the list was prepared, if the device has none, or before the first submit.
    pub fn timings(&self, id: ListId, frame: usize) -> Result<Vec<(String, u64)>> {
        let list = &self.lists[self.index(id)?];
        self.check_frame(frame)?;
        let recording = &list.recordings[frame];
        let Some(queries) = recording.queries.as_ref().filter(|_| recording.busy > 0) else { return Ok(Vec::new()) };
        self.wait(Ticket(recording.busy))?;
        let times = queries.intervals()?;
        Ok(list.plan.items.iter().map(|item| item.label.clone()).zip(times).collect())
    }

    fn index(&self, id: ListId) -> Result<usize> {
        if id.generation == self.generation && id.index < self.lists.len() {
            return Ok(id.index);
        }
        Err(Error::Bug("a pass list was used after counts changed; prepare it again".to_owned()))
    }

    fn check_frame(&self, frame: usize) -> Result<()> {
        let frames = self.limits.frames;
        if frame < frames { Ok(()) } else { Err(Error::Bug(format!("frame {frame} of {frames}"))) }
    }

    fn decl(&self, buf: Buf) -> Result<&'static BufferDecl> {
        self.table.get(buf.index()).ok_or_else(|| Error::Bug(format!("there is no buffer {} in the table", buf.0)))
    }

    /// Records a list for each frame.
    fn record(&self, plan: &Plan) -> Result<Vec<Recording>> {
        (0..self.limits.frames)
            .map(|frame| Recording::new(&self.gpu, plan, &self.storage, frame, self.options))
            .collect()
    }

    /// Records, submits and waits for a few commands outside of any list.
    fn immediately(
        &mut self,
        commands: impl FnOnce(&mut Recorder<'_>, &Storage, &Staging) -> Result<()>,
    ) -> Result<()> {
        let mut recorder = Recorder::begin(&self.gpu, &self.immediate)?;
        commands(&mut recorder, &self.storage, &self.staging)?;
        recorder.end()?;
        let value = self.submitted + 1;
        let submitted = self.gpu.submit(Lane::Compute, &[&self.immediate], None, (&self.timeline, value));
        submitted.map_err(|error| self.name_pass(error))?;
        self.submitted = value;
        self.wait(Ticket(value))
    }

    /// Adds the last pass that is known to have started to the error of a lost device.
    fn name_pass(&self, error: Error) -> Error {
        if !matches!(error, Error::DeviceLost { .. }) {
            return error;
        }
        let marked = self.lists.iter().flat_map(|list| list.recordings.iter().map(move |one| (one, &list.plan)));
        let marked = marked.filter_map(|(recording, plan)| {
            let item = recording.markers.as_ref()?.last_begun()?;
            Some((recording.busy, format!("{} of list {}", plan.items.get(item)?.label, plan.list.name)))
        });
        let pass = match marked.max_by_key(|(busy, _)| *busy) {
            Some((busy, pass)) if busy == self.submitted => pass,
            Some((_, pass)) => format!("{pass}, or an item after it"),
            None if self.options.crash_markers => "none; memory was being set up".to_owned(),
            None => format!("unknown: crash markers are off (a training with {} has them)", Setting("restart")),
        };
        Error::DeviceLost { pass }
    }
}

impl Drop for Scheduler {
    fn drop(&mut self) {
        // Memory in use must not be freed. A lost device uses none.
        let _ = self.wait_all();
        let _ = self.loads.as_ref().map(Loads::wait);
    }
}

impl std::fmt::Debug for Scheduler {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Scheduler({} lists, {} bytes)", self.lists.len(), self.memory_total())
    }
}
