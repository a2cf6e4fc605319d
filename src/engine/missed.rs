//! Tracks the updates that Gaussians missed while no step touched them (glsl/include/caught_up.glsl).
//!
//! The engine numbers updates itself, starting when a model or state is uploaded.

use super::{Engine, Input, ListKey};
use crate::error::Result;
use crate::pass::{Variant, is_fused};
use crate::scheduler::plan::Buf;
use crate::shaders::constants::{ADAM_BETA1, ADAM_BETA2, MISSED_MOST};
use crate::shaders::structs::StepUniforms;
use bytemuck::Zeroable;
use std::collections::VecDeque;

/// Learning rates of an update with bias correction: position, opacity, scales, rotations, colours of degree 0, and of
/// higher degrees.
pub(super) type Weights = [f32; 8];

/// A row of the table on the device.
type Row = [[u32; 4]; 3];

/// Most updates that a failure can undo; more than there are steps in flight.
const UNDONE_UPDATES_MAX: usize = 32;

/// Update counters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct UpdateMark {
    /// All updates so far.
    now: u32,
    /// Number of the last update that no Gaussian missed.
    whole: u32,
}

/// The updates that Gaussians may have missed.
#[derive(Debug, Default)]
pub(super) struct MissedUpdates {
    mark: UpdateMark,
    /// Weights of the newest updates, the latest last.
    weights: VecDeque<Weights>,
}

impl MissedUpdates {
    /// Returns true if Gaussians have missed updates.
    pub(super) fn is_late(&self) -> bool {
        self.mark.now > self.mark.whole
    }

    /// Returns how many updates a Gaussian has missed, given the number of its last update.
    pub(super) fn age(&self, touched_at: u32) -> u32 {
        self.mark.now.saturating_sub(touched_at.max(self.mark.whole)).min(MISSED_MOST)
    }

    /// Returns true if the weights of all updates that such a Gaussian missed are known.
    pub(super) fn knows(&self, touched_at: u32) -> bool {
        touched_at <= self.mark.now && self.age(touched_at) as usize <= self.weights.len()
    }

    /// Returns the sums of the weights and the powers beta1^n and beta2^n for each number n of missed updates.
    pub(super) fn sums(&self) -> Vec<(Weights, [f32; 2])> {
        self.rows().map(|(sums, powers)| (sums.map(|sum| sum as f32), powers.map(|power| power as f32))).collect()
    }

    /// Returns the same in f64.
    fn rows(&self) -> impl Iterator<Item = ([f64; 8], [f64; 2])> {
        let [beta1, beta2] = [ADAM_BETA1, ADAM_BETA2].map(f64::from);
        let ratio = beta1 / beta2.sqrt();
        // Before the first update, weights are 0.
        let newest = self.weights.iter().rev().copied().chain(std::iter::repeat(Weights::default()));
        let start = ([0.0; 8], [1.0; 2]);
        let older = newest.scan(start, move |(sums, powers), weights| {
            sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum = ratio * (f64::from(weight) + *sum));
            powers.iter_mut().zip([beta1, beta2]).for_each(|(power, factor)| *power *= factor);
            Some((*sums, *powers))
        });
        std::iter::once(start).chain(older).take(MISSED_MOST as usize + 1)
    }

    /// Returns the table for a step. `after_failure` repeats a failed step.
    fn table(&self, after_failure: bool) -> Vec<Row> {
        let head = [[self.mark.now, self.mark.whole, u32::from(after_failure), 0], [0; 4], [0; 4]];
        let rows = self.rows().map(|(sums, powers)| {
            let word = |at: usize| (sums[at] as f32).to_bits();
            let [first, second] = powers.map(|power| (power as f32).to_bits());
            [[0, 1, 2, 3].map(word), [4, 5, 6, 7].map(word), [first, second, 0, 0]]
        });
        std::iter::once(head).chain(rows).collect()
    }

    /// Words of a saved state: the update counters, then the weights.
    pub(super) fn words(&self) -> Vec<u32> {
        let head = [self.mark.now, self.mark.whole, 0, 0, 0, 0, 0, 0];
        std::iter::once(head).chain(self.weights.iter().map(|weights| weights.map(f32::to_bits))).flatten().collect()
    }

    /// The inverse of [`MissedUpdates::words`].
    pub(super) fn from_words(words: &[u32]) -> Self {
        let mut rows = words.as_chunks::<8>().0.iter();
        let mark =
            rows.next().map_or(UpdateMark::default(), |head| UpdateMark { now: head[0], whole: head[1].min(head[0]) });
        Self { mark, weights: rows.map(|row| row.map(f32::from_bits)).collect() }
    }

    fn advance(&mut self, weights: Weights) {
        self.mark.now += 1;
        self.weights.push_back(weights);
        if self.weights.len() > MISSED_MOST as usize + UNDONE_UPDATES_MAX {
            self.weights.pop_front();
        }
    }

    fn rewind(&mut self, mark: UpdateMark) {
        let taken_back = self.mark.now.saturating_sub(mark.now) as usize;
        self.weights.truncate(self.weights.len().saturating_sub(taken_back));
        self.mark = mark;
    }
}

/// Returns the weights of an update.
fn weights(uniforms: &StepUniforms) -> Weights {
    let u = uniforms;
    let factor = f64::from(u.adam_correction1) / f64::from(u.adam_correction2).sqrt();
    let [x, y, z, opacity] = u.rate_means;
    [x, y, z, opacity, u.rate_scales, u.rate_quats, u.rate_sh0, u.rate_sh_rest]
        .map(|rate| (factor * f64::from(rate)) as f32)
}

