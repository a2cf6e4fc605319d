//! Device state that a training needs to continue: the buffers of kind Model, unchanged. All other buffers start at
//! zero, both in a new and in a continued training.

use super::Engine;
use crate::error::Result;
use crate::pass::buffers::TABLE;
use crate::pass::{ATTRIBUTES, SHARED_PLANES};
use crate::records::checkpoint::Plane;
use crate::scheduler::plan::{Buf, Domain};
use glam::DVec3;
use std::collections::BTreeMap;

/// Numbers of rows of a training's state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counts {
    /// Gaussians.
    pub gaussians: u32,
    /// Gaussians at the end without optimiser state.
    pub frozen: u32,
    /// Shared rows.
    pub shared: u32,
}

impl Counts {
    fn of(&self, buf: Buf) -> u32 {
        let count = TABLE[buf.index()].domain.count;
        if count == Domain::TRAINED.count {
            self.gaussians.saturating_sub(self.frozen)
        } else if count == Domain::SHARED_ROWS.count {
            self.shared
        } else {
            self.gaussians
        }
    }
}

/// Buffers of a training's state, with row counts; `kept` are the buffers that its strategy keeps.
fn buffers(sh_degree: u32, labels: bool, kept: &[Buf], counts: Counts) -> Vec<(Buf, u32)> {
    let attributes = ATTRIBUTES.iter().filter(|a| a.from_degree <= sh_degree).flat_map(|a| a.planes);
    let labels = labels.then_some(Buf::LABELS);
    let shared = SHARED_PLANES.into_iter().filter(|_| counts.shared > 0);
    let all = attributes.chain(kept.iter().copied()).chain(labels).chain(shared);
    all.map(|buf| (buf, counts.of(buf))).collect()
}

fn named(name: &str) -> Option<Buf> {
    TABLE.iter().position(|decl| decl.name == name).map(|index| Buf(index as u16))
}

fn words(buf: Buf) -> u32 {
    TABLE[buf.index()].element_bytes / 4
}

/// Checks that planes form a state of `counts` rows. `labels` is true with masks; `kept` names
/// the buffers that the strategy keeps. The error says what is wrong.
pub(crate) fn check(
    planes: &[Plane],
    counts: Counts,
    sh_degree: u32,
    labels: bool,
    kept: &[String],
) -> Result<(), String> {
    let kept = kept
        .iter()
        .map(|name| named(name).ok_or_else(|| format!("the strategy keeps plane {name}, which does not exist")));
    let kept = kept.collect::<Result<Vec<_>, _>>()?;
    let mut given: BTreeMap<&str, &Plane> = planes.iter().map(|plane| (plane.name.as_str(), plane)).collect();
    for (buf, count) in buffers(sh_degree, labels, &kept, counts) {
        let (name, words) = (TABLE[buf.index()].name, words(buf));
        let plane = given.remove(name).ok_or_else(|| format!("the plane {name} is missing"))?;
        let rows = plane.data.len() as u64 / u64::from(plane.words.max(1));
        if (plane.words, rows) != (words, u64::from(count)) {
            return Err(format!(
                "the plane {name} has {rows} rows of {} words, {count} of {words} are expected",
                plane.words
            ));
        }
    }
    given.keys().next().map_or(Ok(()), |name| Err(format!("there is a plane {name}, which nothing needs")))
}

impl Engine {
    /// Downloads the state, including the buffers that the strategy keeps. No list may be in flight.
    pub(crate) fn download_state(&mut self, kept: &[Buf]) -> Result<Vec<Plane>> {
        let (gaussians, frozen) = (self.gaussian_count, self.size.frozen);
        let counts = Counts { gaussians, frozen, shared: self.size.shared_rows };
        let planes =
            buffers(self.sh_degree, self.size.labels.is_some(), kept, counts).into_iter().map(|(buf, count)| {
                let data = self.sched.download(buf, 0, 0, count as usize * words(buf) as usize)?;
                Ok(Plane { name: TABLE[buf.index()].name.to_owned(), words: words(buf), data })
            });
        planes.collect()
    }

    /// Uploads a state that has passed [`check`] to a new engine.
    pub(crate) fn upload_state(&mut self, count: u32, origin: DVec3, planes: &[Plane]) -> Result<()> {
        self.make_room_for_gaussians(u64::from(count))?;
        for plane in planes {
            if let Some(buf) = named(&plane.name) {
                self.sched.upload(buf, 0, 0, &plane.data)?;
            }
        }
        (self.gaussian_count, self.origin) = (count, origin);
        Ok(())
    }
}
