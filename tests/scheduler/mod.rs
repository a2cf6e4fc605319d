//! The scheduler on a real device, with toy passes.

mod controls;
mod faults;
mod loads;
mod memory;
mod plan;
mod random;
mod replay;
mod shaders;

use crate::support::{device, toy};
use labelgs::pass::buffers::Capacity;
use labelgs::scheduler::plan::{Buf, Grid, PassDecl, PassList, PlanOptions};
use labelgs::scheduler::{Scheduler, SchedulerOptions};
use labelgs::shaders::{Access, BindingKind, ShaderDesc};

/// Buffers of the toy passes.
mod table {
    use labelgs::scheduler::plan::{Buf, BufferDecl, Class, Domain, Table, TexelFormat};
    labelgs::buffers! { || "lower something".to_owned(); consts;
        MODEL "model": 4, Domain::GAUSSIANS, Class::Model, Some(TexelFormat::R32Uint), "Kept.";
        PLANES "planes": 16, Domain::GAUSSIANS, Class::Model, Some(TexelFormat::Rgba32Sfloat), "Kept vectors.";
        TOTALS "totals": 4, Domain::fixed(16), Class::Persistent, None, "Kept, zeroed when allocated.";
        UNIFORMS "uniforms": 4, Domain::fixed(4), Class::PerFrame, None, "From the host.";
        FLOATS "floats": 4, Domain::PIXELS, Class::PerFrame, Some(TexelFormat::R32Sfloat), "From the host, as floats.";
        REPORT "report": 4, Domain::PIXELS, Class::Report, None, "To the host.";
        A "a": 4, Domain::PIXELS, Class::Step, Some(TexelFormat::R32Uint), "Scratch.";
        B "b": 4, Domain::PIXELS, Class::Step, Some(TexelFormat::R32Uint), "Scratch.";
        C "c": 4, Domain::PIXELS, Class::Step, Some(TexelFormat::R32Uint), "Scratch.";
        D "d": 4, Domain::PIXELS, Class::Step, Some(TexelFormat::R32Uint), "Scratch.";
        E "e": 4, Domain::PIXELS, Class::Step, Some(TexelFormat::R32Uint), "Scratch.";
        F "f": 4, Domain::PIXELS, Class::Step, Some(TexelFormat::R32Uint), "Scratch.";
        ARGUMENTS "arguments": 4, Domain::fixed(8), Class::Step, None, "Indirect arguments.";
    }
}
use table::*;

pub(crate) const R: Access = Access::Read;
pub(crate) const W: Access = Access::Write;
pub(crate) const RW: Access = Access::ReadWrite;
pub(crate) const S: BindingKind = BindingKind::Storage;
const T: BindingKind = BindingKind::Texel;

/// Declares a function that compiles a shader once: specialisation constants, bindings, GLSL.
macro_rules! toy_shader {
    ($name:ident, $spec:expr, $bindings:expr, $glsl:expr) => {
        pub(crate) fn $name() -> &'static ShaderDesc {
            static SHADER: std::sync::OnceLock<&'static ShaderDesc> = std::sync::OnceLock::new();
            SHADER.get_or_init(|| toy::finish(toy::shader(stringify!($name), $glsl, &$bindings), &$spec))
        }
    };
}
pub(crate) use toy_shader;

toy_shader!(
    scale,
    [("WIDTH", 0, 64), ("FACTOR", 1, 1), ("TERM", 2, 0), ("COUNT", 3, 0)],
    [("from", R, S, 4), ("to", W, S, 4)],
    "layout(local_size_x_id = 0) in;
    layout(constant_id = 1) const uint FACTOR = 1;
    layout(constant_id = 2) const uint TERM = 0;
    layout(constant_id = 3) const uint COUNT = 0;
    layout(std430, set=0, binding=0) readonly buffer from_block { uint from[]; };
    layout(std430, set=0, binding=1) writeonly buffer to_block { uint to[]; };
    void main() { uint i = gl_GlobalInvocationID.x; if (i < COUNT) to[i] = from[i] * FACTOR + TERM; }"
);

trait DownloadAll {
    /// Reads all of a buffer.
    fn download_all<T: bytemuck::Pod>(&mut self, buf: Buf, frame: usize) -> labelgs::Result<Vec<T>>;
}

