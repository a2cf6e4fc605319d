//! What of the device's memory a training needs to go on: the Model buffers, as they are. All others start as zeros, here
//! as in a training that goes on.

use super::Engine;
use crate::error::Result;
use crate::io::checkpoint::Plane;
use crate::pass::{ATTRIBUTES, SHARED_PLANES};
use crate::scheduler::plan::{Buf, TABLE};
use glam::DVec3;
use std::collections::BTreeMap;

/// The buffers of the state of a training with this degree of the spherical harmonics, with those that its strategy keeps,
/// and the rows of each.
fn buffers(sh_degree: u32, labels: bool, kept: &[Buf], [count, shared_rows]: [u32; 2]) -> Vec<(Buf, u32)> {
    let attributes = ATTRIBUTES.iter().filter(|a| a.from_degree <= sh_degree).flat_map(|a| a.planes);
    let labels = labels.then_some(Buf::LABELS);
    let of_gaussians = attributes.chain(kept.iter().copied()).chain(labels).map(|buf| (buf, count));
    let shared = SHARED_PLANES.into_iter().filter(|_| shared_rows > 0).map(|buf| (buf, shared_rows));
    of_gaussians.chain(shared).collect()
}

fn named(name: &str) -> Option<Buf> {
    TABLE.iter().position(|decl| decl.name == name).map(|index| Buf(index as u16))
}

fn words(buf: Buf) -> u32 {
    TABLE[buf.index()].element_bytes / 4
}

/// Says what is wrong with planes that are to be the state of so many Gaussians and shared rows. `labels` is true with
/// masks; `kept` are the names of what the strategy keeps.
pub(crate) fn check(
    planes: &[Plane],
    counts: [u32; 2],
    sh_degree: u32,
    labels: bool,
    kept: &[String],
) -> Result<(), String> {
    let kept = kept.iter().map(|name| named(name).ok_or_else(|| format!("there is no plane {name}")));
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
    /// Reads the state with what the strategy keeps; nothing may be in flight.
    pub(crate) fn download_state(&mut self, kept: &[Buf]) -> Result<Vec<Plane>> {
        let counts = [self.gaussian_count, self.size.shared_rows];
        let planes =
            buffers(self.sh_degree, self.size.labels.is_some(), kept, counts).into_iter().map(|(buf, count)| {
                let data = self.sched.download(buf, 0, 0, count as usize * words(buf) as usize)?;
                Ok(Plane { name: TABLE[buf.index()].name.to_owned(), words: words(buf), data })
            });
        planes.collect()
    }

    /// Puts a state that [`check`] has nothing against into the memory of a new engine.
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
