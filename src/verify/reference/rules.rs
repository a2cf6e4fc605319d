//! All constants of the method: the engine's f32 values, widened to f64.
//!
//! This is an independent copy, so that an error in the shaders' constants does not enter the mirrors; the test below
//! compares the two.

use crate::scene::Zone;
use glam::DVec3;

/// Constants of all passes.
#[derive(Clone, Debug, PartialEq)]
pub struct Rules {
    /// Camera-space depth up to which a Gaussian is not drawn, world units.
    pub near: f64,
    /// Added to the diagonal of the 2-D covariance, px^2.
    pub dilation: f64,
    /// Opacity pays for the dilation, so that the light of a splat stays the same.
    pub antialiased: bool,
    /// Least standard deviation of a smooth Gaussian, pixels of its nearest view.
    pub finest: f64,
    /// Share of its size to which a view counts beyond its borders for that.
    pub smooth_margin: f64,
    /// Limit of x/z and y/z in the Jacobian beyond the image, in units of tan(fov/2).
    pub jacobian_margin: f64,
    /// Smallest alpha that counts.
    pub alpha_min: f64,
    /// Largest alpha.
    pub alpha_max: f64,
    /// The ray ends before a splat that would leave less transmittance than this.
    pub transmittance_min: f64,
    /// Added to the colour of the spherical harmonics.
    pub colour_bias: f64,
    /// Spherical-harmonics factor, degree 0.
    pub sh_c0: f64,
    /// Spherical-harmonics factor, degree 1.
    pub sh_c1: f64,
    /// Spherical-harmonics factors, degree 2, in the order xy, yz, 2zz-xx-yy, xz, xx-yy.
    pub sh_c2: [f64; 5],
    /// Spherical-harmonics factors, degree 3, in the order of `sh::basis`.
    pub sh_c3: [f64; 7],
    /// Weight of the absolute difference in the photo loss.
    pub l1_weight: f64,
    /// Weight of 1 - SSIM in the photo loss.
    pub dssim_weight: f64,
    /// Weight of the label loss (lambda 2).
    pub label_weight: f64,
    /// Weight of the alpha term within the label loss.
    pub label_alpha: f64,
    /// What the opacity of an object alone may be off without a loss.
    pub alpha_slack: f64,
    /// Standard deviation of the SSIM window, px.
    pub ssim_sigma: f64,
    /// Radius of the SSIM window, px (window = 2 reach + 1).
    pub ssim_reach: usize,
    /// Stabiliser of the SSIM luminance term.
    pub ssim_c1: f64,
    /// Stabiliser of the SSIM contrast term.
    pub ssim_c2: f64,
    /// Decay of Adam's first moment.
    pub adam_beta1: f64,
    /// Decay of Adam's second moment.
    pub adam_beta2: f64,
    /// Added to Adam's denominator.
    pub adam_eps: f64,
    /// Mean 2-D gradient (NDC units) at which a Gaussian is cloned or split.
    pub densify_gradient: f64,
    /// Largest scale that is cloned, in units of the scene extent; larger Gaussians are split.
    pub percent_dense: f64,
    /// Divisor of the scale: a split child has its parent's scale divided by this.
    pub split_shrink: f64,
    /// Box in which Gaussians grow; `None`: everywhere.
    pub grow_box: Option<Zone>,
    /// Splits go along the longest axis instead of to random places.
    pub splits_long: bool,
    /// Distance of the children of such a split from their parent, standard deviations.
    pub split_offset: f64,
    /// Factor of the longest axis in such a split.
    pub split_long: f64,
    /// Factor of the other axes.
    pub split_others: f64,
    /// Factor of the opacity.
    pub split_opacity: f64,
    /// Number of views with which a Gaussian counts as marked for removal.
    pub stat_near: f64,
    /// Largest standard deviation in distances from a camera; larger Gaussians are marked.
    pub free_size: f64,
    /// Gaussians below this opacity are removed.
    pub prune_opacity: f64,
    /// Gaussians above this scale are removed, in units of the scene extent.
    pub prune_scale: f64,
    /// Large Gaussians are removed after this step.
    pub prune_scale_after: u32,
    /// Weight of an opaque Gaussian in a draw.
    pub relocate_one: f64,
    /// Most copies of a Gaussian in a stack.
    pub relocate_most: u32,
    /// Steepness in opacity at which Gaussians stop to move at random.
    pub noise_steep: f64,
    /// The opacity at which they do.
    pub noise_opacity: f64,
    /// Ceiling of an opacity reset.
    pub reset_opacity: f64,
    /// Minimum weight at which a main Gaussian takes the label of its pixel.
    pub lift_threshold: f64,
    /// The label of a pixel has the largest sum of weights; otherwise it is that of the main Gaussian.
    pub label_sums: bool,
}

