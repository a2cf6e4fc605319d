//! Kernels of later steps, compiled while the first ones run.

use crate::gpu::Gpu;
use crate::scheduler::plan::PassList;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// A thread that compiles kernels, until it is dropped.
#[derive(Debug)]
pub(super) struct KernelCompiler {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl KernelCompiler {
    /// Begins to compile the kernels of these lists, in their order. A failure is that of the list which needs the kernel.
    pub(super) fn new(gpu: &Arc<Gpu>, lists: Vec<PassList>) -> Self {
        let (gpu, is_over) = (Arc::clone(gpu), Arc::new(AtomicBool::new(false)));
        let ends = Arc::clone(&is_over);
        let compile = move || {
            for pass in lists.iter().flat_map(PassList::passes) {
                if ends.load(Ordering::Relaxed) || gpu.pipeline(pass.shader, &pass.spec, &[]).is_err() {
                    return;
                }
            }
        };
        // Without a thread, lists compile their kernels on first use.
        Self { is_over, thread: thread::Builder::new().name("kernels".to_owned()).spawn(compile).ok() }
    }
}

impl Drop for KernelCompiler {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
