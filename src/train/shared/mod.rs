//! Parameters that belong to no Gaussian: of the whole scene, such as a background, or of each photo, such as its
//! exposure. They are rows of four numbers. Steps train them together with the Gaussians, with the same optimiser, and
//! checkpoints store them.
//!
//! A step uses the rows of the scene and of its photo. All other rows keep their values and moments. The bias
//! correction of a row counts the row's own updates, so that a photo's first update has the right length, however late
//! it happens.

pub mod exposure;
pub mod poses;
mod preconditioner;

use crate::engine::SharedRow;
use crate::error::{Error, Result};
use crate::pass::Extension;
use crate::scene::Dataset;
use crate::train::setup::region::Region;
use crate::train::strategy::StepContext;
use crate::train::{ExposureMode, TrainConfig};
use exposure::{Exposure, Gains};
use poses::Poses;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

/// Numbers of rows: first the scene's rows, then those of each training view in turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SharedLayout {
    /// Number of rows of the scene.
    pub scene: u32,
    /// Number of rows of each photo.
    pub photo: u32,
}

impl SharedLayout {
    /// Returns the total number of rows.
    pub fn count(self, views: usize) -> u32 {
        self.photo.saturating_mul(views as u32).saturating_add(self.scene)
    }

    fn and(self, other: Self) -> Self {
        Self { scene: self.scene + other.scene, photo: self.photo + other.photo }
    }

    /// Returns the rows of a view.
    pub fn view_rows(self, view: usize) -> Range<u32> {
        self.count(view)..self.count(view + 1)
    }

    /// Returns the rows of a step on a view.
    fn step_rows(self, view: usize) -> impl Iterator<Item = u32> {
        (0..self.scene).chain(self.view_rows(view))
    }
}

/// Offsets of one owner's rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowOffsets {
    /// Offset of its scene rows among a step's rows.
    pub scene: u32,
    /// Offset of its photo rows among a step's rows.
    pub photo: u32,
    /// Layout of all owners' rows.
    pub all: SharedLayout,
}

/// Parameters to train besides the Gaussians. All results must be functions of the arguments, because steps are
/// repeated after a buffer has grown, and a resumed training calls these functions again.
pub trait SharedParameters: Debug + Send {
    /// Returns the name for checkpoints.
    fn name(&self) -> &'static str;

    /// Returns the number of rows.
    fn layout(&self) -> SharedLayout;

    /// Returns the initial rows of a view, or of the scene for `None`.
    fn start(&self, view: Option<usize>) -> Vec<[f32; 4]>;

    /// Returns the learning rates of a step's rows: first the scene's, then the photo's. A row with rates
    /// of 0 keeps its values and moments in this step.
    fn rates(&self, at: StepContext) -> Vec<[f32; 4]>;

    /// Returns the passes of every step; called once. `Buf::STEP_ROWS` has the step's rows and `Buf::SHARED` their
    /// values. The passes write gradients to the same rows of `Buf::V_SHARED`, which are 0 initially.
    fn extension(&self, place: RowOffsets) -> Arc<dyn Extension>;
}

/// The shared parameters of a training; none by default.
#[derive(Debug, Default)]
pub struct SharedSet(Vec<Box<dyn SharedParameters>>);

impl<P: SharedParameters + 'static> From<P> for SharedSet {
    fn from(parameters: P) -> Self {
        Self(vec![Box::new(parameters)])
    }
}

impl SharedSet {
    /// Returns the parameters that the configuration asks for. `gains` are the initial gains of each photo. Exposures
    /// of a region are fixed.
    pub(crate) fn from_config(
        config: &TrainConfig,
        gains: &[Gains],
        dataset: &Dataset,
        region: Option<&Region>,
    ) -> Self {
        let mut all: Vec<Box<dyn SharedParameters>> = Vec::new();
        if config.exposure == ExposureMode::On {
            all.push(Box::new(match region {
                Some(region) => Exposure::fixed(dataset.train.iter().map(|view| region.exposures.get(&view.name))),
                None => Exposure::new(gains),
            }));
        }
        if config.refine_poses {
            all.push(Box::new(Poses::new(dataset)));
        }
        Self(all)
    }