/// The f32 constant as f64.
pub fn wide(value: f32) -> f64 {
    f64::from(value)
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            near: wide(0.2),
            dilation: wide(0.3),
            antialiased: false,
            finest: 0.2_f64.sqrt(),
            smooth_margin: wide(0.15),
            jacobian_margin: wide(0.3),
            alpha_min: wide(1.0 / 255.0),
            alpha_max: wide(0.99),
            transmittance_min: wide(1e-4),
            colour_bias: wide(0.5),
            sh_c0: wide(0.282_094_79),
            sh_c1: wide(0.488_602_5),
            sh_c2: [1.092_548_4, -1.092_548_4, 0.315_391_57, -1.092_548_4, 0.546_274_2].map(wide),
            sh_c3: [-0.590_043_6, 2.890_611_4, -0.457_045_8, 0.373_176_34, -0.457_045_8, 1.445_305_7, -0.590_043_6]
                .map(wide),
            l1_weight: wide(0.8),
            dssim_weight: wide(0.2),
            label_weight: 1.0,
            label_alpha: 0.1,
            alpha_slack: 0.5,
            ssim_sigma: 1.5,
            ssim_reach: 5,
            ssim_c1: wide(0.01 * 0.01),
            ssim_c2: wide(0.03 * 0.03),
            // The shader compiler computes 1 - beta from the decimal numbers.
            adam_beta1: 0.9,
            adam_beta2: 0.999,
            adam_eps: wide(1e-15),
            densify_gradient: wide(2e-4),
            percent_dense: wide(0.01),
            split_shrink: wide(1.6),
            grow_box: None,
            splits_long: false,
            split_offset: 0.5,
            split_long: 0.5,
            split_others: 0.85,
            split_opacity: wide(0.6),
            stat_near: 1e9,
            free_size: 0.5,
            prune_opacity: wide(0.005),
            prune_scale: wide(0.1),
            prune_scale_after: 3000,
            relocate_one: 255.0,
            relocate_most: 51,
            noise_steep: 100.0,
            noise_opacity: wide(0.005),
            reset_opacity: wide(0.01),
            lift_threshold: wide(0.6),
            label_sums: true,
        }
    }
}

impl Rules {
    /// The exponent (log2 of alpha) at and above which a pair counts.
    pub fn exponent_min(&self) -> f64 {
        self.alpha_min.log2()
    }

    /// Returns true where Gaussians grow.
    pub fn grows_at(&self, mean: [f64; 3]) -> bool {
        self.grow_box.is_none_or(|zone| zone.contains(DVec3::from(mean)))
    }
}

/// Passes that a constant affects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Splats of a view.
    Project,
    /// Least size of a Gaussian.
    Smooth,
    /// Colour of a splat.
    Sh,
    /// Image of a view.
    Blend,
    /// Photo and label loss.
    Loss,
    /// Optimiser.
    Adam,
    /// Cloning, splitting, removing.
    Densify,
    /// Marks of Gaussians that fog a camera.
    FreeSpace,
    /// Relocation.
    Relocate,
    /// Random moves.
    Explore,
    /// Opacity reset.
    Reset,
    /// Labelling.
    Lift,
    /// Label map of a view.
    LabelMap,
}

