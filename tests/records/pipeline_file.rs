//! Compiled pipelines between runs.

use crate::support::device;
use crate::support::device::options;
use labelgs::gpu::{Gpu, GpuOptions, PipelineStore};
use labelgs::pass::KernelShape;
use labelgs::records::PipelineFolder;
use std::sync::Arc;

#[test]
fn a_damaged_cache_is_not_given_to_the_driver() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = PipelineFolder::new(folder.path().join("new"));
    assert!(store.load("gpu").is_empty(), "nothing was saved");
    let data: Vec<u8> = (0..=255).collect();
    store.save("gpu", &data);
    assert_eq!(store.load("gpu"), data);
    assert!(store.load("another").is_empty(), "each device has its own");
    let path = folder.path().join("new/pipelines-gpu.bin");
    let whole = std::fs::read(&path).expect("a file");
    for damaged in [&whole[..whole.len() - 1], &whole[..10], &[], &[whole.as_slice(), b"x"].concat()[..]] {
        std::fs::write(&path, damaged).expect("written");
        assert!(store.load("gpu").is_empty(), "{} of {} bytes", damaged.len(), whole.len());
    }
    for at in 0..whole.len() {
        let mut flipped = whole.clone();
        flipped[at] ^= 0x10;
        std::fs::write(&path, &flipped).expect("written");
        assert!(store.load("gpu").is_empty(), "byte {at}");
    }
    // A file in place of the folder is a warning only.
    std::fs::write(folder.path().join("file"), b"").expect("written");
    PipelineFolder::new(folder.path().join("file")).save("gpu", &data);
}

#[test]
fn a_device_saves_what_it_compiled_and_takes_it_back() {
    let Some(_turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let store: Arc<dyn PipelineStore> = Arc::new(PipelineFolder::new(folder.path()));
    let with = || GpuOptions { pipelines: Some(Arc::clone(&store)), ..options() };
    let use_it = || {
        let gpu = Gpu::new(&with()).expect("a device");
        let shape = KernelShape::for_device(gpu.capabilities());
        let device = gpu.capabilities().uuid_text();
        let messages = gpu.message_log();
        let room = labelgs::engine::EngineSize::new(10, (16, 16));
        let mut engine = labelgs::engine::Engine::with_shape(gpu, shape, room, Default::default()).expect("an engine");
        engine.list(labelgs::engine::run::ListKey::Render { sh_degree: 0, label_rounds: 0 }).expect("pipelines");
        drop(engine);
        assert!(messages.messages().is_empty(), "{:?}", messages.messages());
        device
    };
    let device = use_it();
    let first = store.load(&device);
    // At least a header: drivers without a cache return only that.
    assert!(first.len() >= 16, "{} bytes", first.len());
    use_it();
    assert!(store.load(&device).len() >= 16);
    // A cache of another driver is refused by its header.
    let mut foreign = first.clone();
    foreign[8..12].copy_from_slice(&[0xff; 4]);
    store.save(&device, &foreign);
    use_it();
}
