//! Compiles the kernels of later steps while the first steps run.

use crate::gpu::Gpu;
use crate::scheduler::plan::PassList;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// A background thread that compiles kernels until it is dropped.
#[derive(Debug)]
pub(super) struct KernelCompiler {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl KernelCompiler {
    /// Starts to compile the kernels of these lists, in order. Failures are ignored here: the list that needs the
    /// kernel reports them.
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
        // If no thread can be started, lists compile their kernels on first use.
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
