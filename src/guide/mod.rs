//! The manual: from photos to labelled objects, a page for each part of the way.
//!
//! | page | answers |
//! | --- | --- |
//! | [install] | How is it installed, and which version is it? |
//! | [start] | How do photos become a labelled model, step by step? |
//! | [data] | Which scenes, photos, cameras and depth maps are read? |
//! | [masks] | Where do masks come from, and how are they checked and repaired? |
//! | [objects] | How do I find, extract, remove and edit objects? |
//! | [city] | How is a scene trained that no one card holds? |
//! | [viewer] | How is a model, or a training, seen and changed in a browser? |
//! | [formats] | Which formats of models are read and written, and what does each keep? |
//! | [scores] | How good is my model? |
//! | [method] | What does the training do, and where does it differ from the papers? |
//! | [outputs] | Which files are written, what do statuses mean, what is the same in every run? |
//! | [devices] | Which devices work, how much memory is needed, how fast is it? |
//! | [troubleshooting] | What does this symptom mean? |
//! | [inside] | How is the code laid out, and what happens in a step? |
//!
//! Commands in boxes run one after the other, page after page, in an empty folder; a test runs them all, with fewer steps.

#[allow(unused_imports, reason = "the pages link to them")]
use crate::{Error, edit, engine, eval, files, gpu, label, render, run, scene, scenes, synth};

/// A module for each page, with the text of its file. Definitions of links come first and win over those at the end of a
/// file, which serve readers of the file itself.
macro_rules! pages {
    ($($name:ident: $summary:literal;)*) => {$(
        #[doc = $summary]
        ///
        // Only the documentation carries the pictures, not every build of the library.
        #[cfg_attr(doc, doc = include_str!(concat!(env!("OUT_DIR"), "/pictures.md")))]
        /// [page data]: data
        /// [page masks]: masks
        /// [page objects]: objects
        /// [page outputs]: outputs
        /// [page formats]: formats
        /// [page devices]: devices
        /// [`masks::import()`]: crate::masks::import
        /// [`masks::inspect()`]: crate::masks::inspect
        /// [`formats::write_meshes`]: crate::formats::write_meshes
        /// [`formats::read_model`]: crate::formats::read_model
        /// [`formats::export_model`]: crate::formats::export_model
        ///
        #[doc = include_str!(concat!(stringify!($name), ".md"))]
        pub mod $name {}
    )*};
}

pages! {
    install: "Packages, cargo, what is needed at run time, and which version it is.";
    start: "From photos to a labelled model, step by step.";
    data: "Scenes, photos, cameras and depth maps that are read.";
    masks: "Masks: their form, trackers, checks and repair.";
    objects: "Objects found, extracted, removed, edited and drawn.";
    city: "Scenes beyond one card: blocks, many cards, clusters.";
    viewer: "A model or a training in a browser.";
    formats: "Formats of models: what each keeps, labels in other programs, axes.";
    scores: "Scores: held-out views and published benchmarks.";
    method: "The method, and its differences from LabelGS and 3DGS.";
    outputs: "Files, exit statuses and determinism.";
    devices: "Devices, memory and speed.";
    troubleshooting: "Symptoms and what to do.";
    inside: "The code: the way of the data, floors, words, the life of a step.";
}
