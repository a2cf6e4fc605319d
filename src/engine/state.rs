//! Device state that a resumed training needs: all buffers of class Model. Other buffers always start at zero.

use super::missed::MissedUpdates;
use super::{Engine, EngineSize, ListKey, late};
use crate::error::Result;
use crate::pass::buffers::TABLE;
use crate::pass::{Attribute, MODEL_ATTRIBUTES, SHARED_PLANES};
use crate::records::checkpoint::Plane;
use crate::scheduler::Snapshot;
use crate::scheduler::plan::{Buf, Domain};
use crate::shaders::constants::NO_ROW;
use crate::shaders::structs::StepUniforms;
use bytemuck::Zeroable;
use glam::DVec3;
use std::collections::BTreeMap;
use std::iter;

/// Row counts of a training's state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counts {
    /// Gaussians.
    pub gaussians: u32,
    /// Frozen Gaussians at the end, without optimiser state.
    pub frozen: u32,
    /// Shared rows.
    pub shared: u32,
    /// Both moments of a parameter are packed in one plane.
    pub half_moments: bool,
}

impl Counts {
    fn rows_of(&self, buf: Buf) -> u32 {
        let domain = &TABLE[buf.index()].domain;
        if domain.is_trained() {
            self.gaussians.saturating_sub(self.frozen)
        } else if domain.count == Domain::SHARED_ROWS.count {
            self.shared
        } else {
            self.gaussians
        }
    }
}

/// Buffers of a training's state, with row counts; `kept` are the strategy's own buffers.
fn buffers(sh_degree: u32, labels: bool, kept: &[Buf], counts: Counts) -> Vec<(Buf, u32)> {
    let planes = |a: &'static Attribute| iter::once(a.planes[0]).chain(a.moments(counts.half_moments).iter().copied());
    let attributes = MODEL_ATTRIBUTES.iter().filter(|a| a.from_degree <= sh_degree).flat_map(planes);
    let labels = labels.then_some(Buf::LABELS);
    let shared = SHARED_PLANES.into_iter().filter(|_| counts.shared > 0);
    let all = attributes.chain(kept.iter().copied()).chain(labels).chain(shared);
    all.map(|buf| (buf, counts.rows_of(buf))).collect()
}

fn named(name: &str) -> Option<Buf> {
    TABLE.iter().position(|decl| decl.name == name).map(|index| Buf(index as u16))
}

fn words(buf: Buf) -> u32 {
    TABLE[buf.index()].element_bytes / 4
}

/// Checks that planes form a state of `counts` rows. `labels` is true with masks; `kept` names the strategy's own
/// buffers.
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
    late::check(|name| given.remove(name), counts.rows_of(Buf::DENSIFY_STATS))?;
    given.keys().next().map_or(Ok(()), |name| Err(format!("the plane {name} is not expected")))
}

/// A copy of the state that any thread can read.
pub(crate) struct StateCopy {
    shapes: Vec<(Buf, u64)>,
    words: StateWords,
    /// Missed updates.
    missed: Option<Plane>,
}

enum StateWords {
    Read(Vec<Vec<u32>>),
    OnDevice(Box<Snapshot>),
}

impl StateCopy {
    /// Returns the planes, read from the device if necessary.
    pub(crate) fn planes(self) -> Result<Vec<Plane>> {
        let all = match self.words {
            StateWords::Read(all) => all,
            StateWords::OnDevice(snapshot) => snapshot.read()?,
        };
        let plane = |((buf, _), data): ((Buf, u64), _)| Plane {
            name: TABLE[buf.index()].name.to_owned(),
            words: words(buf),
            data,
        };
        Ok(self.shapes.into_iter().zip(all).map(plane).chain(self.missed).collect())
    }
}

impl Engine {
    /// Copies the state, including the strategy's own buffers. On a GPU the copy stays in device memory and is read
    /// while lists run; otherwise it goes to the host at once. No list may be in flight.
    pub(crate) fn copy_state(&mut self, kept: &[Buf]) -> Result<StateCopy> {
        self.check_idle()?;
        let (gaussians, frozen) = (self.gaussian_count, self.size.frozen);
        let counts = Counts { gaussians, frozen, ..self.no_gaussians() };
        let buffers = buffers(self.sh_degree, self.size.labels.is_some(), kept, counts).into_iter();
        let late = self.missed.is_late().then(|| (Buf::TOUCHED_AT, counts.rows_of(Buf::DENSIFY_STATS)));
        let missed = late.map(|_| self.missed.plane());
        let shapes: Vec<(Buf, u64)> =
            buffers.chain(late).map(|(buf, count)| (buf, u64::from(count) * u64::from(words(buf)))).collect();
        if self.runs_ahead() {
            match self.sched.snapshot(&shapes) {
                Ok(snapshot) => {
                    return Ok(StateCopy { shapes, words: StateWords::OnDevice(Box::new(snapshot)), missed });
                }
                Err(error) if error.is_out_of_memory() => {
                    tracing::info!("{error}; training pauses until the state is read");
                }
                Err(error) => return Err(error),
            }
        }
        let read = shapes.iter().map(|&(buf, words)| self.sched.download(buf, 0, 0, words as usize));
        let words = StateWords::Read(read.collect::<Result<_>>()?);
        Ok(StateCopy { shapes, words, missed })
    }

    fn no_gaussians(&self) -> Counts {
        let EngineSize { shared_rows: shared, half_moments, .. } = self.size;
        Counts { gaussians: 0, frozen: 0, shared, half_moments }
    }

    /// Float planes of the state. Packed moments are excluded, because every word is a finite number.
    pub(super) fn floats(&self, kept: &[Buf]) -> Vec<Buf> {
        let all = buffers(self.sh_degree, false, kept, self.no_gaussians()).into_iter().map(|(buf, _)| buf);
        let is_packed = |buf: &Buf| self.size.half_moments && MODEL_ATTRIBUTES.iter().any(|a| a.planes[1] == *buf);
        all.filter(|buf| !is_packed(buf)).collect()
    }

    /// Finds a value of the state that is not finite: plane name, row, and whether it is a shared row. `None` if all
    /// are finite. No list may be in flight.
    pub(crate) fn nonfinite(&mut self, kept: &'static [Buf]) -> Result<Option<(&'static str, u32, bool)>> {
        self.run(ListKey::Nonfinite(kept), &StepUniforms::zeroed())?;
        let planes = self.floats(kept);
        let rows = self.sched.download::<u32>(Buf::NONFINITE_ROWS, 0, 0, planes.len())?;
        let found = planes.into_iter().zip(rows).find(|(_, row)| *row != NO_ROW);
        Ok(found.map(|(buf, row)| (TABLE[buf.index()].name, row, SHARED_PLANES.contains(&buf))))
    }

    /// Uploads a state that has passed [`check`] to a new engine.
    pub(crate) fn upload_state(&mut self, count: u32, origin: DVec3, planes: &[Plane]) -> Result<()> {
        self.make_room_for_gaussians(u64::from(count))?;
        let settled = if self.may_be_late() { None } else { late::settled(planes) };
        let planes = settled.as_deref().unwrap_or(planes);
        self.start_updates()?;
        for plane in planes {
            if let Some(buf) = named(&plane.name) {
                self.sched.upload(buf, 0, 0, &plane.data)?;
            }
        }
        (self.gaussian_count, self.origin) = (count, origin);
        self.missed = MissedUpdates::find(planes).unwrap_or_default();
        Ok(())
    }
}
