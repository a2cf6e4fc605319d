//! Inputs of shaders (texels, constants, subgroups) and messages of the validation layer.

use super::*;
use crate::support::device::options as gpu_options;
use labelgs::cli::support::exit_status::exit_status;
use labelgs::gpu::{Gpu, GpuOptions};

toy_shader!(
    fetch,
    [],
    [("words", R, T, 0), ("planes", R, T, 0), ("floats", R, T, 0), ("to", W, S, 4)],
    "#extension GL_EXT_samplerless_texture_functions : require
    layout(local_size_x = 64) in;
    layout(set=0, binding=0) uniform utextureBuffer words;
    layout(set=0, binding=1) uniform textureBuffer planes;
    layout(set=0, binding=2) uniform textureBuffer floats;
    layout(std430, set=0, binding=3) writeonly buffer to_block { uint to[]; };
    void main() {
        int i = int(gl_GlobalInvocationID.x);
        vec4 plane = texelFetch(planes, i);
        float number = texelFetch(floats, i).x;
        to[i] = texelFetch(words, i).x + uint(plane.x + 10.0 * plane.w) + 1000u * uint(number + 0.5);
    }"
);

toy_shader!(
    twice,
    [],
    [("texels", R, T, 0), ("words", W, S, 4)],
    "#extension GL_EXT_samplerless_texture_functions : require
    layout(local_size_x = 64) in;
    layout(set=0, binding=0) uniform utextureBuffer texels;
    layout(std430, set=0, binding=1) writeonly buffer words_block { uint words[]; };
    void main() { uint i = gl_GlobalInvocationID.x; words[i] = 3 * texelFetch(texels, int(i)).x; }"
);

toy_shader!(
    subgroups,
    [("WIDTH", 7, 32)],
    [("to", W, S, 4)],
    "layout(local_size_x_id = 7) in;
    layout(std430, set=0, binding=0) writeonly buffer to_block { uint to[]; };
    void main() { to[gl_GlobalInvocationID.x] = gl_SubgroupSize * 1000 + gl_SubgroupInvocationID; }"
);

toy_shader!(
    undeclared_pushes,
    [],
    [("to", W, S, 4)],
    "layout(local_size_x = 1) in;
    layout(push_constant) uniform Push { uint index[32]; };
    layout(std430, set=0, binding=0) writeonly buffer to_block { uint to[]; };
    void main() { to[0] = index[31]; }"
);

#[test]
fn buffers_can_be_read_as_texels() {
    let Some(gpu) = device() else { return };
    let capacity = counts(128, 128);
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, capacity, SchedulerOptions::default()).unwrap();
    let mut list = PassList::new("texels");
    // A scratch buffer with an offset in its page.
    list.fill(A, 1).copy(MODEL, B, 0);
    list.pass(PassDecl::new(fetch(), vec![B, PLANES, FLOATS, C], Grid::Groups(2, 1, 1)));
    list.pass(PassDecl::new(twice(), vec![C, C], Grid::Groups(2, 1, 1)));
    list.copy(C, REPORT, 0).copy(A, MODEL, 4);
    let id = scheduler.prepare(&list).unwrap();
    assert!(scheduler.plan(id).unwrap().placement(B).unwrap().offset > 0);
    scheduler.upload(MODEL, 0, 0, &(0..128).collect::<Vec<u32>>()).unwrap();
    scheduler.upload(PLANES, 0, 0, &(0..128).map(|i| [i as f32, 0.0, 0.0, 7.0]).collect::<Vec<_>>()).unwrap();
    scheduler.upload(FLOATS, 1, 0, &(0..128).map(|i| i as f32).collect::<Vec<_>>()).unwrap();
    scheduler.run(id, 1).unwrap();
    let expected = (0..128).map(|i| 3 * (i + (i + 70) + 1000 * i)).collect::<Vec<u32>>();
    assert_eq!(scheduler.download_all::<u32>(REPORT, 1).unwrap(), expected);
}

#[test]
fn subgroups_have_the_pinned_size() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(256), SchedulerOptions::default()).unwrap();
    let mut list = PassList::new("subgroups");
    list.pass(PassDecl::new(subgroups(), vec![REPORT], Grid::Groups(4, 1, 1)).spec(vec![64]));
    let id = scheduler.prepare(&list).unwrap();
    scheduler.run(id, 0).unwrap();
    let size = gpu.subgroup_size();
    let expected = (0..256).map(|i| size * 1000 + i % size).collect::<Vec<_>>();
    assert_eq!(scheduler.download_all::<u32>(REPORT, 0).unwrap(), expected);
}

