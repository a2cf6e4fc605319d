//! Applies missed updates on the host when a model or state is read. The device is not changed, so reading does not
//! affect the training, bit for bit.

use super::Engine;
use super::missed::{MissedUpdates, Weights};
use super::moments::{pack_all, unpack_all};
use crate::error::Result;
use crate::pass::MODEL_ATTRIBUTES;
use crate::pass::buffers::TABLE;
use crate::records::checkpoint::Plane;
use crate::scheduler::Scheduler;
use crate::scheduler::plan::Buf;
use crate::shaders::constants::ADAM_EPSILON;

/// Plane with the weights of missed updates; its first row has the update numbers.
const MISSED_PLANE: &str = "missed_updates";
/// Words per row of that plane.
const MISSED_ROW_WORDS: u32 = 8;

/// Index of the learning rate (of eight) of each vec4 component, by the attribute's rate.
const COMPONENT_RATES: [[usize; 4]; 5] = [[0, 1, 2, 3], [4; 4], [5; 4], [6, 6, 6, 7], [7; 4]];

/// The updates that each Gaussian has missed.
pub(super) struct PendingUpdates {
    /// Number of missed updates of each trained Gaussian.
    ages: Vec<usize>,
    /// For each number of missed updates: sums for the eight rates, and factors of both moments.
    sums: Vec<(Weights, [f32; 2])>,
    /// The moments are packed.
    half: bool,
}

impl PendingUpdates {
    fn new(missed: &MissedUpdates, touched_at: &[u32], half: bool) -> Self {
        let ages = touched_at.iter().map(|&at| missed.age(at) as usize).collect();
        Self { ages, sums: missed.sums(), half }
    }

    /// Applies missed updates to the values of a parameter plane and to its moments.
    fn settle(&self, plane: Buf, [values, m, u]: [&mut [f32]; 3]) {
        let Some(attribute) = MODEL_ATTRIBUTES.iter().find(|attribute| attribute.planes[0] == plane) else { return };
        let (rates, floats) = (COMPONENT_RATES[attribute.rate as usize], 4 * attribute.stride as usize);
        for (row, &age) in self.ages.iter().enumerate().filter(|(_, age)| **age > 0) {
            let (sums, [first, second]) = &self.sums[age];
            for at in row * floats..(row + 1) * floats {
                values[at] -= sums[rates[at % 4]] * (m[at] / (u[at].sqrt() + ADAM_EPSILON));
                m[at] *= first;
                u[at] *= second;
            }
            // The smallest deviation (`limited` in glsl/include/gaussian.glsl).
            if plane == Buf::SCALES && values[4 * row + 3] > 0.0 {
                let limit = values[4 * row + 3].ln();
                values[4 * row..4 * row + 3].iter_mut().for_each(|value| *value = value.max(limit));
            }
        }
    }
}

/// Reads floats of a parameter plane; with `late`, after applying missed updates.
pub(super) fn read(
    sched: &mut Scheduler,
    late: Option<&PendingUpdates>,
    plane: Buf,
    floats: usize,
) -> Result<Vec<f32>> {
    let mut values = sched.download::<f32>(plane, 0, 0, floats)?;
    let attribute = MODEL_ATTRIBUTES.iter().find(|attribute| attribute.planes[0] == plane);
    if let (Some(late), Some(attribute)) = (late, attribute) {
        let trained = late.ages.len() * 4 * attribute.stride as usize;
        let (mut m, mut u) = match attribute.moments(late.half) {
            [packed] => unpack_all(&sched.download(*packed, 0, 0, trained)?),
            both => (sched.download(both[0], 0, 0, trained)?, sched.download(both[1], 0, 0, trained)?),
        };
        late.settle(plane, [&mut values[..trained], &mut m, &mut u]);
    }
    Ok(values)
}

/// Returns the planes of a state with all missed updates applied; `None` if there are none.
pub(super) fn settled(planes: &[Plane]) -> Option<Vec<Plane>> {
    let find = |name: &str| planes.iter().find(|plane| plane.name == name);
    let (missed, touched_at) = (find(MISSED_PLANE)?, find(TABLE[Buf::TOUCHED_AT.index()].name)?);
    let late = PendingUpdates::new(&MissedUpdates::from_words(&missed.data), &touched_at.data, false);
    let mut all: Vec<Plane> = planes.to_vec();
    let floats = |plane: &Plane| plane.data.iter().map(|&word| f32::from_bits(word)).collect::<Vec<f32>>();
    let words = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect::<Vec<u32>>();
    for attribute in &MODEL_ATTRIBUTES {
        let named = |buf: Buf| all.iter().position(|plane| plane.name == TABLE[buf.index()].name);
        let [Some(values), Some(first), second] = attribute.planes.map(named) else { continue };
        let mut row = floats(&all[values]);
        let (mut m, mut u) = match second {
            Some(second) => (floats(&all[first]), floats(&all[second])),
            None => unpack_all(&all[first].data),
        };
        late.settle(attribute.planes[0], [&mut row, &mut m, &mut u]);
        all[values].data = words(row);
        match second {
            Some(second) => (all[first].data, all[second].data) = (words(m), words(u)),
            None => all[first].data = pack_all(&m, &u),
        }
    }
    all.retain(|plane| plane.name != missed.name && plane.name != touched_at.name);
    Some(all)
}

/// Checks the planes of missed updates in a state; `take` removes a plane from the given ones.
pub(super) fn check<'a>(mut take: impl FnMut(&str) -> Option<&'a Plane>, trained: u32) -> Result<(), String> {
    match (take(TABLE[Buf::TOUCHED_AT.index()].name), take(MISSED_PLANE)) {
        (None, None) => Ok(()),
        (Some(touched_at), Some(missed)) => {
            let rows = touched_at.data.len() == trained as usize && touched_at.words == 1;
            let is_whole =
                missed.words == MISSED_ROW_WORDS && missed.data.len().is_multiple_of(MISSED_ROW_WORDS as usize);
            let knows = |missed: &MissedUpdates| touched_at.data.iter().all(|&at| missed.knows(at));
            match rows && is_whole && !missed.data.is_empty() && knows(&MissedUpdates::from_words(&missed.data)) {
                true => Ok(()),
                false => Err(format!("the planes {} and {MISSED_PLANE} do not fit", touched_at.name)),
            }
        }
        _ => Err(format!("one of the planes {} and {MISSED_PLANE} is missing", TABLE[Buf::TOUCHED_AT.index()].name)),
    }
}

impl MissedUpdates {
    /// Returns the state's plane of missed updates.
    pub(super) fn plane(&self) -> Plane {
        Plane { name: MISSED_PLANE.to_owned(), words: MISSED_ROW_WORDS, data: self.words() }
    }

    /// Finds the missed updates in a state.
    pub(super) fn find(planes: &[Plane]) -> Option<Self> {
        planes.iter().find(|plane| plane.name == MISSED_PLANE).map(|plane| Self::from_words(&plane.data))
    }
}

impl Engine {
    /// Returns the missed updates of all Gaussians; `None` if there are none.
    pub(super) fn late(&mut self) -> Result<Option<PendingUpdates>> {
        if !self.missed.is_late() {
            return Ok(None);
        }
        let touched_at = self.sched.download::<u32>(Buf::TOUCHED_AT, 0, 0, self.trained_count() as usize)?;
        Ok(Some(PendingUpdates::new(&self.missed, &touched_at, self.size.half_moments)))
    }
}
