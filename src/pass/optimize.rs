//! Adam on every attribute of the Gaussians and on shared parameters; the opacity reset.

use super::build::{Builder, args, over_gaussians};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Grid, Stage};
use crate::shaders::constants;

/// A Gaussian attribute, as the optimiser sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attribute {
    /// Parameters, first moments, second moments.
    pub planes: [Buf; 3],
    /// Gradients, by splat.
    pub gradient: Buf,
    /// Number of vec4 per Gaussian.
    pub stride: u32,
    /// Index of the learning rate (glsl/optimize/adam.comp).
    pub rate: u32,
    /// Active degree of the spherical harmonics from which the attribute is trained.
    pub from_degree: u32,
    /// Word of `dispatch_args`.
    pub args: u32,
}

/// All attributes.
pub(crate) const MODEL_ATTRIBUTES: [Attribute; 7] = [
    attribute([Buf::MEANS, Buf::M_MEANS, Buf::U_MEANS], Buf::V_MEANS, 1, 0, 0, constants::ARGS_GAUSSIANS),
    attribute([Buf::SCALES, Buf::M_SCALES, Buf::U_SCALES], Buf::V_SCALES, 1, 1, 0, constants::ARGS_GAUSSIANS),
    attribute([Buf::QUATS, Buf::M_QUATS, Buf::U_QUATS], Buf::V_QUATS, 1, 2, 0, constants::ARGS_GAUSSIANS),
    attribute([Buf::SH0, Buf::M_SH0, Buf::U_SH0], Buf::V_SH0, 1, 3, 0, constants::ARGS_GAUSSIANS),
    attribute([Buf::SH1, Buf::M_SH1, Buf::U_SH1], Buf::V_SH1, 2, 4, 1, constants::ARGS_SH1),
    attribute([Buf::SH2, Buf::M_SH2, Buf::U_SH2], Buf::V_SH2, 4, 4, 2, constants::ARGS_SH2),
    attribute([Buf::SH3, Buf::M_SH3, Buf::U_SH3], Buf::V_SH3, 5, 4, 3, constants::ARGS_SH3),
];

impl Attribute {
    /// Returns the planes of its moments; a single one if packed (`half`).
    pub(crate) fn moments(&self, half: bool) -> &[Buf] {
        if half { &self.planes[1..2] } else { &self.planes[1..] }
    }
}

const fn attribute(planes: [Buf; 3], gradient: Buf, stride: u32, rate: u32, from_degree: u32, args: u32) -> Attribute {
    Attribute { planes, gradient, stride, rate, from_degree, args }
}

/// Parameters shared by Gaussians, their moments, and the bias corrections of the moments. If their capacity is 0,
/// neither these buffers nor their passes exist.
pub(crate) const SHARED_PLANES: [Buf; 4] = [Buf::SHARED, Buf::M_SHARED, Buf::U_SHARED, Buf::W_SHARED];

/// One Adam update of the active attributes, of all Gaussians if `unseen`, else only of those in the view.
pub(super) fn adam(b: &mut Builder, unseen: bool) {
    let (degree, seen_only) = (b.sh_degree, u32::from(!unseen));
    b.list.stage = Stage::OPTIMISE;
    for a in MODEL_ATTRIBUTES.iter().filter(|a| a.from_degree <= degree) {
        update(b, false, (a.planes, a.gradient), [a.stride, a.rate, seen_only], args(a.args));
    }
}

/// Sets the gradients of shared parameters to 0; an extension's passes may then write them.
pub(super) fn clear_shared(b: &mut Builder) {
    if b.capacity.shared_rows > 0 {
        b.list.fill(Buf::V_SHARED, 0);
    }
}

/// One Adam update of the shared parameters of the step.
pub(super) fn adam_shared(b: &mut Builder) {
    if b.capacity.shared_rows > 0 {
        let [parameters, first, second, _] = SHARED_PLANES;
        let grid = Grid::Groups(b.capacity.shared_rows.div_ceil(64) as u32, 1, 1);
        update(b, true, ([parameters, first, second], Buf::V_SHARED), [1, 0, 0], grid);
    }
}

fn update(
    b: &mut Builder,
    shared: bool,
    (planes, gradients): ([Buf; 3], Buf),
    [stride, rate, seen_only]: [u32; 3],
    grid: Grid,
) {
    let rows = b.capacity.shared_rows as u32;
    let [parameters, first, second] = planes;
    pass!(b, adam(shared: shared, half: b.half && !shared) { gradients: gradients, parameters_in: parameters, m_parameters_in: first, u_parameters_in: second, parameters: parameters, m_parameters: first, u_parameters: second, weights: Buf::W_SHARED } [stride: stride, rate: rate, seen_only: seen_only, rows: rows], grid);
}

/// Moves faint Gaussians at random, and keeps all from becoming finer than the photos can show, as far as
/// `update_modes` says so.
pub(crate) fn move_all(b: &mut Builder) {
    let modes = b.update_modes;
    b.list.stage = Stage::OPTIMISE;
    pass!(b, move_all { means_in: Buf::MEANS, scales_in: Buf::SCALES } [modes: modes], over_gaussians());
}

/// Limits opacities to 0.01 and zeroes their moments.
pub(super) fn opacity_reset(b: &mut Builder) {
    b.list.stage = Stage::OPTIMISE;
    pass!(b, opacity_reset(half: b.half) {} [],
        over_gaussians());
}

#[cfg(test)]
mod tests {
    use super::MODEL_ATTRIBUTES;
    use crate::pass::buffers::TABLE;

    /// Three vec4 of geometry, and 16 rgb triples without padding; the same for moments and gradients.
    #[test]
    fn a_gaussian_of_degree_3_has_15_vec4() {
        for (degree, vectors) in [(0, 4), (1, 6), (2, 10), (3, 15)] {
            let attributes = || MODEL_ATTRIBUTES.iter().filter(|a| a.from_degree <= degree);
            assert_eq!(attributes().map(|a| a.stride).sum::<u32>(), vectors, "degree {degree}");
            for set in 0..4 {
                let planes = attributes().map(|a| if set < 3 { a.planes[set] } else { a.gradient });
                let bytes: u32 = planes.map(|plane| TABLE[plane.index()].element_bytes).sum();
                assert_eq!(bytes, 16 * vectors, "degree {degree}, planes {set}");
            }
        }
    }
}
