//! The guide: from photos to labelled objects, one page for each question.
//!
//! | page | your question |
//! | --- | --- |
//! | [install] | How do I install labelgs? |
//! | [start] | How do I get from photos to labelled objects? |
//! | [no_poses] | I have photos or a video, but no poses: what now? |
//! | [no_masks] | I have no masks: what now? |
//! | [masks] | I have masks: how do I use them? |
//! | [data] | Which scenes, photos and cameras can I use? |
//! | [objects] | How do I find, extract, remove and edit objects? |
//! | [viewer] | How do I look at a model and edit it in a browser? |
//! | [other_models] | I have a model of another trainer: how does it get labels? |
//! | [formats] | Which model formats can I read and write? |
//! | [other_programs] | How do I open a model in Blender, Unity, Unreal, Isaac Sim or a web page? |
//! | [large_scenes] | How do I train a scene that is too large for one GPU? |
//! | [cluster] | How do I run one job on a cluster or in a container? |
//! | [scores] | How good is my model? |
//! | [outputs] | Which files does labelgs write, and what do exit statuses mean? |
//! | [devices] | Does it run on my GPU, and how much memory does it need? |
//! | [troubleshooting] | What does this symptom mean? |
//! | [method] | What happens in training, and how does it differ from the papers? |
//! | [inside] | How is the code organised? |
//!
//! Commands in `sh` boxes run as they stand, one after the other, page after page, in one empty folder. A test runs
//! them all, with fewer training steps.

#[allow(unused_imports, reason = "the pages link to them")]
use crate::{Error, edit, engine, eval, files, gpu, label, render, run, scene, scenes, synth};

/// A module for each page, with the text of its file. Definitions of links come first and win over those at the end
/// of a file, which serve readers of the file itself.
macro_rules! pages {
    ($($name:ident: $summary:literal;)*) => {$(
        #[doc = $summary]
        ///
        // Only the documentation carries the pictures, not every build of the library.
        #[cfg_attr(doc, doc = include_str!(concat!(env!("OUT_DIR"), "/pictures.md")))]
        /// [page install]: install
        /// [page start]: start
        /// [page no_poses]: no_poses
        /// [page no_masks]: no_masks
        /// [page masks]: masks
        /// [page data]: data
        /// [page objects]: objects
        /// [page viewer]: viewer
        /// [page other_models]: other_models
        /// [page formats]: formats
        /// [page other_programs]: other_programs
        /// [page large_scenes]: large_scenes
        /// [page cluster]: cluster
        /// [page scores]: scores
        /// [page outputs]: outputs
        /// [page devices]: devices
        /// [page troubleshooting]: troubleshooting
        /// [page method]: method
        /// [page inside]: inside
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
    install: "Packages, archives, cargo, and which version you have.";
    start: "From photos to labelled objects in four steps.";
    no_poses: "Camera poses for photos and videos, by COLMAP.";
    no_masks: "Objects from photos alone, from a click or from strokes.";
    masks: "Masks that you have: import, check, repair, trackers, turntables.";
    data: "Scenes, photos, cameras, depth maps and ground truth that labelgs reads.";
    objects: "Objects found, extracted, removed, edited and drawn.";
    viewer: "A model or a training in a browser.";
    other_models: "Labels for models of other trainers, and problems of other methods.";
    formats: "Model formats, and what each keeps or loses.";
    other_programs: "Models in Blender, Unity, Unreal, Isaac Sim and on web pages.";
    large_scenes: "Scenes larger than one GPU: blocks, several GPUs, clusters.";
    cluster: "One training under Slurm, Docker or Apptainer, and on several GPUs.";
    scores: "Scores: held-out views and published benchmarks.";
    outputs: "Files, exit statuses and determinism.";
    devices: "Devices, memory and speed.";
    troubleshooting: "Symptoms and what to do.";
    method: "The method, and its differences from LabelGS and 3DGS.";
    inside: "The code: data flow, layers, words, the life of a step.";
}