#[test]
fn workgroups_that_the_device_does_not_take_are_refused() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(256), SchedulerOptions::default()).unwrap();
    let mut list = PassList::new("too wide");
    list.pass(PassDecl::new(subgroups(), vec![REPORT], Grid::Groups(1, 1, 1)).spec(vec![1 << 20]));
    let message = scheduler.prepare(&list).expect_err("the workgroup is too large").to_string();
    assert!(message.contains("[1048576, 1, 1]"), "{message}");
}

#[test]
fn devices_are_chosen_by_name_index_and_uuid() {
    let Some(gpu) = device() else { return };
    let found = gpu.capabilities().clone();
    drop(gpu);
    let open = |device: &str| Gpu::new(&GpuOptions { device: Some(device.to_owned()), ..GpuOptions::default() });
    let uuid = found.uuid_text();
    let dashed = [&uuid[..8], &uuid[8..12], &uuid[12..16], &uuid[16..20], &uuid[20..]].join("-");
    let of_tools = format!("GPU-{}", dashed.to_uppercase());
    for wanted in [found.index.to_string(), uuid, dashed, of_tools, found.name.to_uppercase()] {
        assert_eq!(open(&wanted).unwrap().capabilities().name, found.name, "{wanted}");
    }
    let error = open("no such device").unwrap_err();
    assert!(error.to_string().contains(&found.name), "{error}");
    assert_eq!(exit_status(&error), 4);
    let odd = GpuOptions { subgroup_size: Some(3), ..GpuOptions::default() };
    assert_eq!(exit_status(&Gpu::new(&odd).unwrap_err()), 2);
    let (devices, picked) = labelgs::gpu::devices(&GpuOptions::default()).unwrap();
    assert!(picked.is_ok_and(|index| devices[index].missing().is_empty()));
    let listed = devices.iter().find(|device| device.uuid == found.uuid).unwrap();
    assert_eq!(listed.needs, found.needs);
}

/// Negative control of all other tests: messages of the layer arrive.
#[test]
fn messages_of_the_validation_layer_are_recorded() {
    let Some(mut gpu) = device() else { return };
    if !gpu.is_validated() {
        eprintln!("skipped: the validation layer is not installed or off");
        return;
    }
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(256), SchedulerOptions::default()).unwrap();
    let mut list = PassList::new("wrong");
    list.pass(PassDecl::new(undeclared_pushes(), vec![REPORT], Grid::Groups(1, 1, 1)));
    let _ = scheduler.prepare(&list);
    let messages = gpu.messages();
    assert!(messages.iter().any(|message| message.is_error && message.id.starts_with("VUID")), "{messages:?}");
    gpu.forgive();
}

#[test]
fn nothing_is_left_when_the_device_is_dropped() {
    // The shared device would be idle meanwhile, but has nothing to do with this one.
    let Some(turn) = device() else { return };
    let gpu = Gpu::new(&gpu_options()).unwrap();
    let log = gpu.message_log();
    let mut scheduler = Scheduler::new(gpu, TABLE, pixels(256), SchedulerOptions::default()).unwrap();
    let mut list = PassList::new("toy");
    list.fill(A, 5).pass(scaled(A, B, 3, 1, 256)).copy(B, REPORT, 0);
    let id = scheduler.prepare(&list).unwrap();
    scheduler.submit(id, 0).unwrap();
    drop(scheduler);
    assert_eq!(log.messages(), vec![]);
    drop(turn);
}

#[test]
fn the_lists_of_the_engine_can_be_prepared() {
    let Some(gpu) = device() else { return };
    for texel in [false, true] {
        let shape = labelgs::pass::KernelShape::for_device(gpu.capabilities());
        let (capacity, lists) = crate::scheduler::plan::engine_lists(labelgs::pass::KernelShape { texel, ..shape });
        let with = SchedulerOptions { timestamps: true, poison_step: true, ..SchedulerOptions::default() };
        let mut scheduler = Scheduler::new(gpu.gpu(), labelgs::pass::buffers::TABLE, capacity.counts(), with).unwrap();
        let ids = scheduler.prepare_all(&lists.iter().collect::<Vec<_>>()).unwrap();
        assert_eq!(ids.len(), lists.len());
    }
}
