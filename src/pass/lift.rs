//! The lift's votes become labels. The votes themselves are cast by `blend_forward_labels`.

use super::build::{Builder, over_gaussians};
use crate::pass;
use crate::plan::Buf;

/// The highest vote of this step becomes the label of its Gaussian.
pub fn resolve(b: &mut Builder) {
    pass!(b, lift_resolve {
        step: Buf::STEP, failure: Buf::FAILURE, label_keys: Buf::LABEL_KEYS, labels: Buf::LABELS,
    } [], over_gaussians());
}
