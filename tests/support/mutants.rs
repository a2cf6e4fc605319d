//! Rules with a wrong constant, which every comparison must see.

use crate::reference::Rules;

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
    /// Packed moments.
    Moments,
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
        Adam, Blend, Densify, Explore, FreeSpace, LabelMap, Lift, Loss, Moments, Project, Relocate, Reset, Sh, Smooth,
    };
    type Change = fn(&mut Rules);
    let changes: [(&'static str, Family, Change); 46] = [
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
        ("moment_ratio", Moments, |r| r.moment_ratio *= 1.03),
        ("moment_log", Moments, |r| r.moment_log *= 1.03),
        ("moment_floor", Moments, |r| r.moment_floor += 1.0),
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
