//! Peak rates of the device, measured with kernels that do one thing.

use crate::compiler::shader;
use labelgs::Result;
use labelgs::gpu::Gpu;
use labelgs::scheduler::plan::{Buf, BufferDecl, Class, Domain, Grid, PassDecl, PassList, Table, TexelFormat};
use labelgs::scheduler::{Scheduler, SchedulerOptions};
use serde::Serialize;
use std::sync::Arc;

/// vec4 of the buffer that is copied, nearly 64 MiB: as many workgroups as a dispatch has at most.
const VECS: u32 = 65_535 * 64;
/// Workgroups of 64 and rounds of eight operations each.
const GROUPS: u32 = 1024;
const ROUNDS: u32 = 2048;
/// Dispatches of the list that measures the cost of a dispatch.
const EMPTY: u32 = 64;
const REPETITIONS: usize = 8;

/// Rates of a device.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Ceilings {
    /// Multiplications and additions a second, as the driver compiles `v * a + b`.
    pub operations: f64,
    /// `exp2` a second.
    pub exp2: f64,
    /// Divisions a second.
    pub divisions: f64,
    /// Bytes read and written a second.
    pub bytes: f64,
    /// Seconds that a dispatch takes by itself, with the barrier before it.
    pub dispatch: f64,
}

/// The operation that the arithmetic kernel repeats.
#[derive(Clone, Copy)]
enum Operation {
    MultiplyAdd = 0,
    Exp2 = 1,
    Divide = 2,
}

/// Measures the rates; `texel` selects the engine's way of reading on this device.
pub fn measure(gpu: &Arc<Gpu>, texel: bool, small: bool) -> Result<Ceilings> {
    let (groups, vecs) = if small { (2, 1 << 12) } else { (GROUPS, VECS) };
    let row = |name, elements| BufferDecl {
        name,
        element_bytes: 16,
        domain: Domain::fixed(elements),
        class: Class::Persistent,
        texel: Some(TexelFormat::Rgba32Sfloat),
        doc: "A benchmark's.",
    };
    let rows = Box::leak(Box::new([row("from", vecs), row("to", vecs)]));
    let table = Box::leak(Box::new(Table { rows, cure: || "use another device".to_owned() }));
    let (from, to) = (Buf(0), Buf(1));
    let options = SchedulerOptions { timestamps: true, ..SchedulerOptions::default() };
    let mut sched = Scheduler::new(Arc::clone(gpu), table, Vec::new(), options)?;
    let arithmetic = shader("arithmetic", include_str!("arithmetic.comp"), texel)?;
    let mut seconds = |operation: Operation, rounds: u32| {
        let mut list = PassList::new("arithmetic");
        list.pass(PassDecl::new(arithmetic, vec![to], Grid::Groups(groups, 1, 1)).spec(vec![operation as u32, rounds]));
        least(&mut sched, &list)
    };
    let count = f64::from(groups) * 64.0 * 8.0;
    // The difference of two runs removes the constant cost.
    let mut rate = |operation, rounds: u32| -> Result<f64> {
        let net = seconds(operation, rounds)? - seconds(operation, 1)?;
        Ok(count * f64::from(rounds - 1) / net.max(1e-9))
    };
    let operations = 2.0 * rate(Operation::MultiplyAdd, ROUNDS)?;
    let (exp2, divisions) = (rate(Operation::Exp2, ROUNDS / 4)?, rate(Operation::Divide, ROUNDS / 4)?);
    let copy = shader("copy", include_str!("copy.comp"), texel)?;
    let mut list = PassList::new("copy");
    list.pass(PassDecl::new(copy, vec![from, to], Grid::Groups(vecs / 64, 1, 1)));
    let bytes = 32.0 * f64::from(vecs) / least(&mut sched, &list)?;
    let mut list = PassList::new("dispatches");
    for _ in 0..EMPTY {
        list.pass(PassDecl::new(arithmetic, vec![to], Grid::Groups(1, 1, 1)).spec(vec![0, 1]));
    }
    let dispatch = least(&mut sched, &list)? / f64::from(EMPTY);
    Ok(Ceilings { operations, exp2, divisions, bytes, dispatch })
}

/// The shortest of several runs of a list, seconds; the first is left out, in which drivers compile.
fn least(sched: &mut Scheduler, list: &PassList) -> Result<f64> {
    let id = sched.prepare(list)?;
    let mut shortest = f64::INFINITY;
    for repetition in 0..=REPETITIONS {
        sched.run(id, 0)?;
        let seconds: f64 = sched.timings(id, 0)?.iter().map(|(_, ns)| *ns as f64 * 1e-9).sum();
        if repetition > 0 {
            shortest = shortest.min(seconds);
        }
    }
    Ok(shortest)
}
