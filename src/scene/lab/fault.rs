//! Injected faults, so that tests can cover every failure. In a build with the feature `lab`, the environment variable
//! `LABELGS_FAULT=SITE:N:KIND` makes the N-th event of a site fail; `SITE:N:KIND:COUNT` makes COUNT events fail from
//! there on. Separate several faults with commas.
//!
//! | site | events | kinds |
//! | --- | --- | --- |
//! | a Vulkan call, such as `vkQueueSubmit` | its calls | `DEVICE_LOST`, `HOST_MEMORY`, `DEVICE_MEMORY`, `INITIALIZATION` |
//! | `vulkan` | all Vulkan calls that can fail | the same |
//! | `write` | operations on an output file: create, write, sync, rename | `NO_SPACE`, `IO`, `SHORT`, `INTERRUPTED` |
//! | `read` | operations on an input file: open, read, list a folder | `IO`, `SHORT`, `INTERRUPTED` |
//! | `loader` | loading Vulkan | any |
//! | `checkpoint` | three per checkpoint of a run: before its device read, before its write and after it | `SLOW` |
//! | `nan` | training steps | `NUMBER`: a Gaussian gets a NaN position |
//! | any | | `SLOW`: the event takes a minute |
//!
//! Any system may cause `SHORT` and `INTERRUPTED` at any time: it transfers only a part or nothing, and the call must
//! be repeated. They must not change any result.

use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::{Error, StrDeserializer};
use std::io;
use std::ops::Range;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Effect of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum Kind {
    /// The device is lost.
    DeviceLost,
    /// The host is out of memory.
    HostMemory,
    /// The device is out of memory.
    DeviceMemory,
    /// The driver cannot start.
    Initialization,
    /// The disk is full.
    NoSpace,
    /// The disk fails.
    Io,
    /// Only one byte is read or written.
    Short,
    /// A signal interrupts the call.
    Interrupted,
    /// A value becomes NaN.
    Number,
    /// The event takes a minute, but succeeds.
    Slow,
}

struct Fault {
    site: String,
    /// Events that fail.
    events: Range<u64>,
    /// Number of events so far.
    seen: AtomicU64,
    kind: Kind,
}

/// Returns the fault to inject into this event of a site, if any.
#[inline(always)]
pub fn injected(site: &str) -> Option<Kind> {
    if super::ON { requested(site) } else { None }
}

fn requested(site: &str) -> Option<Kind> {
    static FAULTS: OnceLock<Vec<Fault>> = OnceLock::new();
    let faults = FAULTS.get_or_init(|| {
        let text = super::var("LABELGS_FAULT").unwrap_or_default();
        let read = |text: &str| {
            let fault = parse(text);
            if fault.is_none() {
                tracing::warn!("LABELGS_FAULT: {text} is ignored; expected SITE:N:KIND or SITE:N:KIND:COUNT");
            }
            fault
        };
        text.split(',').filter(|text| !text.is_empty()).filter_map(read).collect()
    });
    // Every fault of the site counts this event, including faults after the first match.
    let met =
        |fault: &&Fault| fault.site == site && fault.events.contains(&(fault.seen.fetch_add(1, Ordering::Relaxed) + 1));
    let kind = faults.iter().filter(met).last()?.kind;
    tracing::warn!("injected fault: {kind:?} at {site}");
    if kind == Kind::Slow {
        std::thread::sleep(Duration::from_secs(60));
        return None;
    }
    Some(kind)
}

/// Injects a fault into a byte transfer from or to a file. Returns true if the caller may transfer only a part.
pub fn inject_transfer(site: &str) -> io::Result<bool> {
    match injected(site) {
        Some(Kind::NoSpace) => Err(io::ErrorKind::StorageFull.into()),
        Some(Kind::Interrupted) => Err(io::ErrorKind::Interrupted.into()),
        Some(Kind::Short) => Ok(true),
        Some(_) => Err(io::Error::other("injected fault")),
        None => Ok(false),
    }
}

/// Injects a fault into any other file operation, which succeeds or fails as a whole.
pub fn inject_file(site: &str) -> io::Result<()> {
    match inject_transfer(site) {
        Err(error) if error.kind() == io::ErrorKind::Interrupted => Ok(()),
        other => other.map(|_| ()),
    }
}

fn parse(text: &str) -> Option<Fault> {
    let mut parts = text.split(':');
    let (site, first, kind) = (parts.next()?, parts.next()?.parse::<u64>().ok()?, parts.next()?);
    let count = parts.next().map_or(Some(1), |count| count.parse().ok())?;
    let kind: StrDeserializer<Error> = kind.into_deserializer();
    let kind = Kind::deserialize(kind).ok()?;
    let events = first..first.saturating_add(count);
    Some(Fault { site: site.to_owned(), events, seen: AtomicU64::new(0), kind })
}
