//! Peak rates and costs of the device, measured with single-purpose kernels.

use crate::compiler::{shader, texel_define};
use crate::measure::{median, table};
use labelgs::Result;
use labelgs::gpu::Gpu;
use labelgs::scheduler::plan::{Buf, BufferDecl, Class, Domain, Grid, PassDecl, PassList, Table, TexelFormat};
use labelgs::scheduler::{Scheduler, SchedulerOptions};
use labelgs::shaders::ShaderDesc;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

/// vec4 in the copied buffer, nearly 64 MiB: the largest number of workgroups in a dispatch.
const COPY_VECS: u32 = 65_535 * 64;
/// vec4 written by the host, 16 MiB.
const HOST_VECS: u32 = 1 << 20;
/// Rounds of eight operations per invocation.
const ROUNDS_PER_INVOCATION: u32 = 2048;
/// Dispatches in the lists that measure the cost of a dispatch.
const DISPATCH_COUNT: u32 = 512;
const REPETITION_COUNT: usize = 8;
/// Submits whose latency is measured.
const SUBMIT_COUNT: usize = 200;

/// Buffers of the benchmark.
const FROM_BUFFER: Buf = Buf(0);
const TO_BUFFER: Buf = Buf(1);
const GRID_BUFFER: Buf = Buf(2);
const HOST_BUFFER: Buf = Buf(3);

/// Rates of a device per second, and costs, s.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Ceilings {
    /// Multiply-adds, as the driver compiles `v * a + b`.
    pub operations: f64,
    /// `exp2`.
    pub exp2: f64,
    /// Divisions.
    pub divisions: f64,
    /// Bytes read and written by a copy.
    pub bytes: f64,
    /// Shuffles per invocation; `None` if subgroups are emulated.
    pub shuffles: Option<f64>,
    /// Ballots per invocation.
    pub ballots: Option<f64>,
    /// Bytes loaded from shared memory, 16 at a time.
    pub shared_bytes: f64,
    /// Atomic additions, each invocation to a separate word.
    pub atomics: f64,
    /// Atomic additions of 64 invocations to one word.
    pub atomics_to_one: f64,
    /// A dispatch without dependencies.
    pub dispatch_alone: f64,
    /// A dispatch with a barrier before it.
    pub dispatch: f64,
    /// An indirect dispatch without dependencies.
    pub indirect: f64,
    /// An indirect dispatch whose size the previous dispatch wrote.
    pub indirect_after: f64,
    /// From a submit to the end of a blocking wait, median.
    pub submit_wait: f64,
    /// From a submit to a poll that sees its completion, median.
    pub submit_poll: f64,
    /// Bytes that a host thread writes into mapped device memory.
    pub host_bytes: f64,
}

impl Ceilings {
    /// Formats one row per rate.
    pub fn to_text(self) -> String {
        let g = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{:.2}", value / 1e9));
        let us = |value: f64| format!("{:.2}", value * 1e6);
        let rows = [
            ("multiplications and additions, G/s", g(Some(self.operations))),
            ("exp2, G/s", g(Some(self.exp2))),
            ("divisions, G/s", g(Some(self.divisions))),
            ("copy, read and written, GB/s", g(Some(self.bytes))),
            ("shuffles of an invocation, G/s", g(self.shuffles)),
            ("ballots of an invocation, G/s", g(self.ballots)),
            ("shared memory, loads of 16 B, GB/s", g(Some(self.shared_bytes))),
            ("atomics, a word each, G/s", g(Some(self.atomics))),
            ("atomics, 64 to a word, G/s", g(Some(self.atomics_to_one))),
            ("dispatch, us", us(self.dispatch_alone)),
            ("dispatch after a barrier, us", us(self.dispatch)),
            ("indirect dispatch, us", us(self.indirect)),
            ("indirect dispatch after its size, us", us(self.indirect_after)),
            ("submit to wait, blocking, us", us(self.submit_wait)),
            ("submit to wait, polling, us", us(self.submit_poll)),
            ("host into mapped memory, GB/s", g(Some(self.host_bytes))),
        ];
        table(&rows.map(|(name, value)| vec![name.to_owned(), value]))
    }
}

