//! The engine with the visible part of a finished model.

use super::painter::Source;
use crate::edit::change::mix_in;
use crate::edit::select::MIN_LABEL_CONFIDENCE;
use crate::engine::Engine;
use crate::error::Result;
use crate::render::{Parts, Render, RenderOptions, render};
use crate::scene::harmonics::sh0_of;
use crate::scene::{Camera, Gaussians};
use std::collections::BTreeSet;

/// Colour of selected Gaussians, r, g, b, and its share.
const SELECTION_COLOUR: ([f64; 3], f32) = ([1.0, 0.55, 0.05], 0.7);

/// The choice of visible labels.
#[derive(Clone, Debug, Default)]
pub(super) struct Visibility {
    /// All but these.
    pub(super) hidden: Vec<u32>,
    /// If there are some, these alone.
    pub(super) solo: Vec<u32>,
}

impl Visibility {
    pub(super) fn is_whole(&self) -> bool {
        self.hidden.is_empty() && self.solo.is_empty()
    }

    /// Forgets labels that are gone.
    pub(super) fn retain(&mut self, model: &Gaussians) {
        let there: BTreeSet<u32> = (0..model.len()).map(|row| model.label(row)).collect();
        self.hidden.retain(|label| there.contains(label));
        self.solo.retain(|label| there.contains(label));
    }

    /// Returns for each row whether it is drawn, as rendering without the hidden labels or only the chosen ones does.
    pub(super) fn rows(&self, model: &Gaussians) -> Vec<bool> {
        let solo: BTreeSet<u32> = self.solo.iter().copied().collect();
        let hidden: BTreeSet<u32> = self.hidden.iter().copied().collect();
        let is_sure = |row: usize| model.label_confidence.as_ref().is_none_or(|all| all[row] >= MIN_LABEL_CONFIDENCE);
        let is_drawn = |row: usize| {
            let label = model.label(row);
            if solo.is_empty() { !hidden.contains(&label) } else { solo.contains(&label) && is_sure(row) }
        };
        (0..model.len()).map(is_drawn).collect()
    }
}

/// The engine with the drawn part of the model.
pub(super) struct Drawing {
    pub(super) engine: Engine,
    pub(super) options: RenderOptions,
    confidence: Option<Vec<f32>>,
    /// Row of the model by row of the drawn part; none if all are drawn.
    rows: Option<Vec<usize>>,
    /// Nothing is drawn.
    is_blank: bool,
}

impl Drawing {
    pub(super) fn new(engine: Engine, options: RenderOptions, model: &Gaussians) -> Self {
        let confidence = model.label_confidence.clone();
        Self { engine, options, confidence, rows: None, is_blank: model.is_empty() }
    }

    /// Puts some rows of a model on the device, the chosen ones in a colour of their own.
    pub(super) fn show(&mut self, model: &Gaussians, is_drawn: &[bool], is_chosen: &[bool]) -> Result<()> {
        let rows: Vec<usize> = (0..model.len()).filter(|&row| is_drawn[row]).collect();
        self.is_blank = rows.is_empty();
        if self.is_blank {
            return Ok(());
        }
        let is_whole = rows.len() == model.len();
        if is_whole && !is_chosen.contains(&true) {
            self.engine.upload_model(model)?;
            (self.confidence, self.rows) = (model.label_confidence.clone(), None);
            return Ok(());
        }
        let mut part = model.picked(&rows);
        let (colour, share) = (SELECTION_COLOUR.0.map(sh0_of), SELECTION_COLOUR.1);
        for (drawn, _) in rows.iter().enumerate().filter(|(_, row)| is_chosen[**row]) {
            mix_in(&mut part, drawn, colour, share);
        }
        self.engine.upload_model(&part)?;
        self.confidence = part.label_confidence;
        self.rows = (!is_whole).then_some(rows);
        Ok(())
    }
}

impl Source for Drawing {
    fn render(&mut self, camera: &Camera, parts: Parts) -> Result<Render> {
        if self.is_blank {
            return Ok(blank(camera, parts, self.options.background));
        }
        self.engine.grow_image(camera.width, camera.height)?;
        render(&mut self.engine, camera, &RenderOptions { parts, ..self.options })
    }

    fn confidence(&self) -> Option<&[f32]> {
        self.confidence.as_deref()
    }

    fn row(&self, drawn: usize) -> usize {
        self.rows.as_ref().map_or(drawn, |rows| rows[drawn])
    }

    fn largest(&mut self) -> Option<(u32, u32)> {
        None
    }

    fn step(&self) -> u32 {
        0
    }
}

/// An image of nothing.
fn blank(camera: &Camera, parts: Parts, background: [f32; 3]) -> Render {
    let pixels = camera.width as usize * camera.height as usize;
    let count = |asked: bool| if asked { pixels } else { 0 };
    Render {
        width: camera.width,
        height: camera.height,
        rgb: vec![background; pixels],
        alpha: vec![0.0; pixels],
        depth: vec![0.0; count(parts.depth)],
        top_id: vec![-1; count(parts.main)],
        top_weight: vec![0.0; count(parts.main)],
        labels: vec![0; count(parts.labels)],
    }
}
