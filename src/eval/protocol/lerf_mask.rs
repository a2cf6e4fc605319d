//! LERF-Mask, the benchmark of Gaussian Grouping.
//!
//! `test_mask/VIEW/PROMPT.png`, white where the object of the text prompt is visible. VIEW is the name of a view, or
//! the number of a test view, from 0. The published score averages over the views of a prompt, then over prompts. Its
//! scorer leaves out missing predictions.

use super::{Ask, Layout, by_frame_and_object, tasks};
use std::path::PathBuf;

pub(super) fn layout(files: &[PathBuf], ask: Ask) -> Result<Layout, String> {
    let mut left_out = Vec::new();
    let objects = by_frame_and_object(files, &mut left_out);
    if objects.is_empty() {
        return Err("holds no mask; expected VIEW/PROMPT.png, as in lerf_mask/figurines/test_mask".into());
    }
    let mut layout = tasks(objects, ask);
    layout.left_out.extend(left_out);
    Ok(layout)
}