/// The buffers, with the given numbers of vec4.
fn buffers(vecs: u32, host_vecs: u32) -> &'static Table {
    let row = |name, element_bytes, elements, class| BufferDecl {
        name,
        element_bytes,
        domain: Domain::fixed(elements),
        class,
        texel: (element_bytes == 16).then_some(TexelFormat::Rgba32Sfloat),
        doc: "A benchmark's.",
    };
    let rows = [
        row("from", 16, vecs, Class::Persistent),
        row("to", 16, vecs, Class::Persistent),
        row("grid", 4, 64, Class::Persistent),
        row("host", 16, host_vecs, Class::PerFrame),
    ];
    Box::leak(Box::new(Table { rows: Box::leak(Box::new(rows)), cure: || "use another device".to_owned() }))
}

/// Measures the rates; `texel` selects the engine's reading method on this device.
pub fn measure(gpu: &Arc<Gpu>, texel: bool, small: bool) -> Result<Ceilings> {
    // Workgroups of 64: enough to fill a GPU, and few where invocations run one after another.
    let groups = if small {
        2
    } else if gpu.is_cpu() {
        64
    } else {
        8192
    };
    let (vecs, host_vecs) = if small { (1 << 12, 1 << 12) } else { (COPY_VECS, HOST_VECS) };
    let table = buffers(vecs, host_vecs);
    let options = SchedulerOptions { timestamps: true, ..SchedulerOptions::default() };
    let mut sched = Scheduler::new(Arc::clone(gpu), table, Vec::new(), options)?;
    let count = f64::from(groups) * 64.0 * 8.0;
    // The difference of two runs removes the constant cost.
    let mut rate = |shader: &'static ShaderDesc, operation: u32, rounds: u32| -> Result<f64> {
        let mut seconds = |rounds: u32| {
            let mut list = PassList::new("rate");
            list.pass(PassDecl::new(shader, vec![TO_BUFFER], Grid::Groups(groups, 1, 1)).spec(vec![operation, rounds]));
            least(&mut sched, &list)
        };
        let net = seconds(rounds)? - seconds(1)?;
        Ok(count * f64::from(rounds - 1) / net.max(1e-9))
    };
    let rates = shader("rates", include_str!("rates.comp"), &[])?;
    let subgroup = &gpu.capabilities().subgroup;
    let [shuffles, ballots] = if subgroup.is_emulated || !subgroup.has_ballots() {
        [None, None]
    } else {
        let shader = shader("subgroup", include_str!("subgroup.comp"), &[])?;
        [Some(rate(shader, 0, ROUNDS_PER_INVOCATION / 4)?), Some(rate(shader, 1, ROUNDS_PER_INVOCATION / 4)?)]
    };
    let operations = 2.0 * rate(rates, 0, ROUNDS_PER_INVOCATION)?;
    let (exp2, divisions) = (rate(rates, 1, ROUNDS_PER_INVOCATION / 4)?, rate(rates, 2, ROUNDS_PER_INVOCATION / 4)?);
    let shared_bytes = 16.0 * rate(rates, 3, ROUNDS_PER_INVOCATION / 4)?;
    let (atomics, atomics_to_one) =
        (rate(rates, 4, ROUNDS_PER_INVOCATION / 16)?, rate(rates, 5, ROUNDS_PER_INVOCATION / 64)?);
    let copy = shader("copy", include_str!("copy.comp"), &texel_define(texel))?;
    let mut list = PassList::new("copy");
    list.pass(PassDecl::new(copy, vec![FROM_BUFFER, TO_BUFFER], Grid::Groups(vecs / 64, 1, 1)));
    let bytes = 32.0 * f64::from(vecs) / least(&mut sched, &list)?;
    drop(sched);
    // Use the host's clock: a timestamp after each dispatch costs more than the dispatch.
    let mut sched = Scheduler::new(Arc::clone(gpu), table, Vec::new(), SchedulerOptions::default())?;
    sched.upload(GRID_BUFFER, 0, 0, &[1_u32; 64])?;
    let writes = shader("dispatch", include_str!("dispatch.comp"), &[])?;
    let empty = shader("empty", include_str!("dispatch.comp"), &[("EMPTY".to_owned(), None)])?;
    let (one, indirect) = (Grid::Groups(1, 1, 1), Grid::Indirect(GRID_BUFFER, 0));
    let mut dispatch = |shader: &'static ShaderDesc, buffers: Vec<Buf>, grid: Grid| -> Result<f64> {
        let mut seconds = |count: u32| -> Result<f64> {
            let mut list = PassList::new("dispatches");
            for _ in 0..count {
                list.pass(PassDecl::new(shader, buffers.clone(), grid));
            }
            let id = sched.prepare(&list)?;
            let times = (0..=REPETITION_COUNT).map(|_| {
                let start = Instant::now();
                sched.run(id, 0).map(|()| start.elapsed().as_secs_f64())
            });
            let times = times.collect::<Result<Vec<f64>>>()?;
            Ok(times[1..].iter().copied().fold(f64::INFINITY, f64::min))
        };
        Ok((seconds(DISPATCH_COUNT)? - seconds(1)?).max(0.0) / f64::from(DISPATCH_COUNT - 1))
    };
    let dispatch_alone = dispatch(empty, Vec::new(), one)?;
    let dispatch_after = dispatch(writes, vec![TO_BUFFER], one)?;
    let indirect_alone = dispatch(empty, Vec::new(), indirect)?;
    let indirect_after = dispatch(writes, vec![GRID_BUFFER], indirect)?;
    let [submit_wait, submit_poll] = [false, true].map(|polls| latency(&mut sched, empty, polls));
    Ok(Ceilings {
        operations,
        exp2,
        divisions,
        bytes,
        shuffles,
        ballots,
        shared_bytes,
        atomics,
        atomics_to_one,
        dispatch_alone,
        dispatch: dispatch_after,
        indirect: indirect_alone,
        indirect_after,
        submit_wait: submit_wait?,
        submit_poll: submit_poll?,
        host_bytes: host(&mut sched, host_vecs)?,
    })
}

