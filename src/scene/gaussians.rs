//! The model on the host: a structure of arrays, one row per Gaussian.

use super::UNLABELLED;
use crate::error::{Error, Result};
use crate::harmonics::coefficients;
use glam::{DMat3, DQuat, DVec3};

/// Largest opacity of a splat in a pixel (3DGS), as in `glsl/include/constants.glsl`.
pub const ALPHA_MAX: f64 = 0.99;

/// Returns the rotation matrix of a quaternion (w, x, y, z) of any length: its columns are the axes of the Gaussian.
pub fn axes_of(quat: [f32; 4]) -> DMat3 {
    let [w, x, y, z] = quat.map(f64::from);
    DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize())
}

/// Returns the opacity of a logit.
pub fn opacity_of(logit: f32) -> f64 {
    1.0 / (1.0 + (-f64::from(logit)).exp())
}

/// The Gaussians of a scene. Parameters are stored before activation, as in the standard 3DGS PLY.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gaussians {
    /// World position of the origin of `means`: 0 except in faraway scenes.
    pub origin: DVec3,
    /// Positions relative to `origin`, `[N, 3]`, world units.
    pub means: Vec<[f32; 3]>,
    /// Rotations (w, x, y, z), not necessarily of unit length, `[N, 4]`.
    pub quats: Vec<[f32; 4]>,
    /// Natural logarithms of the standard deviations, `[N, 3]`.
    pub scales: Vec<[f32; 3]>,
    /// Opacities before the sigmoid, `[N]`.
    pub opacities: Vec<f32>,
    /// Colour coefficients of degree 0 (r, g, b), `[N, 3]`.
    pub sh0: Vec<[f32; 3]>,
    /// Coefficients above degree 0 as triples (r, g, b), `[N, coefficients - 1, 3]`: 0, 3, 8 or 15 triples per
    /// Gaussian.
    pub sh_rest: Vec<[f32; 3]>,
    /// Degree of the spherical harmonics, 0 to 3.
    pub sh_degree: u32,
    /// Whether the dilation of a splat lowers its opacity, so that its total light stays the same (2-D filter of
    /// Mip-Splatting). Otherwise, small and distant Gaussians are too bright in renders.
    pub antialiased: bool,
    /// Object ids, `[N]`, 0 = unlabelled; `None` in a scene without labels.
    pub labels: Option<Vec<u32>>,
    /// Confidence of each label, `[N]`, 0 to 1: its share of the votes; `None` without votes.
    pub label_confidence: Option<Vec<f32>>,
}

impl Gaussians {
    /// Returns the number of Gaussians.
    pub fn len(&self) -> usize {
        self.means.len()
    }

    /// Returns the world position of a Gaussian.
    pub fn world(&self, row: usize) -> DVec3 {
        self.origin + DVec3::from_array(self.means[row].map(f64::from))
    }

    /// Returns the opacity of a Gaussian, after the sigmoid.
    pub fn opacity(&self, row: usize) -> f64 {
        opacity_of(self.opacities[row])
    }

    /// Returns the label of a Gaussian; 0 in a model without labels.
    pub fn label(&self, row: usize) -> u32 {
        self.labels.as_ref().map_or(UNLABELLED, |labels| labels[row])
    }

    /// Returns true if there are no Gaussians.
    pub fn is_empty(&self) -> bool {
        self.means.is_empty()
    }

    /// Returns the number of coefficients per Gaussian and channel above degree 0: 0, 3, 8 or 15.
    pub fn rest_per_gaussian(&self) -> usize {
        coefficients(self.sh_degree)
    }

    /// Returns the coefficients of a Gaussian above degree 0, as triples (r, g, b).
    pub fn rest(&self, row: usize) -> &[[f32; 3]] {
        let rest = self.rest_per_gaussian();
        &self.sh_rest[row * rest..][..rest]
    }

