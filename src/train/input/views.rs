//! The training views, at each step's size.

use super::free_space;
use super::part::PhotoPart;
use super::prefetch::{Prefetch, Request, StepPixels};
use super::step_input::{self, StepInput, StepView, TrainView};
use crate::error::{Error, Result};
use crate::label::vote::ballot::Voter;
use crate::scene::Camera;
use crate::scene::camera::side_at;
use crate::scheduler::DataKey;
use crate::train::TrainConfig;
use crate::train::shared::poses;
use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// Number of sizes below full size.
const SMALLER_SIZES: u32 = 8;

/// The training views. Derefs to a slice of views at full size.
#[derive(Debug)]
pub(in crate::train) struct Views {
    whole: Vec<TrainView>,
    /// Photo parts that steps train on.
    parts: Vec<PhotoPart>,
    /// Downscaled in-memory photos, by size and part, kept while steps in flight use the size.
    shrunk: BTreeMap<(u32, usize), Arc<StepPixels>>,
    /// Pixels of the steps in flight.
    ready: BTreeMap<u32, Arc<StepPixels>>,
    /// Prefetched pixels of the next steps, for photos that are not in memory.
    prefetch: Prefetch,
    /// Partner views of each view, with free space between them; empty without fog pruning.
    partners: Vec<Vec<usize>>,
    free_space: bool,
    /// Refined camera of each view, for jobs between steps; empty without refinement.
    refined: Vec<Camera>,
    start: f64,
    full_from: u32,
    /// First step without known depths.
    depths_until: u32,
    /// Most steps in flight.
    frames: u32,
}

impl Views {
    pub(in crate::train) fn new(
        (whole, parts): (Vec<TrainView>, Vec<PhotoPart>),
        config: &TrainConfig,
        frames: usize,
    ) -> Self {
        let (start, full_from) = (f64::from(config.start_size.unwrap_or(1.0)), config.full_size_from());
        let prefetch = Prefetch::new(&whole, config.iterations);
        Self {
            whole,
            parts,
            shrunk: BTreeMap::new(),
            ready: BTreeMap::new(),
            prefetch,
            partners: Vec::new(),
            free_space: config.free_space,
            refined: Vec::new(),
            start,
            full_from,
            depths_until: config.depths_until(),
            frames: frames as u32,
        }
    }

    pub(in crate::train) fn set_near_planes(&mut self, planes: &[f32]) {
        self.whole.iter_mut().zip(planes).for_each(|(view, &near)| view.near = near);
        if self.free_space {
            let cameras: Vec<&Camera> = self.whole.iter().map(|view| &view.camera).collect();
            self.partners = free_space::partners(&cameras, planes);
        }
    }

    /// Sets the refined cameras from their photos' rows.
    pub(in crate::train) fn refine(&mut self, rows: &[Vec<[f32; 4]>]) {
        let refined = |(view, rows): (&TrainView, &Vec<_>)| poses::corrected(&view.camera, rows);
        self.refined = self.whole.iter().zip(rows).map(refined).collect();
    }

    /// Returns the refined cameras; empty without refinement.
    pub(in crate::train) fn refined(&self) -> &[Camera] {
        &self.refined
    }

    /// Returns the camera of a view for jobs between steps.
    pub(in crate::train) fn camera(&self, view: usize) -> &Camera {
        self.refined.get(view).unwrap_or(&self.whole[view].camera)
    }

