//! Faults on purpose, so that every failure can be tested: the environment variable `LABELGS_FAULT=SITE:N:KIND` makes the
//! N-th event of a site fail, once.
//!
//! | site | events | kinds |
//! | --- | --- | --- |
//! | a Vulkan call, such as `vkQueueSubmit` | its calls | `DEVICE_LOST`, `HOST_MEMORY`, `DEVICE_MEMORY`, `INITIALIZATION` |
//! | `vulkan` | all Vulkan calls that can fail | the same |
//! | `write` | what is done to write files: making, writing, syncing, renaming | `NO_SPACE`, `IO` |
//! | `nan` | steps of a training | `NUMBER`: a Gaussian gets a position that is none |

use std::io;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// What a fault does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The device is lost.
    DeviceLost,
    /// The host has no memory.
    HostMemory,
    /// The device has no memory.
    DeviceMemory,
    /// The driver cannot start.
    Initialization,
    /// The disk is full.
    NoSpace,
    /// The disk fails.
    Io,
    /// A number is none.
    Number,
}

struct Fault {
    site: String,
    after: AtomicU64,
    kind: Kind,
}

/// The fault that this event of a site meets, if one was asked for.
pub fn at(site: &str) -> Option<Kind> {
    static FAULT: OnceLock<Option<Fault>> = OnceLock::new();
    let fault = FAULT.get_or_init(|| parse(&std::env::var("LABELGS_FAULT").ok()?)).as_ref()?;
    let hit = fault.site == site && fault.after.fetch_sub(1, Ordering::Relaxed) == 1;
    hit.then_some(fault.kind)
}

/// The fault of a step of writing a file.
pub fn writing() -> io::Result<()> {
    match at("write") {
        Some(Kind::NoSpace) => Err(io::ErrorKind::StorageFull.into()),
        Some(_) => Err(io::Error::other("a fault on purpose")),
        None => Ok(()),
    }
}

fn parse(text: &str) -> Option<Fault> {
    let mut parts = text.split(':');
    let (site, after, kind) = (parts.next()?, parts.next()?.parse().ok()?, parts.next()?);
    let kind = match kind {
        "DEVICE_LOST" => Kind::DeviceLost,
        "HOST_MEMORY" => Kind::HostMemory,
        "DEVICE_MEMORY" => Kind::DeviceMemory,
        "INITIALIZATION" => Kind::Initialization,
        "NO_SPACE" => Kind::NoSpace,
        "IO" => Kind::Io,
        "NUMBER" => Kind::Number,
        _ => return None,
    };
    Some(Fault { site: site.to_owned(), after: AtomicU64::new(after), kind })
}
