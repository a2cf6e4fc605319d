//! Adam on every attribute, and the reset of opacities.

use super::build::{Builder, args, over_gaussians};
use crate::pass;
use crate::scheduler::plan::{Buf, Stage};
use crate::shaders::constants;

/// An attribute of the Gaussians as the optimiser sees it.
#[derive(Clone, Copy, Debug)]
pub struct Attribute {
    /// Parameters, first moments, second moments.
    pub planes: [Buf; 3],
    /// Gradients, by splat.
    pub gradient: Buf,
    /// vec4 per Gaussian.
    pub stride: u32,
    /// Which learning rate (glsl/optimize/adam.comp).
    pub rate: u32,
    /// Degree of the spherical harmonics from which on it is active.
    pub from_degree: u32,
    /// Word of `dispatch_args`.
    pub args: u32,
}

/// All attributes.
pub const ATTRIBUTES: [Attribute; 7] = [
    attribute([Buf::MEANS, Buf::M_MEANS, Buf::U_MEANS], Buf::V_MEANS, 1, 0, 0, constants::ARGS_GAUSSIANS),
    attribute([Buf::SCALES, Buf::M_SCALES, Buf::U_SCALES], Buf::V_SCALES, 1, 1, 0, constants::ARGS_GAUSSIANS),
    attribute([Buf::QUATS, Buf::M_QUATS, Buf::U_QUATS], Buf::V_QUATS, 1, 2, 0, constants::ARGS_GAUSSIANS),
    attribute([Buf::SH0, Buf::M_SH0, Buf::U_SH0], Buf::V_SH0, 1, 3, 0, constants::ARGS_GAUSSIANS),
    attribute([Buf::SH1, Buf::M_SH1, Buf::U_SH1], Buf::V_SH1, 3, 4, 1, constants::ARGS_SH1),
    attribute([Buf::SH2, Buf::M_SH2, Buf::U_SH2], Buf::V_SH2, 4, 4, 2, constants::ARGS_SH2),
    attribute([Buf::SH3, Buf::M_SH3, Buf::U_SH3], Buf::V_SH3, 6, 4, 3, constants::ARGS_SH3),
];

const fn attribute(planes: [Buf; 3], gradient: Buf, stride: u32, rate: u32, from_degree: u32, args: u32) -> Attribute {
    Attribute { planes, gradient, stride, rate, from_degree, args }
}

/// One Adam update of the attributes that are active; of all Gaussians, or of those alone that the step shows.
pub fn adam(b: &mut Builder, unseen: bool) {
    let (degree, seen_only) = (b.sh_degree, u32::from(!unseen));
    b.list.stage = Stage::Optimise;
    for a in ATTRIBUTES.iter().filter(|a| a.from_degree <= degree) {
        pass!(b, adam {
            step: Buf::STEP, failure: Buf::FAILURE, splat_from_gaussian: Buf::SPLAT_FROM_GAUSSIAN,
            gradients: a.gradient, parameters_in: a.planes[0], first_moments_in: a.planes[1],
            second_moments_in: a.planes[2], parameters: a.planes[0], first_moments: a.planes[1], second_moments: a.planes[2],
        } [stride: a.stride, rate: a.rate, seen_only: seen_only], args(a.args));
    }
}

/// No opacity above 0.01; its moments start over.
pub fn opacity_reset(b: &mut Builder) {
    b.list.stage = Stage::Optimise;
    pass!(b, opacity_reset { step: Buf::STEP, means: Buf::MEANS, m_means: Buf::M_MEANS, u_means: Buf::U_MEANS } [],
        over_gaussians());
}