impl Engine {
    /// Returns true if Gaussians may miss updates.
    pub(crate) fn may_be_late(&self) -> bool {
        self.capacity.missed_rows > 0
    }

    /// Returns the variant of a training step, and whether one kernel does its whole update; `None` for other lists.
    fn step_of(&self, key: ListKey) -> Option<(Variant, bool)> {
        match key {
            ListKey::Train(variant) => Some((variant, is_fused(&self.shape, (&(), 0)))),
            ListKey::Extended(variant, passes) => Some((variant, is_fused(&self.shape, (&*self.extension, passes)))),
            _ => None,
        }
    }

    /// Returns the list for a step, with a catch-up pass for all Gaussians if it is due.
    pub(super) fn caught_up(&self, key: ListKey) -> ListKey {
        let (UpdateMark { now, whole }, of) = (self.missed.mark, self.step_of(key));
        let catch_up = match of.filter(|_| self.may_be_late()) {
            Some((_, true)) => now - whole >= MISSED_MOST,
            Some((_, false)) => now > whole,
            None => return key,
        };
        match key {
            ListKey::Train(variant) => ListKey::Train(Variant { catch_up, ..variant }),
            ListKey::Extended(variant, passes) => ListKey::Extended(Variant { catch_up, ..variant }, passes),
            other => other,
        }
    }

    /// Records the update of a submitted step. Returns the counters before it.
    pub(super) fn note_update(&mut self, key: ListKey, uniforms: &StepUniforms) -> UpdateMark {
        let before = self.missed.mark;
        if let Some((variant, is_fused)) = self.step_of(key).filter(|_| self.may_be_late()) {
            if variant.catch_up {
                self.missed.mark.whole = before.now;
            }
            if variant.update {
                self.missed.advance(weights(uniforms));
            }
            // Separate update passes update all Gaussians.
            if variant.update && !is_fused {
                self.missed.mark.whole = self.missed.mark.now;
            }
        }
        before
    }

    /// Undoes the counted updates of a failed list and of the lists after it.
    pub(super) fn undo_updates(&mut self, before: UpdateMark) {
        self.missed.rewind(before);
    }

    /// Resets the counters, for a model without missed updates.
    pub(super) fn start_updates(&mut self) -> Result<()> {
        self.missed = MissedUpdates::default();
        if self.may_be_late() { self.sched.fill(Buf::TOUCHED_AT, 0) } else { Ok(()) }
    }

    /// Uploads the table of missed updates before a list.
    pub(super) fn write_missed(&mut self, frame: usize) -> Result<()> {
        if !self.may_be_late() {
            return Ok(());
        }
        self.sched.upload(Buf::MISSED, frame, 0, &self.missed.table(false))
    }

    /// Applies all missed updates on the device, before something else changes planes of the state. No list may be in
    /// flight.
    #[doc(hidden)]
    pub fn catch_up(&mut self) -> Result<()> {
        if !self.missed.is_late() {
            return Ok(());
        }
        self.check_idle()?;
        let list = self.list(ListKey::CatchUp)?;
        // The seed decides the rounding of packed moments.
        let seed = self.missed.mark.now;
        self.write(0, Input::Uniforms(&StepUniforms { seed, ..StepUniforms::zeroed() }))?;
        self.sched.upload(Buf::MISSED, 0, 0, &self.missed.table(true))?;
        self.sched.run(list, 0)?;
        self.missed.mark.whole = self.missed.mark.now;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{MissedUpdates, UpdateMark};

    fn number(word: u32) -> f64 {
        f64::from(f32::from_bits(word))
    }

    #[test]
    fn sums_are_those_of_the_updates_missed() {
        let mut missed = MissedUpdates::default();
        for update in 1..=400 {
            missed.advance([update as f32; 8]);
        }
        missed.mark.whole = 145;
        let table = missed.table(false);
        assert_eq!(table.len(), 257);
        assert_eq!(table[0][0], [400, 145, 0, 0]);
        let ratio = f64::from(0.9_f32) / f64::from(0.999_f32).sqrt();
        for age in [0, 1, 2, 30, 255] {
            let sum: f64 = (1..=age).map(|k| ratio.powi(k) * f64::from(400 - age + k)).sum();
            let [means, rest, powers] = table[1 + age as usize];
            for word in means.into_iter().chain(rest) {
                assert!((number(word) - sum).abs() <= 1e-7 * sum, "{age}: {} {sum}", number(word));
            }
            let expected = [f64::from(0.9_f32).powi(age), f64::from(0.999_f32).powi(age)];
            for (word, power) in powers.into_iter().zip(expected) {
                assert!((number(word) - power).abs() <= 1e-7 * power, "{age}: {} {power}", number(word));
            }
        }
    }

    #[test]
    fn updates_that_were_not_made_are_taken_back() {
        let (mut missed, mut other) = (MissedUpdates::default(), MissedUpdates::default());
        for update in 0..300 {
            [&mut missed, &mut other].into_iter().for_each(|of| of.advance([update as f32; 8]));
        }
        let before = missed.mark;
        (0..4).for_each(|_| missed.advance([1e9; 8]));
        missed.mark.whole = 302;
        missed.rewind(before);
        assert_eq!(missed.mark, UpdateMark { now: 300, whole: 0 });
        assert_eq!(missed.table(true), other.table(true));
    }
}
