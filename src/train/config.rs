//! Every hyper-parameter of training: value, source, effect.
//!
//! Defaults are what LabelGS and 3DGS print or ship. "LabelGS" below is the paper (arXiv 2508.19699) with its authors'
//! code, "3DGS" is Kerbl et al. 2023 with its code.

use crate::Result;
use crate::options::Options;
#[cfg(feature = "cli")]
use crate::options::parse::{colour, count, samples, switch};
use serde::{Deserialize, Serialize};

/// Where the label loss gets its occluders from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Occlusion {
    /// No occluder is known: every pixel outside an object's mask is expected to be black.
    None,
    /// Monocular depth from files, --depths, by the paper's rule: who is nearer on the average along the contour.
    Depth,
    /// Depth of the model itself, rendered every --occlusion-every steps. The paper asks a network for monocular depth
    /// instead.
    #[default]
    Rendered,
    /// Lists from a file, --occlusion-file.
    #[cfg_attr(feature = "cli", value(skip))]
    File,
}

/// How a Gaussian gets its label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum LabelRule {
    /// From the pixels of the step's view in which it has most weight; the last view wins (LabelGS).
    Main,
    /// From the sums of its weights in the pixels of all views, counted every --vote-every steps and at the end.
    #[default]
    Votes,
}

crate::options::options! {
    /// What a training does. `Default` is the paper's setting but for labels, where it is what was measured to be better;
    /// [`TrainConfig::paper`] is the paper's throughout.
    ///
    /// Steps count from 1, as in the reference code.
    pub struct TrainConfig {
        "Training" {
            /// Number of steps, one view each.
            ///
            /// 15000 (LabelGS).
            iterations <"N">: u32 = 15_000, at_least(1);

            /// Last step that looks at photos of half the size, without labels; 0 for none.
            ///
            /// 0 (3DGS). A quarter of the pixels while the model is rough anyway: with a third of the steps a run takes a
            /// tenth less time, for the same PSNR.
            coarse_until <"STEP">: u32 = 0;

            /// Seed of every random number; the same seed, device and driver give the same model.
            ///
            /// 0 (LabelGS). Order of views, sampled objects and splits draw from it.
            seed <"S">: u64 = 0, fixed;

            /// Most Gaussians, such as 500k or 2M; 0 lets the memory of the device decide.
            ///
            /// 0. At the bound only the Gaussians that need it most still grow.
            #[cfg_attr(feature = "cli", arg(value_parser = count))]
            max_gaussians <"N">: u64 = 0;
        }

        "Rendering" {
            /// Colour behind the scene: black, white, or R,G,B from 0 to 1.
            ///
            /// Black (LabelGS, 3DGS). The label loss is always on black.
            #[cfg_attr(feature = "cli", arg(value_parser = colour))]
            background <"COLOUR">: [f32; 3] = [0.0; 3], up_to(1.0), fixed;

            /// Gaussians nearer to the camera are not drawn, world units.
            ///
            /// 0 lets the scene decide: 0.2 (3DGS), or a twentieth of the median depth of its first Gaussians where that
            /// is less.
            near <"Z">: f32 = 0.0, not_negative;
        }

        "Labels" {
            /// First step with labels.
            ///
            /// 1000 (LabelGS): before, the geometry is too rough. From then on labels are lifted and have a loss.
            label_from <"STEP">: u32 = 1000;

            /// How a Gaussian gets its label.
            ///
            /// Votes; the paper's rule is `main`, to which --label-threshold and --gpf belong.
            label_rule <"RULE">: LabelRule = LabelRule::Votes, fixed;

            /// Steps between two counts of votes.
            vote_every <"STEPS">: u32 = 500, at_least(1);

            /// Less weight for masks that disagree with all others, on or off.
            ///
            /// Masks are compared with what the votes of all views have made of the model.
            #[cfg_attr(feature = "cli", arg(value_parser = switch, action = clap::ArgAction::Set))]
            vote_trust <"SWITCH">: bool = true;

            /// Pixels so near to a contour of their mask are left out, px.
            ///
            /// 0: masks are taken as exact. 2 suits masks of trackers, which work on shrunk photos. Such pixels have
            /// neither votes nor label loss.
            mask_border <"PX">: u32 = 0;

            /// Least blending weight at a pixel that gives its label to a Gaussian.
            ///
            /// 0.6 (LabelGS). Higher labels fewer Gaussians, more surely.
            label_threshold <"WEIGHT">: f32 = 0.6, positive_up_to(1.0);

            /// Gaussian projection filter, on or off: the centre must project into the mask too.
            ///
            /// On (LabelGS).
            #[cfg_attr(feature = "cli", arg(value_parser = switch, action = clap::ArgAction::Set))]
            gpf <"SWITCH">: bool = true;

            /// Objects per step.
            ///
            /// 10 (LabelGS), where it bounds memory. They are sampled anew for lift and label loss.
            #[cfg_attr(feature = "cli", arg(value_parser = samples))]
            label_samples <"N|all">: u32 = 10, at_least(1);

            /// Weight of the label loss.
            ///
            /// 0.3 for the sum over the objects of a step; LabelGS's code has 1.0 (the paper's lambda 2 has no value),
            /// which costs the whole picture more and makes objects no better.
            label_weight <"WEIGHT">: f32 = 0.3, not_negative;

            /// Small objects weigh more per pixel than large ones, on or off.
            ///
            /// Off (LabelGS). On: as one over the root of their area in the view. With votes small objects are not lost
            /// beside large ones, and the weight costs the whole picture.
            #[cfg_attr(feature = "cli", arg(value_parser = switch, action = clap::ArgAction::Set))]
            label_balance <"SWITCH">: bool = false;

            /// Weight of the alpha term in the label loss.
            ///
            /// 0 (LabelGS has none). The object's opacity against its mask: of use for objects as dark as the black behind
            /// them, which may vanish without cost.
            label_alpha <"WEIGHT">: f32 = 0.0, not_negative;

            /// Where occluders come from.
            ///
            /// The label loss leaves out the pixels of what hides an object. Rendered depth.
            occlusion <"SOURCE">: Occlusion = Occlusion::Rendered, fixed;

            /// Steps between two looks at the occluders.
            occlusion_every <"STEPS">: u32 = 1000, at_least(1);
        }

        "Training" {
            /// Share of D-SSIM in the photometric loss.
            ///
            /// 0.2 (3DGS); the rest is L1.
            lambda_dssim <"SHARE">: f32 = 0.2, up_to(1.0);

            /// Degree of the spherical harmonics, 0 to 3.
            ///
            /// 3 (3DGS). Lower saves memory and loses shine.
            sh_degree <"DEGREE">: u32 = 3, up_to(3.0), fixed;

            /// Steps until the next degree is let in.
            ///
            /// 1000 (3DGS).
            sh_degree_interval <"STEPS">: u32 = 1000, at_least(1);
        }

        "Learning rates" {
            /// Rate of positions at the start, scene extents.
            ///
            /// 1.6e-4 (3DGS).
            position_lr_init <"RATE">: f64 = 1.6e-4, positive;

            /// Rate of positions at the end, scene extents.
            ///
            /// 1.6e-6 (3DGS), at --position-lr-max-steps; log-linear in between.
            position_lr_final <"RATE">: f64 = 1.6e-6, positive;

            /// Step that has the final rate of positions.
            ///
            /// 30000: LabelGS keeps 3DGS's value for its 15000 steps.
            position_lr_max_steps <"STEP">: u32 = 30_000, at_least(1);

            /// Rate of the degree-0 colour.
            ///
            /// 2.5e-3 (3DGS).
            feature_lr <"RATE">: f64 = 2.5e-3, not_negative;

            /// Rate of the other colours.
            ///
            /// A twentieth of --feature-lr (3DGS).
            #[serde(skip_serializing_if = "Option::is_none")]
            feature_rest_lr <"RATE">: Option<f64> = None, not_negative;

            /// Rate of opacity logits.
            ///
            /// 0.05 (3DGS of 2023).
            opacity_lr <"RATE">: f64 = 0.05, not_negative;

            /// Rate of log-scales.
            ///
            /// 0.005 (3DGS).
            scaling_lr <"RATE">: f64 = 0.005, not_negative;

            /// Rate of quaternions.
            ///
            /// 0.001 (3DGS).
            rotation_lr <"RATE">: f64 = 0.001, not_negative;
        }

        "Densification" {
            /// Step after which it starts.
            ///
            /// 500 (3DGS).
            densify_from <"STEP">: u32 = 500;

            /// Step at which it ends, at the earliest 1000 steps after --densify-from if not given [default: half of the
            /// run].
            ///
            /// Pruning and opacity resets end there too. Half of the run is 3DGS's choice (15000 of 30000). LabelGS has
            /// 40000, to the end of its runs: that makes three quarters more Gaussians, and slower steps, for the same
            /// PSNR.
            #[serde(skip_serializing_if = "Option::is_none")]
            densify_until <"STEP">: Option<u32> = None;

            /// Steps between two.
            ///
            /// 100 (3DGS).
            densify_interval <"STEPS">: u32 = 100, at_least(1);

            /// Mean screen gradient that clones or splits, half images.
            ///
            /// 2e-4 (3DGS), in units of half the image (normalised device coordinates). Lower grows more Gaussians.
            densify_grad_threshold <"GRADIENT">: f32 = 2e-4, positive;

            /// Largest size that is cloned instead of split, scene extents.
            ///
            /// 0.01 (3DGS), a standard deviation.
            percent_dense <"SIZE">: f32 = 0.01, not_negative;

            /// Least opacity that is kept.
            ///
            /// 0.005 (3DGS). Fainter Gaussians are pruned.
            min_opacity <"OPACITY">: f32 = 0.005, up_to(1.0);

            /// Largest size that is kept, scene extents.
            ///
            /// 0.1 (3DGS), a standard deviation. Larger Gaussians are pruned once the first opacity reset is past; never
            /// where there is none.
            max_scale <"SIZE">: f32 = 0.1, not_negative;

            /// Steps between two opacity resets; 0 makes none.
            ///
            /// 0: after resets (3DGS: 3000) Gaussians next to the cameras take the place of a sky or of what else is far,
            /// and views between those cameras turn to fog.
            opacity_reset_interval <"STEPS">: u32 = 0;

            /// Steps before the end without an opacity reset.
            ///
            /// 1500 (LabelGS).
            opacity_reset_margin <"STEPS">: u32 = 1500;
        }
    }
}

