//! Tests whether points and photos share a frame: the share of the points that the cameras see, and whether the nearest
//! of them match the colours of their pixels.

use super::{Camera, Photo, Point, View};
use crate::error::Result;
use crate::view::ALPHA_CLEAR;
use glam::DVec2;
use std::sync::Arc;

/// Most views that are compared. With [`POINTS_MAX`] points, shares are known to a thousandth within milliseconds.
const VIEWS_MAX: usize = 24;
/// Most points that are compared.
const POINTS_MAX: usize = 20_000;
/// Cells per side of a photo. In each cell, the nearest point hides the others.
const CELLS_PER_SIDE: usize = 48;
/// Fewest points that are compared with pixels.
const PAIRS_MIN: usize = 300;
/// Smallest standard deviation of colours, of 255, that distinguishes places.
const CONTRAST_MIN: f64 = 6.0;

/// A sample of a scene's views and points, or of a model's Gaussians as points.
pub struct Sample {
    views: Vec<(Camera, Option<Arc<Photo>>)>,
    points: Vec<Point>,
}

/// How well the points of a sample fit its views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Mean share of the points in front of a camera.
    pub in_front: f64,
    /// Mean share of the points inside a camera's image.
    pub in_picture: f64,
    /// The same for the median view.
    pub in_median_picture: f64,
    /// Correlation between the colours of points and pixels, both relative to their means in a view. `None` without
    /// photos, or with too few pairs or too little contrast.
    pub colour: Option<f64>,
}

impl Sample {
    /// Samples the views and points. Reads photos that are not in memory.
    pub fn new(views: &[&View], points: impl ExactSizeIterator<Item = Point>) -> Result<Self> {
        let some = views.iter().step_by(views.len().div_ceil(VIEWS_MAX).max(1));
        let view = |view: &&View| {
            let photo = view.photo.as_ref().map(|photo| photo.get()).transpose()?;
            Ok((view.camera.clone(), photo))
        };
        let every = points.len().div_ceil(POINTS_MAX).max(1);
        Ok(Self { views: some.map(view).collect::<Result<_>>()?, points: points.step_by(every).collect() })
    }

    /// Returns the number of points.
    pub fn point_count(&self) -> usize {
        self.points.len()
    }

    /// Returns true if a camera sees none of the points.
    pub fn is_unseen(&self, camera: &Camera) -> bool {
        self.points.iter().all(|point| camera.sees(point.position).is_none())
    }

    /// Compares points and views after applying `change` to each camera.
    pub fn agreement(&self, change: impl Fn(&mut Camera)) -> Agreement {
        let mut pairs: Vec<[f64; 6]> = Vec::new();
        let (mut front, mut shares) = (0, Vec::with_capacity(self.views.len()));
        for (camera, photo) in &self.views {
            let mut camera = camera.clone();
            change(&mut camera);
            let mut nearest: Vec<Option<(f64, DVec2, [u8; 3])>> = vec![None; CELLS_PER_SIDE * CELLS_PER_SIDE];
            let mut inside = 0;
            for point in &self.points {
                let at = camera.to_camera(point.position);
                front += usize::from(at.z > 0.0);
                let Some(pixel) = camera.sees(point.position) else { continue };
                inside += 1;
                let cell = |at: f64, side: u32| {
                    ((at / f64::from(side) * CELLS_PER_SIDE as f64) as usize).min(CELLS_PER_SIDE - 1)
                };
                let cell = &mut nearest[cell(pixel.y, camera.height) * CELLS_PER_SIDE + cell(pixel.x, camera.width)];
                if cell.is_none_or(|(depth, ..)| at.z < depth) {
                    *cell = Some((at.z, pixel, point.colour));
                }
            }
            shares.push(inside as f64 / self.points.len().max(1) as f64);
            if let Some(photo) = photo {
                pairs.extend(view_colours(photo, nearest.into_iter().flatten()));
            }
        }
        shares.sort_unstable_by(f64::total_cmp);
        let all = (self.views.len() * self.points.len()).max(1) as f64;
        Agreement {
            in_front: front as f64 / all,
            in_picture: shares.iter().sum::<f64>() / shares.len().max(1) as f64,
            in_median_picture: shares.get(shares.len() / 2).copied().unwrap_or(0.0),
            colour: correlation(&pairs),
        }
    }
}

/// Returns the colours of points and of their pixels, relative to the view's means.
fn view_colours(photo: &Photo, nearest: impl Iterator<Item = (f64, DVec2, [u8; 3])>) -> Vec<[f64; 6]> {
    let pair = |(_, pixel, [r, g, b]): (f64, DVec2, [u8; 3])| {
        let (x, y) = ((pixel.x as u32).min(photo.width - 1), (pixel.y as u32).min(photo.height - 1));
        let [pr, pg, pb, alpha] = photo.rgba[(y * photo.width + x) as usize];
        (alpha > 0 && alpha != ALPHA_CLEAR).then(|| [r, g, b, pr, pg, pb].map(f64::from))
    };
    let mut pairs: Vec<[f64; 6]> = nearest.filter_map(pair).collect();
    for column in 0..6 {
        let mean = pairs.iter().map(|pair| pair[column]).sum::<f64>() / pairs.len().max(1) as f64;
        pairs.iter_mut().for_each(|pair| pair[column] -= mean);
    }
    pairs
}

fn correlation(pairs: &[[f64; 6]]) -> Option<f64> {
    if pairs.len() < PAIRS_MIN {
        return None;
    }
    let sum = |of: fn(f64, f64) -> f64| -> f64 {
        pairs.iter().map(|pair| (0..3).map(|channel| of(pair[channel], pair[3 + channel])).sum::<f64>()).sum()
    };
    let (points, pixels, both) = (sum(|a, _| a * a), sum(|_, b| b * b), sum(|a, b| a * b));
    let least = CONTRAST_MIN.powi(2) * 3.0 * pairs.len() as f64;
    (points > least && pixels > least).then(|| both / (points * pixels).sqrt())
}
