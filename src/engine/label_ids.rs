//! Maps label ids that are too large for the passes to smaller numbers on the device.

use crate::error::{Error, Result};
use crate::scene::{LABEL_MAX, UNLABELLED};
use std::borrow::Cow;

/// The id of each number, sorted, so that numbers and ids have the same order; empty if the device holds ids directly.
#[derive(Clone, Debug, Default)]
pub(super) struct LabelIds(Vec<u32>);

/// Returns an error if the labels are too many to be distinguished on the device.
pub(crate) fn tell_apart(labels: impl Iterator<Item = u32> + Clone) -> Option<Error> {
    if labels.clone().all(|label| label <= LABEL_MAX) {
        return None;
    }
    let count = ids_of(labels).len() - 1;
    let problem = || {
        format!(
            "the model has {count} different labels with ids above {LABEL_MAX}, too many for one picture, \
             {LABEL_MAX}; take a part of the model, or merge labels"
        )
    };
    (count > LABEL_MAX as usize).then(|| Error::usage("labels", problem()))
}

/// Returns all ids, sorted. 0 is one of them, as the label of pixels without a Gaussian.
fn ids_of(labels: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut ids: Vec<u32> = std::iter::once(UNLABELLED).chain(labels).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

impl LabelIds {
    /// Returns the id table and the labels for the device. Fails if there are more different labels than numbers.
    pub(super) fn pack(labels: &[u32]) -> Result<(Self, Cow<'_, [u32]>)> {
        if labels.iter().all(|&label| label <= LABEL_MAX) {
            return Ok((Self::default(), Cow::Borrowed(labels)));
        }
        if let Some(error) = tell_apart(labels.iter().copied()) {
            return Err(error);
        }
        let ids = ids_of(labels.iter().copied());
        let numbers = labels.iter().map(|label| ids.binary_search(label).unwrap_or_default() as u32).collect();
        Ok((Self(ids), Cow::Owned(numbers)))
    }

    /// Replaces device numbers by label ids.
    pub(super) fn unpack(&self, labels: &mut [u32]) {
        if !self.0.is_empty() {
            labels.iter_mut().for_each(|label| *label = self.0.get(*label as usize).copied().unwrap_or(UNLABELLED));
        }
    }

    /// Returns true if the device holds numbers instead of ids.
    pub(super) fn are_packed(&self) -> bool {
        !self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::LabelIds;

    #[test]
    fn ids_come_back_and_keep_their_order() {
        for labels in [vec![3, 0, 65_535], vec![], vec![70_000, 5, 2_147_483_647, 70_000, 65_536], vec![65_536]] {
            let (ids, packed) = LabelIds::pack(&labels).expect("few labels");
            let mut packed = packed.into_owned();
            assert!(packed.iter().all(|&label| label <= 65_535));
            let pairs: Vec<(u32, u32)> = labels.iter().copied().zip(packed.iter().copied()).collect();
            let is_in_order = |pair: &[(u32, u32)]| pair[0].0.cmp(&pair[1].0) == pair[0].1.cmp(&pair[1].1);
            assert!(pairs.windows(2).all(is_in_order), "{labels:?}");
            assert_eq!(ids.are_packed(), labels.iter().any(|&label| label > 65_535));
            ids.unpack(&mut packed);
            assert_eq!(packed, labels);
        }
        let many: Vec<u32> = (1..=65_536).collect();
        assert!(LabelIds::pack(&many).is_err_and(|error| error.to_string().contains("65536 different labels")));
        assert!(LabelIds::pack(&many[1..]).is_ok());
    }
}
