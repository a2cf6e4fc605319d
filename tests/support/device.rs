//! The devices of the test process.
//!
//! A test has a turn with a device that no other test uses meanwhile: `device()` waits until one is free and keeps it
//! until its result is dropped. There is a device for each of the first cores, because small work on a software device
//! does not fill several, and each message of the validation layer belongs to one test. The end of the turn fails the
//! test if the layer reported anything, leaks included.
//!
//! Without a device, tests that call `device()` return early with a message on stderr; with `LABELGS_REQUIRE_VULKAN=1`
//! they fail instead. `LABELGS_DEVICE` chooses a device, `LABELGS_VALIDATION` (`off`, `on`, `sync`, `gpu`; default
//! `sync`) what the layer checks, if it is installed. `LABELGS_REQUIRE_VALIDATION=1` requires it.

use labelgs::gpu::{Gpu, GpuOptions, MessageLog, Validation};
use std::ops::Deref;
use std::sync::{Arc, Condvar, LazyLock, Mutex, PoisonError};

/// Devices at most, which bounds the memory of a test run on many cores.
const DEVICES_MAX: usize = 4;

/// Turns that are free.
static FREE: LazyLock<Mutex<usize>> = LazyLock::new(|| {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    Mutex::new(cores.min(DEVICES_MAX))
});

static FREED: Condvar = Condvar::new();

/// A place among the tests that use a device.
struct Place;

impl Place {
    fn wait() -> Self {
        let free = FREE.lock().unwrap_or_else(PoisonError::into_inner);
        let mut free = FREED.wait_while(free, |free| *free == 0).unwrap_or_else(PoisonError::into_inner);
        *free -= 1;
        Self
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        *FREE.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        FREED.notify_one();
    }
}

/// A test's turn with a device.
pub struct Turn {
    /// Some until the turn ends.
    gpu: Option<Arc<Gpu>>,
    log: MessageLog,
    forgiven: usize,
    _place: Place,
}

impl Turn {
    fn at(place: Place, gpu: Arc<Gpu>) -> Self {
        Self { log: gpu.message_log(), gpu: Some(gpu), forgiven: 0, _place: place }
    }

    /// A turn with a device that the caller opened.
    #[allow(dead_code)]
    pub fn with(gpu: Arc<Gpu>) -> Self {
        Self::at(Place::wait(), gpu)
    }

    /// The device, to make a scheduler with.
    pub fn gpu(&self) -> Arc<Gpu> {
        Arc::clone(self)
    }

    /// Takes the messages that a test expects.
    #[allow(dead_code)]
    pub fn forgive(&mut self) {
        self.forgiven = self.log.messages().len();
    }
}

impl Deref for Turn {
    type Target = Arc<Gpu>;

    fn deref(&self) -> &Arc<Gpu> {
        self.gpu.as_ref().expect("the turn lasts")
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        // Destroying the device tells its leaks.
        self.gpu = None;
        let messages = self.log.messages();
        let new = &messages[self.forgiven.min(messages.len())..];
        if !new.is_empty() && !std::thread::panicking() {
            panic!("the validation layer has {} messages: {new:#?}", new.len());
        }
    }
}

/// Returns this test's turn with a device, or `None` and a message if there is no device. The device is opened for the
/// turn.
pub fn device() -> Option<Turn> {
    let place = Place::wait();
    Some(Turn::at(place, open()?))
}

/// The options of a test's device.
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
