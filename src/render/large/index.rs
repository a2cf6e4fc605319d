//! Host-side index of a large model: enough data per Gaussian to decide whether a view may show it.

use crate::error::{Error, Result};
use crate::formats::{ModelRef, Row};
use crate::scene::UNLABELLED;
use crate::scene::gaussians::opacity_of;
use crate::scene::origin::far_origin;
use crate::shaders::constants::ALPHA_MIN;
use crate::shaders::constants::exact::COV2D_BLUR;
use crate::shaders::structs::StepUniforms;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Bound on the rounding errors of 32-bit floats in projection, as a share of the distance to the camera.
const ROUNDING_SHARE_MAX: f64 = 1e-5;
/// Doubled margin of the cull pass: factor of the splat radius.
const CULL_RADIUS_FACTOR: f64 = 1.002;
/// Doubled margin of the cull pass, px.
const CULL_MARGIN_PX: f64 = 1.0;
/// Reach of a Gaussian that is never visible.
const UNSEEN_REACH: f32 = -1.0;

/// Positions, reaches and labels of the Gaussians to draw, 25 bytes each.
#[derive(Clone, Debug, Default)]
pub struct GaussianIndex {
    /// World position that `means` are relative to, and its distance from the model's origin.
    pub(super) origin: DVec3,
    pub(super) far: DVec3,
    means: Vec<Vec3>,
    /// Distance at which alpha falls to its minimum along the longest axis, before blur, world units.
    reaches: Vec<f32>,
    labels: Option<Vec<u32>>,
    /// True for Gaussians that are drawn when their object is shown alone.
    sure: Vec<bool>,
    /// Row indices in the model.
    numbers: Vec<u32>,
}

impl GaussianIndex {
    /// Indexes the Gaussians of a model that `keep` accepts by label and confidence. Gaussians with a confidence below
    /// `least` are not drawn when an object is shown alone. Also returns notes for the user.
    pub fn new(model: ModelRef, least: f32, keep: impl Fn(u32, Option<f32>) -> bool) -> Result<(Self, Vec<String>)> {
        if i32::try_from(model.count()).is_err() {
            let problem = format!(
                "has {} Gaussians, but at most {} can be drawn; use a part of the model",
                model.count(),
                i32::MAX
            );
            return Err(Error::usage("model", problem));
        }
        let mut index = Self { labels: model.has_labels().then(Vec::new), ..Self::default() };
        let notes = model.scan(|number, row| {
            let label = row.label.unwrap_or(UNLABELLED);
            if keep(label, row.confidence) {
                index.means.push(DVec3::from_array(row.position).as_vec3());
                index.reaches.push(reach(row));
                if let Some(labels) = &mut index.labels {
                    labels.push(label);
                }
                index.sure.push(row.confidence.is_none_or(|share| share >= least));
                index.numbers.push(number as u32);
            }
        })?;
        if let ModelRef::Stored(_) = model {
            index.far = far_origin(&index.means);
            let far = index.far;
            index.means.iter_mut().for_each(|mean| *mean = (mean.as_dvec3() - far).as_vec3());
        }
        index.origin = model.origin() + index.far;
        Ok((index, notes))
    }

    /// Returns true if there are no Gaussians.
    pub fn is_empty(&self) -> bool {
        self.means.is_empty()
    }

    /// Returns the world positions of the Gaussians.
    #[cfg(feature = "cli")]
    pub(crate) fn places(&self) -> impl Iterator<Item = DVec3> + Clone {
        self.means.iter().map(|mean| self.origin + mean.as_dvec3())
    }

    /// Labels of the Gaussians.
    pub(crate) fn labels(&self) -> Option<&[u32]> {
        self.labels.as_deref()
    }

    /// Returns true if any of these objects has a Gaussian to draw alone.
    pub(super) fn has_objects(&self, labels: &[u32]) -> bool {
        self.labels.iter().flatten().zip(&self.sure).any(|(own, &sure)| sure && labels.contains(own))
    }