    /// Returns these parameters, or else those that the configuration asks for.
    pub(in crate::train) fn or_of(self, config: &TrainConfig, dataset: &Dataset, region: Option<&Region>) -> Self {
        if self.0.is_empty() { Self::from_config(config, &[], dataset, region) } else { self }
    }

    fn layout(&self) -> SharedLayout {
        self.0.iter().fold(SharedLayout::default(), |all, of| all.and(of.layout()))
    }

    /// Returns each owner with the offsets of its rows.
    fn placed(&self) -> impl Iterator<Item = (&dyn SharedParameters, RowOffsets)> {
        let all = self.layout();
        let mut before = SharedLayout::default();
        self.0.iter().map(move |of| {
            let place = RowOffsets { scene: before.scene, photo: all.scene + before.photo, all };
            before = before.and(of.layout());
            (of.as_ref(), place)
        })
    }

    /// Returns the range of an owner's rows among a photo's rows.
    pub(in crate::train) fn photo_rows(&self, name: &str) -> Option<Range<usize>> {
        let (of, place) = self.placed().find(|(of, _)| of.name() == name)?;
        let first = (place.photo - place.all.scene) as usize;
        Some(first..first + of.layout().photo as usize)
    }

    /// Returns the rows of a view among all rows.
    pub(in crate::train) fn view_range(&self, view: usize) -> Range<usize> {
        let rows = self.layout().view_rows(view);
        rows.start as usize..rows.end as usize
    }

    pub(in crate::train) fn rows(&self, views: usize) -> u32 {
        self.layout().count(views)
    }

    pub(in crate::train) fn start(&self, views: usize) -> Result<Vec<[f32; 4]>> {
        let mut rows = Vec::new();
        for of_view in std::iter::once(None).chain((0..views).map(Some)) {
            for of in &self.0 {
                let layout = of.layout();
                let wanted = if of_view.is_some() { layout.photo } else { layout.scene };
                rows.extend(checked(of.start(of_view), wanted, "start")?);
            }
        }
        Ok(rows)
    }

    pub(in crate::train) fn step_rows(&self, at: StepContext, view: usize) -> Result<Vec<SharedRow>> {
        let (mut rates, mut of_photo) = (Vec::new(), Vec::new());
        for of in &self.0 {
            let SharedLayout { scene, photo } = of.layout();
            let of_owner = checked(of.rates(at), scene + photo, "rates")?;
            let (of_scene, rest) = of_owner.split_at(scene as usize);
            rates.extend_from_slice(of_scene);
            of_photo.extend_from_slice(rest);
        }
        rates.extend(of_photo);
        Ok(self.layout().step_rows(view).zip(rates).map(|(row, rates)| SharedRow { row, rates }).collect())
    }

    pub(in crate::train) fn extensions(&self) -> Vec<Arc<dyn Extension>> {
        self.placed().map(|(of, place)| of.extension(place)).collect()
    }

    pub(in crate::train) fn saved_state(&self) -> Option<SharedState> {
        let names: Vec<&str> = self.0.iter().map(|of| of.name()).collect();
        (!names.is_empty()).then(|| SharedState { name: names.join(" and "), layout: self.layout() })
    }

    pub(in crate::train) fn check(&self, kept: Option<&SharedState>) -> Result<(), String> {
        let own = self.saved_state();
        let text = |kept: Option<&SharedState>| kept.map_or("none".to_owned(), ToString::to_string);
        if own.as_ref() == kept {
            return Ok(());
        }
        Err(format!("were {}, now there are {}", text(kept), text(own.as_ref())))
    }
}

fn checked(rows: Vec<[f32; 4]>, wanted: u32, what: &str) -> Result<Vec<[f32; 4]>> {
    match rows.len() == wanted as usize {
        true => Ok(rows),
        false => Err(Error::Bug(format!("{what} of shared parameters: {} rows, {wanted} expected", rows.len()))),
    }
}

/// The entry of the shared parameters in a checkpoint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SharedState {
    /// Name of the parameters.
    pub name: String,
    /// Number of their rows.
    pub layout: SharedLayout,
}

impl std::fmt::Display for SharedState {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} ({} rows of the scene, {} of each photo)", self.name, self.layout.scene, self.layout.photo)
    }
}