    /// Returns the views with masks, for votes between steps.
    pub(in crate::train) fn voters(&self) -> Vec<Voter<'_>> {
        let voters = self.whole.iter().enumerate().filter_map(|(index, view)| {
            let mask = view.mask.as_ref()?;
            Some(Voter { camera: self.camera(index), mask, photo: Some(&view.photo), trust: None })
        });
        voters.collect()
    }

    /// Returns the photo parts, one per step.
    pub(in crate::train) fn parts(&self) -> &[PhotoPart] {
        &self.parts
    }

    /// Restricts object layers to these objects.
    pub(in crate::train) fn show_only(&mut self, is_meant: impl Fn(&u16) -> bool) {
        self.parts.iter_mut().for_each(|part| part.objects.retain(&is_meant));
    }

    pub(in crate::train) fn index(&self, input: &StepInput) -> usize {
        self.parts[input.part].view
    }

    /// Returns the partner camera of a step, and the near plane of all cameras between the two.
    pub(in crate::train) fn partner(&self, seed: u64, input: &StepInput) -> Option<(&Camera, f32)> {
        let view = self.index(input);
        let partner = free_space::partner(seed, input.step, self.partners.get(view)?)?;
        Some((&self.whole[partner].camera, self.whole[partner].near.min(self.whole[view].near)))
    }

    /// Returns the size index of `step`, from 0; [`SMALLER_SIZES`] is full size.
    fn size_at(&self, step: u32) -> u32 {
        if step < self.full_from {
            (u64::from(step) * u64::from(SMALLER_SIZES) / u64::from(self.full_from)) as u32
        } else {
            SMALLER_SIZES
        }
    }

    /// Returns the share of the full size of `step`. Sizes grow in equal ratios.
    pub(in crate::train) fn share_at(&self, step: u32) -> f64 {
        self.start.powf(1.0 - f64::from(self.size_at(step)) / f64::from(SMALLER_SIZES))
    }

    /// Returns an upper bound of the image size at `step`, given that of full size.
    pub(in crate::train) fn largest_at(&self, step: u32, full: (u32, u32)) -> (u32, u32) {
        let share = self.share_at(step);
        (side_at(full.0, share), side_at(full.1, share))
    }

    /// Prepares a step's pixels at its size, and prefetches those of `next`, the parts of the following steps.
    pub(in crate::train) fn prepare(&mut self, step: u32, part: usize, next: &[usize]) -> Result<()> {
        // Steps in flight still use their pixels and sizes.
        let oldest = step.saturating_sub(self.frames);
        let oldest_size = self.size_at(oldest);
        self.ready.retain(|&kept, _| kept >= oldest && kept < step);
        self.shrunk.retain(|&(kept, _), _| kept >= oldest_size);
        let key = (self.size_at(step), part);
        let ready = match self.shrunk.get(&key) {
            Some(ready) => Arc::clone(ready),
            None => {
                let request = self.request(step, part);
                Arc::new(self.prefetch.take(request)?)
            }
        };
        let is_held = |part: usize| self.whole[self.parts[part].view].photo.is_held();
        if key.0 < SMALLER_SIZES && is_held(part) {
            self.shrunk.insert(key, Arc::clone(&ready));
        }
        self.ready.insert(step, ready);
        let waiting: Vec<(u32, usize)> =
            (step + 1..).zip(next.iter().copied()).filter(|&(_, part)| !is_held(part)).collect();
        for (step, part) in waiting {
            let request = self.request(step, part);
            self.prefetch.begin(request);
        }
        Ok(())
    }

    /// Returns the number of steps to prefetch.
    pub(in crate::train) fn steps_ahead(&self) -> usize {
        self.prefetch.steps()
    }

    /// Returns the request for the pixels of the part with this index, at a step's size.
    fn request(&self, step: u32, index: usize) -> Request {
        let part = &self.parts[index];
        let view = &self.whole[part.view];
        let is_small = self.size_at(step) < SMALLER_SIZES;
        Request {
            step,
            index,
            band: part.band,
            photo: view.photo.clone(),
            full: (!is_small).then(|| (view.view_labels.clone(), part.valid_pixels)),
            depths: (step < self.depths_until).then(|| view.depths.clone()),
            camera: if is_small { part.camera.shrunk(self.share_at(step)) } else { part.camera.clone() },
        }
    }

    /// Returns a step's view at its size, as prepared by [`Self::prepare`].
    pub(in crate::train) fn step_view(&self, input: &StepInput) -> Result<StepView<'_>> {
        let missing = || Error::Bug(format!("step {} came without its pixels", input.step));
        let (part, ready) = (&self.parts[input.part], self.ready.get(&input.step).ok_or_else(missing)?);
        let view = &self.whole[part.view];
        Ok(StepView {
            key: Some(DataKey { round: self.size_at(input.step), item: input.part as u32 }),
            camera: &ready.camera,
            whole: part.whole.as_ref(),
            near: view.near,
            // For the whole photo at full size, whatever the step's size.
            finest: step_input::finest(&view.camera),
            photo: &ready.photo,
            valid_pixels: ready.valid_pixels,
            view_labels: &ready.view_labels,
            depths: &ready.depths,
            shown: &part.shown,
            occluders: &view.occluders,
        })
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
