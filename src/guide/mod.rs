//! The manual: from photos to labelled objects, a page for each part of the way.
//!
//! | page | answers |
//! | --- | --- |
//! | [start] | How do photos become a labelled model, step by step? |
//! | [data] | Which scenes, photos, cameras and depth maps are read? |
//! | [masks] | Where do masks come from, and how are they checked and repaired? |
//! | [labels] | How are objects chosen, taken out, renamed and drawn? |
//! | [benchmarks] | How is a model scored, on its own views and by published benchmarks? |
//! | [method] | What does the training do, and where does it differ from the papers? |
//! | [outputs] | Which files are written, what do statuses mean, what is the same in every run? |
//! | [devices] | Which devices work, how much memory is needed, how fast is it? |
//! | [troubleshooting] | What does this symptom mean? |
//! | [inside] | How is the code laid out, and what happens in a step? |
//!
//! Commands in boxes run one after the other, page after page, in an empty folder; a test runs them all, with fewer steps.

/// From photos to a labelled model, step by step.
#[doc = include_str!(concat!(env!("OUT_DIR"), "/pictures.md"))]
#[doc = include_str!("start.md")]
pub mod start {}

/// Scenes, photos, cameras and depth maps that are read.
#[doc = include_str!("data.md")]
pub mod data {}

/// Masks: their form, trackers, checks and repair.
#[doc = include_str!("masks.md")]
pub mod masks {}

/// Objects chosen, taken out, renamed and drawn.
#[doc = include_str!(concat!(env!("OUT_DIR"), "/pictures.md"))]
#[doc = include_str!("labels.md")]
pub mod labels {}

/// Scores: held-out views and published benchmarks.
#[doc = include_str!("benchmarks.md")]
pub mod benchmarks {}

/// The method, and its differences from LabelGS and 3DGS.
#[doc = include_str!("method.md")]
pub mod method {}

/// Files, exit statuses and determinism.
#[doc = include_str!("outputs.md")]
pub mod outputs {}

/// Devices, memory and speed.
#[doc = include_str!("devices.md")]
pub mod devices {}

/// Symptoms and what to do.
#[doc = include_str!("troubleshooting.md")]
pub mod troubleshooting {}

/// The code: floors, words, the life of a step.
#[doc = include_str!("inside.md")]
pub mod inside {}
