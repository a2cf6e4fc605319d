//! The device of the test process.
//!
//! All tests share one device, one test at a time: `device()` holds a lock until its result is dropped. A software
//! device uses all cores by itself, so taking turns costs little, and each message of the validation layer belongs to
//! one test. Dropping the turn fails the test if the layer reported anything.
//!
//! Without a device, tests that call `device()` return early with a message on stderr; with `LABELGS_REQUIRE_VULKAN=1`
//! they fail instead. `LABELGS_DEVICE` chooses a device, `LABELGS_VALIDATION` (`off`, `on`, `sync`, `gpu`; default
//! `sync`) what the layer checks, if it is installed. `LABELGS_REQUIRE_VALIDATION=1` requires it.

use labelgs::gpu::{Gpu, GpuOptions, Validation};
use std::ops::Deref;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

static TURN: Mutex<()> = Mutex::new(());

/// Weak, so that the last user destroys the device and finds its leaks, rather than `exit`.
static DEVICE: Mutex<Weak<Gpu>> = Mutex::new(Weak::new());

/// A test's turn with the device.
pub struct Turn {
    gpu: Arc<Gpu>,
    messages_before: usize,
    _turn: MutexGuard<'static, ()>,
}

impl Turn {
    /// The device, to make a scheduler with.
    pub fn gpu(&self) -> Arc<Gpu> {
        Arc::clone(&self.gpu)
    }

    /// A turn with a device that the caller opened.
    #[allow(dead_code)]
    pub fn with(gpu: Arc<Gpu>) -> Self {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let messages_before = gpu.messages().len();
        Self { gpu, messages_before, _turn: turn }
    }

    /// Takes the messages that a test expects.
    #[allow(dead_code)]
    pub fn forgive(&mut self) {
        self.messages_before = self.gpu.messages().len();
    }
}

impl Deref for Turn {
    type Target = Arc<Gpu>;

    fn deref(&self) -> &Arc<Gpu> {
        &self.gpu
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let messages = self.gpu.messages();
        let new = &messages[self.messages_before.min(messages.len())..];
        if !new.is_empty() && !std::thread::panicking() {
            panic!("the validation layer has {} messages: {new:#?}", new.len());
        }
    }
}

/// Returns this test's turn with the device, or `None` and a message if there is no device.
pub fn device() -> Option<Turn> {
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let mut shared = DEVICE.lock().unwrap_or_else(PoisonError::into_inner);
    let gpu = match shared.upgrade() {
        Some(gpu) => gpu,
        None => {
            let gpu = open()?;
            *shared = Arc::downgrade(&gpu);
            gpu
        }
    };
    let messages_before = gpu.messages().len();
    Some(Turn { gpu, messages_before, _turn: turn })
}

/// The options of the shared device.
pub fn options() -> GpuOptions {
    let mut options = GpuOptions::from_env().expect("the environment variables of the device are right");
    if std::env::var_os("LABELGS_VALIDATION").is_none() {
        options.validation = Validation::Sync;
    }
    options
}

/// Message for a missing validation layer that is required.
pub const NO_LAYER: &str = "LABELGS_REQUIRE_VALIDATION=1 and the validation layer is not there";

/// True if tests that need the validation layer may not be skipped.
pub fn layer_is_required() -> bool {
    std::env::var("LABELGS_REQUIRE_VALIDATION").is_ok_and(|value| value == "1")
}

fn open() -> Option<Arc<Gpu>> {
    match Gpu::new(&options()) {
        Ok(gpu) => {
            let is_asked = options().validation != Validation::Off;
            assert!(gpu.is_validated() || !is_asked || !layer_is_required(), "{NO_LAYER}");
            Some(gpu)
        }
        Err(error) if std::env::var("LABELGS_REQUIRE_VULKAN").is_ok_and(|value| value == "1") => {
            panic!("LABELGS_REQUIRE_VULKAN=1 and {error}")
        }
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}