/// A set of rules with one constant changed; a comparison with it must fail.
#[derive(Clone, Debug, PartialEq)]
pub struct Mutant {
    /// Name of the constant.
    pub name: &'static str,
    /// Passes that it affects.
    pub family: Family,
    /// All constants, with this one changed.
    pub rules: Rules,
}

/// One mutant for each constant; most change it by a few per cent.
pub fn mutants() -> Vec<Mutant> {
    use Family::{
        Adam, Blend, Densify, Explore, FreeSpace, LabelMap, Lift, Loss, Project, Relocate, Reset, Sh, Smooth,
    };
    type Change = fn(&mut Rules);
    let changes: [(&'static str, Family, Change); 43] = [
        ("near", Project, |r| r.near = 3.8),
        ("dilation", Project, |r| r.dilation *= 1.03),
        ("antialiased", Project, |r| r.antialiased = true),
        ("finest", Smooth, |r| r.finest *= 1.03),
        ("smooth_margin", Smooth, |r| r.smooth_margin *= 2.0),
        ("jacobian_margin", Project, |r| r.jacobian_margin *= 0.97),
        ("alpha_min", Blend, |r| r.alpha_min *= 1.03),
        ("alpha_max", Blend, |r| r.alpha_max *= 0.97),
        ("transmittance_min", Blend, |r| r.transmittance_min *= 10.0),
        ("colour_bias", Sh, |r| r.colour_bias *= 1.03),
        ("sh_c0", Sh, |r| r.sh_c0 *= 1.03),
        ("sh_c1", Sh, |r| r.sh_c1 *= 1.03),
        ("sh_c2", Sh, |r| r.sh_c2[2] *= 1.03),
        ("sh_c3", Sh, |r| r.sh_c3[6] *= 1.03),
        ("l1_weight", Loss, |r| r.l1_weight *= 1.03),
        ("dssim_weight", Loss, |r| r.dssim_weight *= 1.03),
        ("label_weight", Loss, |r| r.label_weight *= 1.03),
        ("label_alpha", Loss, |r| r.label_alpha *= 1.03),
        ("alpha_slack", Loss, |r| r.alpha_slack *= 1.1),
        ("ssim_sigma", Loss, |r| r.ssim_sigma *= 1.03),
        ("ssim_reach", Loss, |r| r.ssim_reach -= 1),
        ("ssim_c1", Loss, |r| r.ssim_c1 *= 1.3),
        ("ssim_c2", Loss, |r| r.ssim_c2 *= 1.3),
        ("adam_beta1", Adam, |r| r.adam_beta1 *= 0.97),
        ("adam_beta2", Adam, |r| r.adam_beta2 *= 0.97),
        ("adam_eps", Adam, |r| r.adam_eps = 1e-8),
        ("densify_gradient", Densify, |r| r.densify_gradient *= 1.5),
        ("percent_dense", Densify, |r| r.percent_dense *= 1.5),
        ("split_shrink", Densify, |r| r.split_shrink *= 1.03),
        ("split_offset", Densify, |r| r.split_offset *= 1.03),
        ("split_long", Densify, |r| r.split_long *= 1.03),
        ("split_others", Densify, |r| r.split_others *= 1.03),
        ("split_opacity", Densify, |r| r.split_opacity *= 1.03),
        ("stat_near", Densify, |r| r.stat_near *= 1.03),
        ("free_size", FreeSpace, |r| r.free_size *= 1.1),
        ("prune_opacity", Densify, |r| r.prune_opacity *= 4.0),
        ("prune_scale", Densify, |r| r.prune_scale *= 0.5),
        ("prune_scale_after", Densify, |r| r.prune_scale_after = 100),
        ("relocate_one", Relocate, |r| r.relocate_one *= 0.5),
        ("relocate_most", Relocate, |r| r.relocate_most = 4),
        ("noise_steep", Explore, |r| r.noise_steep *= 1.03),
        ("noise_opacity", Explore, |r| r.noise_opacity *= 1.1),
        ("reset_opacity", Reset, |r| r.reset_opacity *= 1.03),
    ];
    let labels: [(&'static str, Family, Change); 2] =
        [("lift_threshold", Lift, |r| r.lift_threshold *= 0.75), ("label_sums", LabelMap, |r| r.label_sums = false)];
    let changed = |(name, family, change): (&'static str, Family, Change)| {
        let mut rules = Rules::default();
        change(&mut rules);
        Mutant { name, family, rules }
    };
    changes.into_iter().chain(labels).map(changed).collect()
}

#[cfg(test)]
mod tests {
    use super::Rules;
    use crate::scene::gaussians::ALPHA_MAX;
    use crate::scene::harmonics::SH_C0;
    use crate::shaders::constants as glsl;

    #[test]
    fn the_rules_are_the_constants_of_the_shaders() {
        let r = Rules::default();
        let [c20, c22, c24] = [glsl::SH_C2_0, glsl::SH_C2_2, glsl::SH_C2_4];
        let [c30, c31, c32, c33, c35] = [glsl::SH_C3_0, glsl::SH_C3_1, glsl::SH_C3_2, glsl::SH_C3_3, glsl::SH_C3_5];
        let single = [
            (r.near, glsl::NEAR),
            (r.dilation, glsl::COV2D_BLUR),
            (r.finest, glsl::FINEST),
            (r.alpha_slack, glsl::ALPHA_SLACK),
            (r.smooth_margin, glsl::SMOOTH_MARGIN),
            (r.jacobian_margin, glsl::JACOBIAN_MARGIN),
            (r.alpha_min, glsl::ALPHA_MIN),
            (r.alpha_max, glsl::ALPHA_MAX),
            (r.transmittance_min, glsl::TRANSMITTANCE_MIN),
            (r.exponent_min(), glsl::LOG2_ALPHA_MIN),
            (r.colour_bias, glsl::COLOUR_BIAS),
            (r.sh_c0, glsl::SH_C0),
            (SH_C0, glsl::SH_C0),
            (ALPHA_MAX, glsl::ALPHA_MAX),
            (r.sh_c1, glsl::SH_C1),
            (r.ssim_c1, glsl::SSIM_C1),
            (r.ssim_c2, glsl::SSIM_C2),
            (r.adam_beta1, glsl::ADAM_BETA1),
            (r.adam_beta2, glsl::ADAM_BETA2),
            (r.adam_eps, glsl::ADAM_EPSILON),
            (r.split_shrink.ln(), glsl::SPLIT_SHRINK),
            (r.split_offset, glsl::SPLIT_OFFSET),
            (-r.split_long.ln(), glsl::SPLIT_LONG),
            (-r.split_others.ln(), glsl::SPLIT_OTHERS),
            (r.split_opacity, glsl::SPLIT_OPACITY),
            (r.stat_near, glsl::STAT_NEAR),
            (r.free_size, glsl::FREE_SIZE),
            (r.relocate_one, glsl::RELOCATE_ONE),
            (f64::from(r.relocate_most), glsl::RELOCATE_MOST as f32),
            (r.noise_steep, glsl::NOISE_STEEP),
            (r.noise_opacity, glsl::NOISE_OPACITY),
            ((r.reset_opacity / (1.0 - r.reset_opacity)).ln(), glsl::OPACITY_RESET_LOGIT),
        ];
        let degree_2 = r.sh_c2.into_iter().zip([c20, -c20, c22, -c20, c24]);
        let degree_3 = r.sh_c3.into_iter().zip([-c30, c31, -c32, c33, -c32, c35, -c30]);
        for (rule, constant) in single.into_iter().chain(degree_2).chain(degree_3) {
            assert!((rule / f64::from(constant) - 1.0).abs() < 2e-7, "{rule} for {constant}");
        }
    }
}