    /// Returns the sorted indices of the Gaussians that a picture may show, of all or of some objects alone.
    pub(super) fn seen(&self, uniforms: &StepUniforms, only: Option<&[u32]>) -> Vec<u32> {
        let sight = CullCamera::new(uniforms);
        let shows = |at: usize| match (only, &self.labels) {
            (None, _) => true,
            (Some(only), Some(labels)) => self.sure[at] && only.contains(&labels[at]),
            (Some(_), None) => false,
        };
        let all = 0..self.means.len() as u32;
        let seen = |&at: &u32| shows(at as usize) && sight.sees(self.means[at as usize], self.reaches[at as usize]);
        all.into_par_iter().filter(seen).collect()
    }

    /// Returns the model rows of these indices.
    pub(super) fn numbers<'a>(&'a self, of: &'a [u32]) -> impl Iterator<Item = u64> + 'a {
        of.iter().map(|&at| u64::from(self.numbers[at as usize]))
    }
}

/// Returns the reach of a Gaussian, world units.
fn reach(row: &Row) -> f32 {
    let squared = 2.0 * (opacity_of(row.opacity) / f64::from(ALPHA_MIN)).ln();
    // The device rounds opacities differently.
    if squared < -1e-3 {
        return UNSEEN_REACH;
    }
    let longest = row.scale.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    (f64::from(longest).exp() * (squared.max(0.0) + 1e-3).sqrt()) as f32
}

/// A camera, as the cull pass sees it (glsl/project/cull.comp).
struct CullCamera {
    rows: [DVec3; 3],
    centre: DVec3,
    near: f64,
    /// Focal length, principal point, size in px, and the largest slope, along x and y.
    axes: [[f64; 4]; 2],
}

impl CullCamera {
    fn new(u: &StepUniforms) -> Self {
        let axis = |focal: f32, principal: f32, size: u32, low: f32, high: f32| {
            [f64::from(focal), f64::from(principal), f64::from(size), f64::from(low.abs().max(high.abs()))]
        };
        Self {
            rows: [u.view_row0, u.view_row1, u.view_row2].map(|row| Vec3::from_array(row).as_dvec3()),
            centre: Vec3::from_array(u.camera_centre).as_dvec3(),
            near: f64::from(u.near),
            axes: [
                axis(u.fx, u.cx, u.width, u.clamp_x_min, u.clamp_x_max),
                axis(u.fy, u.cy, u.height, u.clamp_y_min, u.clamp_y_max),
            ],
        }
    }

    /// Returns true if the cull pass may keep a Gaussian. All lengths are multiplied by depth, so that rounding errors
    /// are not divided by a small depth.
    fn sees(&self, mean: Vec3, reach: f32) -> bool {
        if reach == UNSEEN_REACH {
            return false;
        }
        let from = mean.as_dvec3() - self.centre;
        let [x, y, z] = self.rows.map(|row| row.dot(from));
        let rounding = ROUNDING_SHARE_MAX * (from.length() + self.near);
        if z <= self.near - rounding {
            return false;
        }
        let depth = z.max(0.0);
        // Largest variance that blur adds, for an opaque splat.
        let blur = COV2D_BLUR * 2.0 * (1.0 / f64::from(ALPHA_MIN)).ln() * depth * depth;
        [x, y].into_iter().zip(&self.axes).all(|(along, &[focal, principal, size, slope])| {
            let stretch = focal * f64::from(reach);
            let radius = (stretch * stretch * (1.0 + slope * slope) + blur).sqrt() * CULL_RADIUS_FACTOR
                + CULL_MARGIN_PX * depth
                + rounding * (focal + principal.abs() + size);
            let centre = focal * along + principal * depth;
            centre + radius >= 0.0 && centre - radius <= size * depth
        })
    }
}
