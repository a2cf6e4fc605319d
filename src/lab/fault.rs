//! Faults on purpose, so that every failure can be tested: in a build with the feature `lab` the environment variable
//! `LABELGS_FAULT=SITE:N:KIND` makes the N-th event of a site fail; with `:COUNT` behind it, so many from there on. Several
//! stand with commas between.
//!
//! | site | events | kinds |
//! | --- | --- | --- |
//! | a Vulkan call, such as `vkQueueSubmit` | its calls | `DEVICE_LOST`, `HOST_MEMORY`, `DEVICE_MEMORY`, `INITIALIZATION` |
//! | `vulkan` | all Vulkan calls that can fail | the same |
//! | `write` | what is done to write files: making, writing, syncing, renaming | `NO_SPACE`, `IO`, `SHORT`, `INTERRUPTED` |
//! | `read` | what is done to read files: opening, reading, listing a folder | `IO`, `SHORT`, `INTERRUPTED` |
//! | `loader` | loading Vulkan | any |
//! | `nan` | steps of a training | `NUMBER`: a Gaussian gets a position that is none |
//! | any | | `SLOW`: the event takes a minute |
//!
//! `SHORT` and `INTERRUPTED` are what every system may do at any time: a part is read or written, or nothing, and the call
//! has to be made again. They may change nothing.

use std::io;
use std::ops::Range;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// What a fault does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
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
    /// One byte is read or written, whatever was asked for.
    Short,
    /// A signal came first.
    Interrupted,
    /// A number is none.
    Number,
    /// Nothing fails, but takes a minute.
    Slow,
}

struct Fault {
    site: String,
    /// Events that are to fail.
    events: Range<u64>,
    /// Events so far.
    seen: AtomicU64,
    kind: Kind,
}

/// The fault that this event of a site meets, if one was asked for.
#[inline(always)]
pub(crate) fn at(site: &str) -> Option<Kind> {
    if super::ON { asked(site) } else { None }
}

fn asked(site: &str) -> Option<Kind> {
    static FAULTS: OnceLock<Vec<Fault>> = OnceLock::new();
    let faults = FAULTS.get_or_init(|| {
        let text = super::var("LABELGS_FAULT").unwrap_or_default();
        let read = |text: &str| {
            let fault = parse(text);
            if fault.is_none() {
                tracing::warn!("LABELGS_FAULT: {text} is not SITE:N:KIND or SITE:N:KIND:COUNT, nothing will fail");
            }
            fault
        };
        text.split(',').filter(|text| !text.is_empty()).filter_map(read).collect()
    });
    // All of them count this event, also those behind one that it meets.
    let met =
        |fault: &&Fault| fault.site == site && fault.events.contains(&(fault.seen.fetch_add(1, Ordering::Relaxed) + 1));
    let kind = faults.iter().filter(met).last()?.kind;
    tracing::warn!("a fault on purpose: {kind:?} at {site}");
    if kind == Kind::Slow {
        std::thread::sleep(Duration::from_secs(60));
        return None;
    }
    Some(kind)
}

/// The fault of a transfer of bytes from or to a file. True if only a part may be transferred.
pub(crate) fn of_transfer(site: &str) -> io::Result<bool> {
    match at(site) {
        Some(Kind::NoSpace) => Err(io::ErrorKind::StorageFull.into()),
        Some(Kind::Interrupted) => Err(io::ErrorKind::Interrupted.into()),
        Some(Kind::Short) => Ok(true),
        Some(_) => Err(io::Error::other("a fault on purpose")),
        None => Ok(false),
    }
}

/// The fault of any other step with a file, which is done whole or fails.
pub(crate) fn of_file(site: &str) -> io::Result<()> {
    match of_transfer(site) {
        Err(error) if error.kind() == io::ErrorKind::Interrupted => Ok(()),
        other => other.map(|_| ()),
    }
}

fn parse(text: &str) -> Option<Fault> {
    let mut parts = text.split(':');
    let (site, first, kind) = (parts.next()?, parts.next()?.parse::<u64>().ok()?, parts.next()?);
    let count = parts.next().map_or(Some(1), |count| count.parse().ok())?;
    let kind = match kind {
        "DEVICE_LOST" => Kind::DeviceLost,
        "HOST_MEMORY" => Kind::HostMemory,
        "DEVICE_MEMORY" => Kind::DeviceMemory,
        "INITIALIZATION" => Kind::Initialization,
        "NO_SPACE" => Kind::NoSpace,
        "IO" => Kind::Io,
        "SHORT" => Kind::Short,
        "INTERRUPTED" => Kind::Interrupted,
        "NUMBER" => Kind::Number,
        "SLOW" => Kind::Slow,
        _ => return None,
    };
    let events = first..first.saturating_add(count);
    Some(Fault { site: site.to_owned(), events, seen: AtomicU64::new(0), kind })
}
