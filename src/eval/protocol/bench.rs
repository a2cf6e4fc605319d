//! The inputs of a benchmark.

use super::score::Distance;
use super::{Layout, Protocol};
use crate::error::{Error, Result};
use crate::files::label_table::LabelTable;
use crate::scene::View;
use crate::scenes::truth::TruthMask;
use std::collections::BTreeSet;
use std::path::Path;

/// The inputs of a benchmark.
pub struct Bench<'a> {
    /// The benchmark.
    pub protocol: Protocol,
    /// Follows the published scorer instead of our rules; a pixel takes the label of its main Gaussian.
    pub compat: bool,
    /// Near plane, world units.
    pub near: f32,
    /// All views, with their photos.
    pub views: &'a [&'a View],
    /// Held-out views sorted by name, for benchmarks that number them.
    pub test: &'a [&'a View],
    /// Names of the labels.
    pub names: Option<&'a LabelTable>,
    /// Labels of the Gaussians in the model.
    pub labels: &'a BTreeSet<u32>,
    /// Reads a view's mask, given its path in the layout.
    pub truth: &'a dyn Fn(&Path, &View) -> Result<TruthMask>,
    /// LPIPS, if weights are given.
    pub lpips: Option<&'a dyn Distance>,
}

impl Bench<'_> {
    /// Fails if the scene has none of the layout's frames: it is then a different scene.
    pub fn check(&self, layout: &Layout, root: &Path) -> Result<()> {
        let mut frames = layout.tasks.iter().flat_map(|task| &task.truths).map(|truth| truth.frame.as_str());
        if frames.clone().any(|frame| self.view(frame).is_some()) {
            return Ok(());
        }
        let name = |view: &&View| view.name.clone();
        let problem = format!(
            "the scene has none of the frames, such as {}; its views are {} ...; give the ground truth of this scene",
            frames.next().unwrap_or_default(),
            self.views.iter().take(3).map(name).collect::<Vec<_>>().join(", ")
        );
        Err(Error::data(root, "", problem))
    }

    /// Returns the view of a frame: by name with or without extension, or by number if the benchmark uses numbers.
    pub(super) fn view(&self, frame: &str) -> Option<&View> {
        let called = |view: &&&View| {
            let without = Path::new(&view.name).with_extension("");
            view.name == frame || view.stem() == frame || without == Path::new(frame)
        };
        let numbered = || {
            let number = frame.parse::<usize>().ok().filter(|_| self.protocol.numbers_views())?;
            self.test.get(number)
        };
        self.views.iter().find(called).or_else(numbered).copied()
    }
}