    /// Returns the coefficients above degree 0 of a Gaussian, mutably.
    pub fn rest_mut(&mut self, row: usize) -> &mut [[f32; 3]] {
        let rest = self.rest_per_gaussian();
        &mut self.sh_rest[row * rest..][..rest]
    }

    /// Errors unless all columns have the right length.
    pub fn check(&self) -> Result<()> {
        let (count, rest) = (self.len(), self.len() * self.rest_per_gaussian());
        let columns = [
            ("quats", self.quats.len(), count),
            ("scales", self.scales.len(), count),
            ("opacities", self.opacities.len(), count),
            ("sh0", self.sh0.len(), count),
            ("sh_rest", self.sh_rest.len(), rest),
            ("labels", self.labels.as_ref().map_or(count, Vec::len), count),
            ("label_confidence", self.label_confidence.as_ref().map_or(count, Vec::len), count),
        ];
        let Some((name, has, needs)) = columns.into_iter().find(|&(_, has, needs)| has != needs) else {
            return Ok(());
        };
        let problem = format!("{has} rows of {count} Gaussians of SH degree {}; expected {needs}", self.sh_degree);
        Err(Error::usage(format!("Gaussians::{name}"), problem))
    }

    /// Returns true if all values of a row are finite.
    pub fn is_finite(&self, row: usize) -> bool {
        let triples = [self.means[row], self.scales[row], self.sh0[row]];
        triples.iter().chain(self.rest(row)).all(|t| t.iter().all(|v| v.is_finite()))
            && self.quats[row].iter().all(|v| v.is_finite())
            && self.opacities[row].is_finite()
    }

    /// Raises the degree of the spherical harmonics; new coefficients are 0. A lower degree has no effect.
    pub fn raise_degree(&mut self, sh_degree: u32) {
        let before = self.rest_per_gaussian();
        self.sh_degree = self.sh_degree.max(sh_degree);
        let after = self.rest_per_gaussian();
        if after == before {
            return;
        }
        let mut rest = vec![[0.0; 3]; self.len() * after];
        for row in 0..self.len() {
            rest[row * after..][..before].copy_from_slice(&self.sh_rest[row * before..][..before]);
        }
        self.sh_rest = rest;
    }

    /// Appends the rows of a model with the same columns and origin. Drops labels if this model has none.
    pub fn append(&mut self, other: Self) {
        self.means.extend(other.means);
        self.quats.extend(other.quats);
        self.scales.extend(other.scales);
        self.opacities.extend(other.opacities);
        self.sh0.extend(other.sh0);
        self.sh_rest.extend(other.sh_rest);
        self.labels.iter_mut().for_each(|to| to.extend(other.labels.iter().flatten()));
        self.label_confidence.iter_mut().for_each(|to| to.extend(other.label_confidence.iter().flatten()));
    }

    /// Returns the rows for which `keep` is true, in order.
    pub fn filtered(&self, mut keep: impl FnMut(usize) -> bool) -> Self {
        self.picked(&(0..self.len()).filter(|&row| keep(row)).collect::<Vec<_>>())
    }

    /// Returns the given rows in the given order.
    pub fn picked(&self, rows: &[usize]) -> Self {
        Self {
            origin: self.origin,
            means: rows.iter().map(|&r| self.means[r]).collect(),
            quats: rows.iter().map(|&r| self.quats[r]).collect(),
            scales: rows.iter().map(|&r| self.scales[r]).collect(),
            opacities: rows.iter().map(|&r| self.opacities[r]).collect(),
            sh0: rows.iter().map(|&r| self.sh0[r]).collect(),
            sh_rest: rows.iter().flat_map(|&r| self.rest(r)).copied().collect(),
            sh_degree: self.sh_degree,
            antialiased: self.antialiased,
            labels: self.labels.as_ref().map(|labels| rows.iter().map(|&r| labels[r]).collect()),
            label_confidence: self.label_confidence.as_ref().map(|shares| rows.iter().map(|&r| shares[r]).collect()),
        }
    }
}
