//! The training views, at the size of each step.

use super::step_input::{StepInput, TrainView};
use super::{TrainConfig, free_space, poses};
use crate::scene::Camera;
use crate::scene::camera::side_at;
use crate::scheduler::plan::FRAMES_IN_FLIGHT;
use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

/// Number of sizes below the full one.
const SIZES: u32 = 8;

/// The training views. As a slice, those at full size.
#[derive(Debug)]
pub(super) struct Views {
    whole: Vec<TrainView>,
    /// Shrunk views that steps in flight use, by size and view.
    shrunk: BTreeMap<(u32, usize), TrainView>,
    /// Other views of each view, with free space on the way; empty without pruning of fog.
    partners: Vec<Vec<usize>>,
    free_space: bool,
    /// Refined camera of each view, for work between steps; empty without refinement.
    refined: Vec<Camera>,
    start: f64,
    full_from: u32,
}

impl Views {
    /// Makes the views of a training.
    pub(super) fn new(whole: Vec<TrainView>, config: &TrainConfig) -> Self {
        let (start, full_from) = (f64::from(config.start_size.unwrap_or(1.0)), config.full_size_from());
        Self {
            whole,
            shrunk: BTreeMap::new(),
            partners: Vec::new(),
            free_space: config.free_space,
            refined: Vec::new(),
            start,
            full_from,
        }
    }

    /// Sets the near plane of each view.
    pub(super) fn set_near_planes(&mut self, planes: &[f32]) {
        self.whole.iter_mut().zip(planes).for_each(|(view, &near)| view.near = near);
        if self.free_space {
            let cameras: Vec<&Camera> = self.whole.iter().map(|view| &view.camera).collect();
            self.partners = free_space::partners(&cameras, planes);
        }
    }

    /// Sets the refined cameras by the rows of their photos.
    pub(super) fn refine(&mut self, rows: &[Vec<[f32; 4]>]) {
        let refined = |(view, rows): (&TrainView, &Vec<_>)| poses::corrected(&view.camera, [rows[0], rows[1]]);
        self.refined = self.whole.iter().zip(rows).map(refined).collect();
    }

    /// Returns the refined cameras; none without refinement.
    pub(super) fn refined(&self) -> &[Camera] {
        &self.refined
    }

    /// Returns the camera of a view for work between steps.
    pub(super) fn camera(&self, view: usize) -> &Camera {
        self.refined.get(view).unwrap_or(&self.whole[view].camera)
    }

    /// Returns the camera to which the space is free in a step, and the near plane of all cameras on the way.
    pub(super) fn partner(&self, seed: u64, input: &StepInput) -> Option<(&Camera, f32)> {
        let partner = free_space::partner(seed, input.step, self.partners.get(input.view)?)?;
        Some((&self.whole[partner].camera, self.whole[partner].near.min(self.whole[input.view].near)))
    }

    /// Returns the number of the size of `step`, from 0; [`SIZES`] is the full one.
    fn size_at(&self, step: u32) -> u32 {
        if step < self.full_from {
            (u64::from(step) * u64::from(SIZES) / u64::from(self.full_from)) as u32
        } else {
            SIZES
        }
    }

    /// Returns the share of the full size of `step`. Sizes grow in equal ratios.
    pub(super) fn share_at(&self, step: u32) -> f64 {
        self.start.powf(1.0 - f64::from(self.size_at(step)) / f64::from(SIZES))
    }

    /// Returns an upper bound of the image size at `step`, given that of full size.
    pub(super) fn largest_at(&self, step: u32, full: (u32, u32)) -> (u32, u32) {
        let share = self.share_at(step);
        (side_at(full.0, share), side_at(full.1, share))
    }

    /// Makes the view of a step at the size of the step.
    pub(super) fn prepare(&mut self, step: u32, view: usize) {
        let size = self.size_at(step);
        // Steps in flight still use their sizes.
        let oldest = self.size_at(step.saturating_sub(FRAMES_IN_FLIGHT as u32));
        self.shrunk.retain(|&(kept, _), _| kept >= oldest);
        if size < SIZES && !self.shrunk.contains_key(&(size, view)) {
            let shrunk = self.whole[view].shrunk(self.share_at(step));
            self.shrunk.insert((size, view), shrunk);
        }
    }

    /// Returns the view of a step at the size of the step, which [`Self::prepare`] has made.
    pub(super) fn of(&self, input: &StepInput) -> &TrainView {
        self.shrunk.get(&(self.size_at(input.step), input.view)).unwrap_or(&self.whole[input.view])
    }
}

impl Deref for Views {
    type Target = [TrainView];

    fn deref(&self) -> &[TrainView] {
        &self.whole
    }
}

impl DerefMut for Views {
    fn deref_mut(&mut self) -> &mut [TrainView] {
        &mut self.whole
    }
}
