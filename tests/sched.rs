//! The scheduler on a real device, with toy passes.

use crate::support::{device, toy};
use labelgs::plan::{Buf, Capacity, Grid, PassDecl, PassList, PlanOptions};
use labelgs::sched::{Scheduler, SchedulerOptions};
use labelgs::shaders::{Access, BindingKind, ShaderDesc};
use std::sync::OnceLock;

mod table {
    use labelgs::plan::{Class, Domain, TexelFormat};
    labelgs::buffers! { consts;
        MODEL "model": 4, Domain::Gaussians, Class::Model, Some(TexelFormat::R32Uint), "Kept.";
        PLANES "planes": 16, Domain::Gaussians, Class::Model, Some(TexelFormat::Rgba32Sfloat), "Kept vectors.";
        TOTALS "totals": 4, Domain::Fixed(16), Class::Kept, None, "Kept, zeroed.";
        A "a": 4, Domain::Pixels, Class::Step, Some(TexelFormat::R32Uint), "Scratch.";
        B "b": 4, Domain::Pixels, Class::Step, None, "Scratch.";
        C "c": 4, Domain::Pixels, Class::Step, None, "Scratch.";
        D "d": 4, Domain::Pixels, Class::Step, None, "Scratch.";
        ARGUMENTS "arguments": 4, Domain::Fixed(8), Class::Step, None, "Indirect arguments.";
        UNIFORMS "uniforms": 4, Domain::Fixed(4), Class::Slot, None, "From the host.";
        REPORT "report": 4, Domain::Pixels, Class::Report, None, "To the host.";
    }
}
use table::*;

const R: Access = Access::Read;
const W: Access = Access::Write;
const RW: Access = Access::ReadWrite;
const S: BindingKind = BindingKind::Storage;

macro_rules! toy {
    ($name:ident, $push:expr, $spec:expr, $bindings:expr, $glsl:expr) => {
        fn $name() -> &'static ShaderDesc {
            static SHADER: OnceLock<&'static ShaderDesc> = OnceLock::new();
            SHADER.get_or_init(|| toy::finish(toy::shader(stringify!($name), $glsl, &$bindings), $push, &$spec))
        }
    };
}

// to[i] = from[i] * FACTOR + push.term
toy!(scale, 8, [("WIDTH", 0, 64), ("FACTOR", 1, 1)], [("from", R, S, 4), ("to", W, S, 4)], "
    layout(local_size_x_id = 0) in;
    layout(constant_id = 1) const uint FACTOR = 1;
    layout(push_constant, scalar) uniform Push { uint term; uint count; };
    layout(scalar, set=0, binding=0) readonly buffer from_block { uint from[]; };
    layout(scalar, set=0, binding=1) writeonly buffer to_block { uint to[]; };
    void main() { uint i = gl_GlobalInvocationID.x; if (i < count) to[i] = from[i] * FACTOR + term; }");

// Slow enough that a missing barrier would show: each element is the sum of a far neighbour's.
toy!(shift, 8, [], [("from", R, S, 4), ("to", W, S, 4)], "
    layout(local_size_x = 64) in;
    layout(push_constant, scalar) uniform Push { uint by; uint count; };
    layout(scalar, set=0, binding=0) readonly buffer from_block { uint from[]; };
    layout(scalar, set=0, binding=1) writeonly buffer to_block { uint to[]; };
    void main() { uint i = gl_GlobalInvocationID.x; if (i < count) to[i] = from[(i + by) % count] + 1; }");

fn pixels(count: u64) -> Capacity {
    Capacity { gaussians: 100, pixels: count, ..Capacity::default() }
}

fn scaled(from: Buf, to: Buf, factor: u32, term: u32, count: u32) -> PassDecl {
    PassDecl::new(scale(), vec![from, to], Grid::Groups(count.div_ceil(64), 1, 1))
        .spec(vec![64, factor])
        .push_pod(&[term, count])
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
    assert_eq!(scheduler.download_all::<u32>(REPORT, 1).unwrap(), vec![32; 1000]);
    assert_eq!(scheduler.download_all::<u32>(REPORT, 0).unwrap(), vec![0; 1000], "the other slot is untouched");
    println!("{}", scheduler.plan(id).unwrap().report());
}
