//! Every hyper-parameter of training: value, source, effect.
//!
//! Most defaults are those of LabelGS and 3DGS, from the paper or the code. "LabelGS" below is the paper (arXiv
//! 2508.19699) with its authors' code, "3DGS" is Kerbl et al. 2023 with its code.

use super::choices::{ExposureMode, LabelRule, Moments, Occlusion, StrategyKind};
use crate::options::Options;
#[cfg(feature = "cli")]
use crate::options::parse::{colour, corners, count, samples};
use crate::{Error, Result, Setting};

crate::options! {
    /// The settings of a training. `Default` follows the paper except where measurements favour other
    /// values. [`TrainConfig::paper`] follows the paper throughout.
    ///
    /// Steps count from 1, as in the reference code.
    pub struct TrainConfig {
        "Training" {
            /// Number of steps, one view each.
            ///
            /// 7000, as in the short runs of 3DGS; LabelGS has 15000. Schedules and learning rates follow the length.
            #[cfg_attr(feature = "cli", arg(aliases = ["steps", "iters"]))]
            iterations <"N">: u32 = 7_000, at_least(1);

            /// Size of the photos in the first steps, as a share of their full size; 1 has all steps at full size
            /// [default: 0.4, for photos above 400 px less: 160 px].
            ///
            /// The size grows up to `full_size_from`. Early steps are rough anyway, and cost in proportion to the
            /// pixels. 3DGS trains at full size.
            start_size <"SHARE">: Option<f32> = None, positive_up_to(1.0), setting;

            /// First step at full size [default: 0.6 of the run, later where the run is short for such large photos].
            ///
            /// Steps before it have no labels.
            full_size_from <"STEP">: Option<u32> = None, setting;

            /// Seed of all random numbers; the same seed, device and driver give the same model.
            ///
            /// 0 (LabelGS). It decides the order of views, the sampled objects and the splits.
            seed <"S">: u64 = 0, fixed;

            /// Most Gaussians, such as 500k or 2M; 0 leaves the bound to the memory of the device.
            ///
            /// 0. At the bound only the largest gradients grow. Points are thinned to half of it, else to 4 x the
            ///    budget.
            #[cfg_attr(feature = "cli", arg(value_parser = count))]
            max_gaussians <"N">: u64 = 0;

            /// Weight of known depths in the loss [default: 0.3 where the reconstruction says which photo shows which
            /// point, else 0].
            ///
            /// Where the photo shows a point, or --depths has a value, light from Gaussians at another depth costs by
            /// its relative error, at most 1; a mean over these pixels. It falls linearly until the first step with
            /// labels, and moves opacities only.
            depth_weight <"WEIGHT">: Option<f64> = None, not_negative, fixed, setting;

            /// Trains a model without aliasing.
            ///
            /// Smaller pictures of such a model do not shimmer, and views from nearby show no needles: blur takes
            /// opacity, and no Gaussian is finer than the pixels of its nearest photo (Mip-Splatting). At the size of
            /// the photos it gains nothing. Viewers that do not know the flag in the model show its fine parts too
            /// bold.
            antialias <"SWITCH">: bool = false, fixed;

            /// Degree of the spherical harmonics, 0 to 3.
            ///
            /// 3 (3DGS). Lower degrees save memory and lose highlights.
            sh_degree <"DEGREE">: u32 = 3, up_to(3.0), fixed, setting;

            /// What the optimiser remembers of each parameter: two numbers of 32 bits, or two of 16.
            ///
            /// With `half` a model takes 8 bytes a parameter on the device and in checkpoints, not 12, for as good a
            /// picture; numbers are rounded at random, the same for the same seed. For scenes that do not fit
            /// otherwise.
            moments <"KIND">: Moments = Moments::Full, fixed, setting;

            /// Steps before the degree rises by one [default: a tenth of the run, at most 1000].
            ///
            /// 1000 in 3DGS.
            sh_degree_interval <"STEPS">: Option<u32> = None, at_least(1), setting;
        }

        "Rendering" {
            /// Colour behind the scene: a name such as white, #rrggbb, or R,G,B from 0 to 1.
            ///
            /// Black (LabelGS, 3DGS). The label loss always uses black.
            #[cfg_attr(feature = "cli", arg(value_parser = colour))]
            background <"COLOUR">: [f32; 3] = [0.0; 3], up_to(1.0), fixed;

            /// Gives each step a colour of its own behind the scene.
            ///
            /// What no Gaussian covers then never looks right, so that nothing is left to the background. Transparent
            /// photos are compared over the same colour. Renders and scores have --background. Off (3DGS, which has the
            /// choice).
            random_background <"SWITCH">: bool = false, fixed;

            /// Trains the exposure and white balance of each photo.
            ///
            /// The colours of the picture are multiplied by a matrix of its photo; the model has the mean exposure.
            exposure <"MODE">: ExposureMode = ExposureMode::Auto, fixed;

            /// Refines the poses of the photos: each is turned and moved while the Gaussians are trained.
            ///
            /// For reconstructions whose poses are off by pixels. The refined poses are written beside the model.
            refine_poses <"SWITCH">: bool = false, fixed;

            /// Near plane, world units: nearer Gaussians are not drawn.
            ///
            /// 0 chooses by the scene: 0.2 (3DGS), or a twentieth of the median depth of the first Gaussians if that is
            /// less.
            near <"Z">: f32 = 0.0, not_negative, setting;
        }

        "Densification" {
            /// Rule for the number of Gaussians.
            strategy <"RULE">: StrategyKind = StrategyKind::Budget, fixed, setting;

            /// Prunes Gaussians that fog the cameras.
            ///
            /// They are nearer than a quarter of all that a camera sees of the first Gaussians, or their deviation is
            /// more than half their distance from a camera. Off in 3DGS, where such Gaussians stand for the sky and
            /// other distant things.
            free_space <"SWITCH">: bool = true, setting;

            /// Directions around the cameras in which far Gaussians are tried; 0 adds none.
            ///
            /// The first Gaussians then stand also for the sky and other distant things without points. Only directions
            /// in which most photos look past all points get one. 3DGS has none.
            far_points <"N">: u32 = 800, setting;

            /// Box in which Gaussians grow, world units: the smaller corner first [default: everywhere].
            ///
            /// Outside of it Gaussians still train and are pruned, but none is added. It saves time where photos show
            /// more than what is wanted; `labelgs clean --inside` then drops the rest.
            #[cfg_attr(feature = "cli", arg(value_parser = corners, allow_hyphen_values = true))]
            grow_box <"x0,y0,z0,x1,y1,z1">: Option<[f64; 6]> = None;

            /// Weight of the mean opacity in the loss [default: 0.01 with the strategy mcmc, else 0].
            ///
            /// Gaussians that no photo supports then fade. The strategy adc has no such term.
            opacity_weight <"WEIGHT">: Option<f64> = None, not_negative, setting;

            /// Weight of the mean standard deviation in the loss, by the scene extent [default: 0.01 with the strategy
            /// mcmc, else 0].
            ///
            /// The strategy adc has no such term.
            scale_weight <"WEIGHT">: Option<f64> = None, not_negative, setting;

            /// Gaussians at the end of densification, such as 30k, for the strategies budget and mcmc.
            ///
            /// 0 chooses by the size of the photos and the length of the run: `detail` for each pixel of a photo, and
            /// at most 30 for each step.
            #[cfg_attr(feature = "cli", arg(value_parser = count))]
            budget <"N">: u64 = 0;

            /// Share of the Gaussians that the strategy budget prunes after growth: those with the least weight in all
            /// photos.
            ///
            /// They cost time and show little. With 0 none are pruned.
            prune_share <"SHARE">: f64 = 0.3, up_to(0.9), setting;

            /// Share of the Gaussians left by `prune_share` that split, given masks: those most across contours.
            ///
            /// As many more are pruned. Outlines get sharper. With 0, or with `prune_share` 0, none split, as in
            /// LabelGS.
            contour_share <"SHARE">: f64 = 0.05, up_to(0.5), setting;

            /// Gaussians for each pixel of the largest photo, for --budget 0.
            ///
            /// More make finer detail and cost time.
            detail <"NUMBER">: f64 = 0.5, positive, setting;

            /// Step after which densification starts [default: a twentieth of the run, at most 500].
            ///
            /// 500 in 3DGS.
            densify_from <"STEP">: Option<u32> = None, setting;

            /// Step at which densification stops [default: half of the run].
            ///
            /// With the strategy adc, the default is at least 1000 steps after `densify_from`.
            /// Pruning and opacity resets end there too. 3DGS also stops at half of the run (15000 of 30000). LabelGS
            /// has 40000, the end of its runs: that makes 75 % more Gaussians and slower steps for the same PSNR.
            densify_until <"STEP">: Option<u32> = None, setting;

            /// Steps between two densifications [default: a thirtieth of the run, from 20 to 100].
            ///
            /// 100 in 3DGS.
            densify_interval <"STEPS">: Option<u32> = None, at_least(1), setting;

            /// Mean screen-space gradient above which a Gaussian is cloned or split, half images.
            ///
            /// 2e-4 (3DGS), in normalised device coordinates. Lower values make more Gaussians.
            densify_grad_threshold <"GRADIENT">: f32 = 2e-4, positive, setting;

            /// Steps between two opacity resets; 0 makes none.
            ///
            /// 0: after resets (3DGS: every 3000 steps) Gaussians next to the cameras replace the sky and other distant
            /// things, and views between those cameras look foggy.
            opacity_reset_interval <"STEPS">: u32 = 0, setting;

            /// Steps without an opacity reset at the end of the run.
            ///
            /// 1500 (LabelGS).
            opacity_reset_margin <"STEPS">: u32 = 1500, setting;
        }

        "Labels" {
            /// First step with labels [default: 0.6 of the run].
            ///
            /// From this step on Gaussians get labels, and labels have a loss. LabelGS has 1000; labels from the end of
            /// densification on cost the picture nothing, and objects are as good.
            label_from <"STEP">: Option<u32> = None, setting;

            /// Rule that gives a Gaussian its label.
            ///
            /// Votes; the rule of the paper is `main`, which uses `label_threshold` and `gpf`.
            label_rule <"RULE">: LabelRule = LabelRule::Votes, fixed, setting;

            /// Steps between two counts of votes [default: half of the run].
            vote_every <"STEPS">: Option<u32> = None, at_least(1), setting;

            /// Width of the band along mask contours that is left out, px.
            ///
            /// 0: masks count as exact. 2 suits masks of trackers, which work on shrunk photos. Pixels in the band have
            /// neither votes nor label loss.
            mask_border <"PX">: u32 = 0;

            /// Least blending weight with which a pixel gives its label to a Gaussian.
            ///
            /// 0.6 (LabelGS). Higher values label fewer Gaussians with more certainty.
            label_threshold <"WEIGHT">: f32 = 0.6, positive_up_to(1.0), setting;

            /// Gaussian projection filter: the projected centre must lie in the mask too.
            ///
            /// On (LabelGS).
            gpf <"SWITCH">: bool = true, setting;

            /// Steps between two with object layers; 0 makes none [default: 8; 1 with the label rule main].
            ///
            /// Such a step renders each sampled object alone on black, and compares it with its pixels of the photo,
            /// without occluders; its label loss counts this many times. 1 is LabelGS, which takes up to twice the
            /// time. The other steps with labels reduce the weight of wrong labels in the scene's own picture, by
            /// opacity only.
            layer_every <"STEPS">: Option<u32> = None, fixed, setting;

            /// Objects per step.
            ///
            /// 10 (LabelGS, to bound memory). Each step samples them anew, for labels and label loss.
            #[cfg_attr(feature = "cli", arg(value_parser = samples))]
            label_samples <"N|all">: u32 = 10, at_least(1), setting;

            /// Weight of the label loss.
            ///
            /// 0.15 for the sum over the objects of a step. LabelGS's code has 1.0 (the paper gives no value for lambda
            /// 2); that lowers the quality of the picture and does not improve the objects.
            label_weight <"WEIGHT">: f32 = 0.15, not_negative, setting;

            /// Weighs small objects more per pixel than large ones.
            ///
            /// Off (LabelGS). On: the weight is proportional to 1 / sqrt(area in the view). With votes, small objects
            /// survive without it, and it lowers the quality of the picture.
            label_balance <"SWITCH">: bool = false, setting;

            /// Weight of the alpha term in the label loss.
            ///
            /// 1; LabelGS has none. The term compares the opacity of an object alone with its mask, where that is off
            /// by more than a half, and not in pixels of other objects. Without it what hides behind other things turns
            /// black rather than clear, and shows when the object is taken out. Higher weights lower the quality of the
            /// picture.
            label_alpha <"WEIGHT">: f32 = 1.0, not_negative, setting;

            /// Source of the occluders.
            ///
            /// Rendered depth. The label loss leaves out the pixels of objects in front.
            occlusion <"SOURCE">: Occlusion = Occlusion::Rendered, fixed, setting;

            /// Steps between two updates of the occluders [default: half of the run].
            occlusion_every <"STEPS">: Option<u32> = None, at_least(1), setting;
        }

        "Learning rates" {
            /// Factor of the learning rates of positions, scales, rotations and colours [default: (30000 /
            /// iterations)^0.3, from 1 to 3].
            ///
            /// The rates are those of 3DGS for 30000 steps; a shorter run has to travel as far in fewer steps.
            rate_factor <"FACTOR">: Option<f64> = None, positive, setting;

            /// Learning rates at the last step, as a share of those before 0.6 of the run.
            ///
            /// The rates of all parameters fall log-linearly. 3DGS lowers that of positions only.
            rate_final <"SHARE">: f64 = 0.1, positive_up_to(1.0), setting;

            /// Initial learning rate of positions, scene extents.
            ///
            /// 1.6e-4 (3DGS).
            position_lr_init <"RATE">: f64 = 1.6e-4, positive, setting;

            /// Final learning rate of positions, scene extents.
            ///
            /// 1.6e-6 (3DGS), at step 30000; log-linear in between.
            position_lr_final <"RATE">: f64 = 1.6e-6, positive, setting;

            /// Learning rate of the colour of degree 0.
            ///
            /// 2.5e-3 (3DGS).
            feature_lr <"RATE">: f64 = 2.5e-3, not_negative, setting;

            /// Learning rate of opacity logits.
            ///
            /// 0.05 (3DGS of 2023).
            opacity_lr <"RATE">: f64 = 0.05, not_negative, setting;

            /// Learning rate of log-scales.
            ///
            /// 0.005 (3DGS).
            scaling_lr <"RATE">: f64 = 0.005, not_negative, setting;

            /// Learning rate of quaternions.
            ///
            /// 0.001 (3DGS).
            rotation_lr <"RATE">: f64 = 0.001, not_negative, setting;
        }
    }
}

impl TrainConfig {
    /// Refuses invalid values; messages name the option.
    pub fn check(&self) -> Result<()> {
        self.check_ranges()?;
        let refuse = |setting: Setting, problem: String| Err(Error::usage(setting, problem));
        if self.label_rule == LabelRule::Main && self.layer_every() != 1 {
            return refuse(Setting("label_rule"), format!("is main, which needs {}", Setting("layer_every").to(1)));
        }
        if let Some([x0, y0, z0, x1, y1, z1]) = self.grow_box
            && !(x0 < x1 && y0 < y1 && z0 < z1)
        {
            return refuse(Setting("grow_box"), "is empty; the smaller corner comes first".into());
        }
        if self.random_background && self.exposure == ExposureMode::On {
            let problem =
                format!("is on, which needs {}: a random background has no exposure", Setting("exposure").to("off"));
            return refuse(Setting("random_background"), problem);
        }
        Ok(())
    }
}
