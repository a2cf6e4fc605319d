//! Rows of parameters; gradients and moments use the same rows.

use labelgs_scene::Gaussians;
use std::ops::Range;

/// Floats per Gaussian.
pub const ROW_FLOATS: usize = 59;

/// The parameters of one Gaussian before activation (or their gradients, or their moments).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// World position.
    pub mean: [f64; 3],
    /// Rotation (w, x, y, z), of any length above 0.
    pub quat: [f64; 4],
    /// Natural logarithms of the standard deviations.
    pub scale: [f64; 3],
    /// Logit of the opacity.
    pub opacity: f64,
    /// Colour coefficients (r, g, b); those above the active degree are ignored.
    pub sh: [[f64; 3]; 16],
}

/// A range of a row's floats that the engine keeps in one buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Position.
    Means,
    /// Rotation.
    Quats,
    /// Log-scales.
    Scales,
    /// Opacity logit.
    Opacities,
    /// Degree 0.
    Sh0,
    /// Degree 1.
    Sh1,
    /// Degree 2.
    Sh2,
    /// Degree 3.
    Sh3,
}

impl Group {
    /// All groups, in row order.
    pub const ALL: [Self; 8] =
        [Self::Means, Self::Quats, Self::Scales, Self::Opacities, Self::Sh0, Self::Sh1, Self::Sh2, Self::Sh3];

    /// Range of the group in `Row::floats`.
    pub fn range(self) -> Range<usize> {
        match self {
            Self::Means => 0..3,
            Self::Quats => 3..7,
            Self::Scales => 7..10,
            Self::Opacities => 10..11,
            Self::Sh0 => 11..14,
            Self::Sh1 => 14..23,
            Self::Sh2 => 23..38,
            Self::Sh3 => 38..59,
        }
    }
}

impl Row {
    /// mean, quat, scale, opacity, sh (coefficient-major).
    pub fn floats(&self) -> [f64; ROW_FLOATS] {
        let mut out = [0.0; ROW_FLOATS];
        out[0..3].copy_from_slice(&self.mean);
        out[3..7].copy_from_slice(&self.quat);
        out[7..10].copy_from_slice(&self.scale);
        out[10] = self.opacity;
        out[11..].copy_from_slice(self.sh.as_flattened());
        out
    }

    /// The inverse of `floats`.
    pub fn from_floats(floats: &[f64; ROW_FLOATS]) -> Self {
        let mut row = Self { opacity: floats[10], ..Self::default() };
        row.mean.copy_from_slice(&floats[0..3]);
        row.quat.copy_from_slice(&floats[3..7]);
        row.scale.copy_from_slice(&floats[7..10]);
        row.sh.as_flattened_mut().copy_from_slice(&floats[11..]);
        row
    }

    /// The sum of two rows.
    pub fn plus(&self, other: &Self) -> Self {
        let (mut floats, others) = (self.floats(), other.floats());
        floats.iter_mut().zip(others).for_each(|(a, b)| *a += b);
        Self::from_floats(&floats)
    }
}

/// All floats of all rows, `[N, ROW_FLOATS]`.
pub fn floats(rows: &[Row]) -> Vec<f64> {
    rows.iter().flat_map(Row::floats).collect()
}

/// One group of all rows, `[N, group]`.
pub fn flatten(rows: &[Row], group: Group) -> Vec<f64> {
    rows.iter().flat_map(|row| row.floats()[group.range()].to_vec()).collect()
}

/// Gaussians with their labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Parameters, `[N]`.
    pub rows: Vec<Row>,
    /// Object ids, `[N]`; 0 = unlabelled.
    pub labels: Vec<u32>,
    /// Active degree of the spherical harmonics, 0 to 3.
    pub sh_degree: u32,
}

impl Model {
    /// Widens the same numbers to f64.
    pub fn from_gaussians(gaussians: &Gaussians) -> Self {
        let rest = gaussians.rest_per_gaussian();
        let row = |i: usize| {
            let mut sh = [[0.0; 3]; 16];
            sh[0] = gaussians.sh0[i].map(f64::from);
            for k in 0..rest {
                sh[k + 1] = gaussians.sh_rest[i * rest + k].map(f64::from);
            }
            Row {
                mean: gaussians.means[i].map(f64::from),
                quat: gaussians.quats[i].map(f64::from),
                scale: gaussians.scales[i].map(f64::from),
                opacity: f64::from(gaussians.opacities[i]),
                sh,
            }
        };
        Self {
            rows: (0..gaussians.len()).map(row).collect(),
            labels: gaussians.labels.clone().unwrap_or_else(|| vec![0; gaussians.len()]),
            sh_degree: gaussians.sh_degree,
        }
    }

    /// The inverse of [`from_gaussians`](Self::from_gaussians).
    pub fn gaussians(&self) -> Gaussians {
        let narrow = |v: f64| v as f32;
        let rest = 1..super::sh::coefficients(self.sh_degree);
        Gaussians {
            means: self.rows.iter().map(|row| row.mean.map(narrow)).collect(),
            quats: self.rows.iter().map(|row| row.quat.map(narrow)).collect(),
            scales: self.rows.iter().map(|row| row.scale.map(narrow)).collect(),
            opacities: self.rows.iter().map(|row| narrow(row.opacity)).collect(),
            sh0: self.rows.iter().map(|row| row.sh[0].map(narrow)).collect(),
            sh_rest: self.rows.iter().flat_map(|row| row.sh[rest.clone()].iter().map(|sh| sh.map(narrow))).collect(),
            sh_degree: self.sh_degree,
            labels: Some(self.labels.clone()),
            ..Gaussians::default()
        }
    }

    /// Rows for which `keep` returns true, in order.
    pub fn filtered(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.rows.len()).filter(|&i| keep(i)).collect();
        Self {
            rows: kept.iter().map(|&i| self.rows[i]).collect(),
            labels: kept.iter().map(|&i| self.labels[i]).collect(),
            sh_degree: self.sh_degree,
        }
    }
}