impl TrainConfig {
    /// The paper's settings where they differ from the default.
    pub fn paper() -> Self {
        Self {
            label_rule: LabelRule::Main,
            label_weight: 1.0,
            densify_until: Some(40_000),
            opacity_reset_interval: 3000,
            ..Self::default()
        }
    }

    /// Learning rate of positions at `step`, before the scene extent.
    pub fn position_lr(&self, step: u32) -> f64 {
        let t = (f64::from(step) / f64::from(self.position_lr_max_steps)).clamp(0.0, 1.0);
        ((1.0 - t) * self.position_lr_init.ln() + t * self.position_lr_final.ln()).exp()
    }

    /// Learning rate of the colours above degree 0.
    pub fn feature_rest_lr(&self) -> f64 {
        self.feature_rest_lr.unwrap_or(self.feature_lr / 20.0)
    }

    /// Makes all learning rates half of what they are.
    pub(super) fn halve_rates(&mut self) {
        for rate in [
            &mut self.position_lr_init,
            &mut self.position_lr_final,
            &mut self.feature_lr,
            &mut self.opacity_lr,
            &mut self.scaling_lr,
            &mut self.rotation_lr,
        ]
        .into_iter()
        .chain(&mut self.feature_rest_lr)
        {
            *rate *= 0.5;
        }
    }

    /// Degree of the spherical harmonics that `step` uses.
    pub fn sh_degree_at(&self, step: u32) -> u32 {
        (step / self.sh_degree_interval).min(self.sh_degree)
    }

    /// True for steps that lift labels and add the label loss, given masks.
    pub fn labels_at(&self, step: u32) -> bool {
        step >= self.labels_from()
    }

    /// First step with labels.
    pub fn labels_from(&self) -> u32 {
        if self.coarse_until < self.label_from { self.label_from } else { self.coarse_until.saturating_add(1) }
    }

    /// Refuses values that make no sense; messages name the option.
    pub fn check(&self) -> Result<()> {
        self.check_ranges()
    }
}