impl DownloadAll for Scheduler {
    fn download_all<T: bytemuck::Pod>(&mut self, buf: Buf, frame: usize) -> labelgs::Result<Vec<T>> {
        let count = self.bytes(buf)? as usize / size_of::<T>();
        self.download(buf, frame, 0, count)
    }
}

fn pixels(count: u64) -> Vec<u64> {
    counts(100, count)
}

/// Counts of Gaussians and pixels.
fn counts(gaussians: u64, pixels: u64) -> Vec<u64> {
    Capacity { gaussians, pixels, ..Capacity::default() }.counts()
}

/// `to[i] = from[i] * factor + term`.
fn scaled(from: Buf, to: Buf, factor: u32, term: u32, count: u32) -> PassDecl {
    PassDecl::new(scale(), vec![from, to], Grid::Groups(count.div_ceil(64), 1, 1)).spec(vec![64, factor, term, count])
}

fn options(plan: PlanOptions) -> SchedulerOptions {
    SchedulerOptions { plan, ..SchedulerOptions::default() }
}

#[test]
fn fill_dispatch_and_copy_run_in_order() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(1000), SchedulerOptions::default()).unwrap();
    let mut list = PassList::new("toy");
    list.fill(A, 5);
    list.pass(scaled(A, B, 3, 1, 1000));
    list.pass(scaled(B, C, 2, 0, 1000));
    list.copy(C, REPORT, 0);
    let id = scheduler.prepare(&list).unwrap();
    let ticket = scheduler.submit(id, 1).unwrap();
    scheduler.wait(ticket).unwrap();
    assert!(scheduler.is_done(ticket).unwrap());
    assert_eq!(scheduler.download_all::<u32>(REPORT, 1).unwrap(), vec![32; 1000]);
    assert_eq!(scheduler.download_all::<u32>(REPORT, 0).unwrap(), vec![0; 1000], "the other frame is untouched");
}

#[test]
fn timestamps_tell_the_time_of_each_item() {
    let Some(gpu) = device() else { return };
    let serial = PlanOptions { barrier_everywhere: true, ..PlanOptions::default() };
    let with = SchedulerOptions { timestamps: true, ..options(serial) };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(100_000), with).unwrap();
    let mut list = PassList::new("timed");
    list.fill(A, 5);
    list.pass(scaled(A, B, 3, 1, 100_000).label("three times"));
    let id = scheduler.prepare(&list).unwrap();
    assert_eq!(scheduler.timings(id, 0).unwrap(), vec![], "nothing ran yet");
    scheduler.run(id, 0).unwrap();
    scheduler.run(id, 0).unwrap();
    let times = scheduler.timings(id, 0).unwrap();
    let names = times.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>();
    assert_eq!(names, ["fill a", "three times"]);
    if gpu.limits().timestamp_bits > 0 {
        assert!(times.iter().all(|(_, ns)| (1..10_000_000_000).contains(ns)), "{times:?}");
    }
}

#[test]
fn wrong_use_is_an_error_that_says_so() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(64), SchedulerOptions::default()).unwrap();
    let mut list = PassList::new("toy");
    list.fill(A, 5).pass(scaled(A, B, 1, 0, 64)).copy(B, REPORT, 0);
    let id = scheduler.prepare(&list).unwrap();
    let failures = [
        (scheduler.submit(id, 2).map(|_| ()), "frame 2 of 2"),
        (scheduler.upload(MODEL, 0, 99, &[1_u32, 2]), "model"),
        (scheduler.upload(A, 0, 0, &[1_u32]), "without aliasing"),
        (scheduler.download::<u32>(C, 0, 0, 1).map(|_| ()), "does not touch buffer c"),
        (scheduler.download::<u16>(A, 0, 0, 1).map(|_| ()), "not a range of words"),
        (scheduler.upload(Buf(99), 0, 0, &[1_u32]), "no buffer 99"),
        (scheduler.check_guards(), "has no guards"),
    ];
    for (result, expected) in failures {
        let message = result.expect_err(expected).to_string();
        assert!(message.contains(expected), "{message}");
    }
    scheduler.set_counts(pixels(128)).unwrap();
    let message = scheduler.submit(id, 0).expect_err("the list is forgotten").to_string();
    assert!(message.contains("prepare it again"), "{message}");
}