/// Returns the shortest of several runs of a list, seconds, without the first, in which drivers compile.
fn least(sched: &mut Scheduler, list: &PassList) -> Result<f64> {
    let id = sched.prepare(list)?;
    let mut shortest = f64::INFINITY;
    for repetition in 0..=REPETITION_COUNT {
        sched.run(id, 0)?;
        let seconds: f64 = sched.timings(id, 0)?.iter().map(|(_, ns)| *ns as f64 * 1e-9).sum();
        if repetition > 0 {
            shortest = shortest.min(seconds);
        }
    }
    Ok(shortest)
}

/// Returns the median seconds from a dispatch's submit until the host knows that it is complete.
fn latency(sched: &mut Scheduler, empty: &'static ShaderDesc, polls: bool) -> Result<f64> {
    let mut list = PassList::new("one dispatch");
    list.pass(PassDecl::new(empty, Vec::new(), Grid::Groups(1, 1, 1)));
    let id = sched.prepare(&list)?;
    let times = (0..SUBMIT_COUNT).map(|_| {
        let start = Instant::now();
        let ticket = sched.submit(id, 0)?;
        while polls && !sched.is_done(ticket)? {
            std::hint::spin_loop();
        }
        sched.wait(ticket)?;
        Ok(start.elapsed().as_secs_f64())
    });
    Ok(median(times.collect::<Result<Vec<f64>>>()?))
}

/// Returns the bytes per second that the host writes.
fn host(sched: &mut Scheduler, vecs: u32) -> Result<f64> {
    let data = vec![[1.0_f32; 4]; vecs as usize];
    let mut shortest = f64::INFINITY;
    for _ in 0..=REPETITION_COUNT {
        let start = Instant::now();
        sched.upload(HOST_BUFFER, 0, 0, &data)?;
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    Ok(16.0 * f64::from(vecs) / shortest)
}
