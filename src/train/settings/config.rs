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
            /// Schedules and learning rates scale with this number. Short runs of 3DGS use 7000, LabelGS uses 15000.
            #[cfg_attr(feature = "cli", arg(aliases = ["steps", "iters"]))]
            iterations <"N">: u32 = 7_000, at_least(1);

            /// Photo size in the first steps, as a share of full size; 1 trains at full size throughout [default: 0.4,
            /// but at most 160 px].
            ///
            /// The size grows until the step `full_size_from`. Early steps need no fine detail, and smaller photos make
            /// them faster. 3DGS trains at full size.
            start_size <"SHARE">: Option<f32> = None, positive_up_to(1.0), setting;

            /// First step at full photo size [default: 0.6 of the run, later in a short run on large photos].
            ///
            /// Labels are trained from this step at the earliest.
            full_size_from <"STEP">: Option<u32> = None, setting;

            /// Random seed. The same seed, device and driver give the same model.
            ///
            /// The seed determines the order of views, the sampled objects and the splits of Gaussians.
            seed <"S">: u64 = 0, fixed;

            /// Maximum number of Gaussians, such as 500k or 2M; 0 uses what device memory allows.
            ///
            /// At the maximum, only the Gaussians with the largest gradients are split or cloned. The initial points
            /// are thinned to half of the maximum, or to 4 times the budget if there is no maximum.
            #[cfg_attr(feature = "cli", arg(value_parser = count))]
            max_gaussians <"N">: u64 = 0;

            /// Weight of known depths in the loss [default: 0.3 if the reconstruction lists which photo shows which
            /// point, else 0].
            ///
            /// Depths are known where the photo shows a point, or where --depths has a value. The loss is the relative
            /// depth error of the blended Gaussians, at most 1, averaged over these pixels. The weight falls linearly
            /// to 0 at the first step with labels. Only opacities get gradients from it.
            depth_weight <"WEIGHT">: Option<f64> = None, not_negative, fixed, setting;

            /// Train with antialiasing (Mip-Splatting).
            ///
            /// Smaller renders do not shimmer, and close-ups show no needles: blur lowers opacity, and no Gaussian is
            /// smaller than a pixel of its nearest photo. Renders at photo size do not improve. Viewers that ignore the
            /// flag in the model file draw fine parts too thick.
            antialias <"SWITCH">: bool = false, fixed;

            /// Degree of the spherical harmonics, 0 to 3.
            ///
            /// Lower degrees save memory and lose highlights. 3DGS uses 3.
            sh_degree <"DEGREE">: u32 = 3, up_to(3.0), fixed, setting;

            /// Precision of the optimiser's two moments per parameter: 32 bits or 16 bits.
            ///
            /// Use `half` for a scene that does not fit otherwise: it takes 8 bytes per parameter instead of 12, on the
            /// device and in checkpoints, at the same quality. Rounding is random but reproducible with the same seed.
            moments <"KIND">: Moments = Moments::Full, fixed, setting;

            /// Steps between two increases of the degree [default: a tenth of the run, at most 1000].
            ///
            /// 3DGS uses 1000.
            sh_degree_interval <"STEPS">: Option<u32> = None, at_least(1), setting;
        }

        "Rendering" {
            /// Background colour: a name such as white, #rrggbb, or R,G,B from 0 to 1.
            ///
            /// The label loss always uses black. LabelGS and 3DGS use black too.
            #[cfg_attr(feature = "cli", arg(value_parser = colour))]
            background <"COLOUR">: [f32; 3] = [0.0; 3], up_to(1.0), fixed;

            /// Use a new random background colour in every step.
            ///
            /// No background-coloured Gaussians survive, because no fixed colour matches. Transparent photos are
            /// blended over the same colour. Renders and scores use --background.
            random_background <"SWITCH">: bool = false, fixed;

            /// Train the exposure and white balance of each photo.
            ///
            /// The rendered colours are multiplied by one matrix per photo. The model keeps the mean exposure.
            exposure <"MODE">: ExposureMode = ExposureMode::Auto, fixed;

            /// Refine the camera poses during training.
            ///
            /// Use it if the poses of the reconstruction are off by pixels. The refined poses are written beside the
            /// model.
            refine_poses <"SWITCH">: bool = false, fixed;

            /// Near plane, world units; closer Gaussians are not drawn.
            ///
            /// 0 chooses by the scene: 0.2 as in 3DGS, or a twentieth of the median depth of the initial Gaussians if
            /// that is less.
            near <"Z">: f32 = 0.0, not_negative, setting;
        }

        "Densification" {
            /// Densification strategy.
            strategy <"RULE">: StrategyKind = StrategyKind::Budget, fixed, setting;

            /// Prune floaters close to the cameras.
            ///
            /// A Gaussian is pruned if it is four times closer to a camera than the nearest initial Gaussians in view,
            /// or if its standard deviation exceeds half of its distance from a camera. 3DGS keeps such Gaussians;
            /// there they stand in for the sky and other distant things.
            free_space <"SWITCH">: bool = true, setting;

            /// Number of directions in which far Gaussians are tried; 0 adds none.
            ///
            /// Far Gaussians represent the sky and other distant things without points. One is added in each direction
            /// in which most photos show nothing of the point cloud. 3DGS has no such Gaussians.
            far_points <"N">: u32 = 800, setting;

            /// Box in which Gaussians are added, world units, minimum corner first [default: everywhere].
            ///
            /// Outside of the box, Gaussians are trained and pruned, but none is added. Use it to save time if the
            /// photos show more than you need. Then run `labelgs clean --inside` to remove the rest.
            #[cfg_attr(feature = "cli", arg(value_parser = corners, allow_hyphen_values = true))]
            grow_box <"x0,y0,z0,x1,y1,z1">: Option<[f64; 6]> = None;

            /// Weight of the mean opacity in the loss [default: 0.01 with the strategy mcmc, else 0].
            ///
            /// It makes Gaussians fade that no photo supports. The strategy adc ignores it.
            opacity_weight <"WEIGHT">: Option<f64> = None, not_negative, setting;

            /// Weight of the mean standard deviation, in scene extents, in the loss [default: 0.01 with the strategy
            /// mcmc, else 0].
            ///
            /// The strategy adc ignores it.
            scale_weight <"WEIGHT">: Option<f64> = None, not_negative, setting;

            /// Number of Gaussians at the end of densification, such as 30k, for the strategies budget and mcmc.
            ///
            /// 0 chooses by photo size and run length: `detail` Gaussians per pixel of a photo, and at most 30 per
            /// step.
            #[cfg_attr(feature = "cli", arg(value_parser = count))]
            budget <"N">: u64 = 0;

            /// Share of the Gaussians that the strategy budget prunes after growth, lowest weight in all photos first.
            ///
            /// These Gaussians cost time and contribute little. 0 prunes none.
            prune_share <"SHARE">: f64 = 0.3, up_to(0.9), setting;

            /// Share of the Gaussians to split at mask contours after `prune_share`, those that cross contours most
            /// first.
            ///
            /// Outlines get sharper. As many more Gaussians are pruned, so the count stays. No Gaussian is split if
            /// this value or `prune_share` is 0, as in LabelGS.
            contour_share <"SHARE">: f64 = 0.05, up_to(0.5), setting;

            /// Gaussians per pixel of the largest photo, used with --budget 0.
            ///
            /// Higher values give finer detail and cost time.
            detail <"NUMBER">: f64 = 0.5, positive, setting;

            /// Step after which densification starts [default: a twentieth of the run, at most 500].
            ///
            /// 3DGS uses 500.
            densify_from <"STEP">: Option<u32> = None, setting;

            /// Step at which densification stops [default: half of the run].
            ///
            /// Pruning and opacity resets stop there too. With the strategy adc, the default is at least 1000 steps
            /// after `densify_from`. 3DGS also stops at half of the run (15000 of 30000). LabelGS uses 40000, the end
            /// of its runs; that gives 75 % more Gaussians and slower steps at the same PSNR.
            densify_until <"STEP">: Option<u32> = None, setting;

            /// Steps between two densifications [default: a thirtieth of the run, from 20 to 100].
            ///
            /// 3DGS uses 100.
            densify_interval <"STEPS">: Option<u32> = None, at_least(1), setting;

            /// Mean screen-space gradient above which a Gaussian is cloned or split, half images.
            ///
            /// The gradient is in normalised device coordinates. Lower values give more Gaussians. 3DGS uses 2e-4.
            densify_grad_threshold <"GRADIENT">: f32 = 2e-4, positive, setting;

            /// Steps between two opacity resets; 0 turns resets off.
            ///
            /// 3DGS resets every 3000 steps. After a reset, Gaussians next to the cameras replace the sky and other
            /// distant things, so views between the cameras look foggy.
            opacity_reset_interval <"STEPS">: u32 = 0, setting;

            /// Steps without an opacity reset at the end of the run.
            ///
            /// LabelGS uses 1500.
            opacity_reset_margin <"STEPS">: u32 = 1500, setting;
        }

        "Labels" {
            /// First step with labels [default: 0.6 of the run].
            ///
            /// From this step, Gaussians get labels and the label loss applies. LabelGS uses 1000. Starting after
            /// densification gives equally good objects and costs no image quality.
            label_from <"STEP">: Option<u32> = None, setting;

            /// Rule that gives a Gaussian its label.
            ///
            /// The paper uses `main`, with the settings `label_threshold` and `gpf`.
            label_rule <"RULE">: LabelRule = LabelRule::Votes, fixed, setting;

            /// Steps between two counts of votes [default: half of the run].
            vote_every <"STEPS">: Option<u32> = None, at_least(1), setting;

            /// Width of the band along mask contours to ignore, px.
            ///
            /// Pixels in the band neither vote nor count in the label loss. 0 treats masks as exact. Use 2 for tracker
            /// masks, which are made on shrunk photos.
            mask_border <"PX">: u32 = 0;

            /// Minimum blending weight for a pixel to give its label to a Gaussian.
            ///
            /// Higher values label fewer Gaussians, with more certainty. LabelGS uses 0.6.
            label_threshold <"WEIGHT">: f32 = 0.6, positive_up_to(1.0), setting;

            /// Gaussian projection filter: require the projected centre to lie in the mask.
            ///
            /// LabelGS has it on.
            gpf <"SWITCH">: bool = true, setting;

            /// Render object layers every N-th step; 0 never does [default: 8, or 1 with the label rule main].
            ///
            /// A step with object layers renders each sampled object alone on black and compares it with the object's
            /// pixels in the photo, ignoring occluders. Its label loss is multiplied by N. The other steps reduce the
            /// weight of wrong labels in the full render, by opacity only. LabelGS uses 1, which takes up to twice the
            /// time.
            layer_every <"STEPS">: Option<u32> = None, fixed, setting;

            /// Number of objects sampled per step.
            ///
            /// The samples are used for labels and for the label loss. LabelGS uses 10 to limit memory.
            #[cfg_attr(feature = "cli", arg(value_parser = samples))]
            label_samples <"N|all">: u32 = 10, at_least(1), setting;

            /// Weight of the label loss.
            ///
            /// The loss is a sum over the sampled objects of a step. The LabelGS code uses 1.0 (the paper gives no
            /// value for its lambda 2). That lowers image quality and does not improve the objects.
            label_weight <"WEIGHT">: f32 = 0.15, not_negative, setting;

            /// Give small objects a higher weight per pixel.
            ///
            /// The weight is proportional to 1 / sqrt(area in the view). It lowers image quality, and with the label
            /// rule votes small objects survive without it. LabelGS has it off.
            label_balance <"SWITCH">: bool = false, setting;

            /// Weight of the alpha term in the label loss.
            ///
            /// The term compares the opacity of an object, rendered alone, with its mask. It counts where they differ
            /// by more than 0.5, outside of other objects. Without it, hidden parts of an object turn black instead of
            /// transparent, which shows when you extract the object. Higher weights lower image quality. LabelGS has no
            /// such term.
            label_alpha <"WEIGHT">: f32 = 1.0, not_negative, setting;

            /// Source of the occluders of each object.
            ///
            /// The label loss ignores pixels of objects in front.
            occlusion <"SOURCE">: Occlusion = Occlusion::Rendered, fixed, setting;

            /// Steps between two updates of the occluders [default: half of the run].
            occlusion_every <"STEPS">: Option<u32> = None, at_least(1), setting;
        }

        "Learning rates" {
            /// Factor on the learning rates of positions, scales, rotations and colours [default: (30000 /
            /// iterations)^0.3, from 1 to 3].
            ///
            /// The learning rates are tuned for the 30000 steps of 3DGS. A shorter run needs larger steps.
            rate_factor <"FACTOR">: Option<f64> = None, positive, setting;

            /// Final learning rates, as a share of the rates in the first 0.6 of the run.
            ///
            /// The rates of all parameters fall log-linearly. 3DGS lowers only the position rate.
            rate_final <"SHARE">: f64 = 0.1, positive_up_to(1.0), setting;

            /// Initial learning rate of positions, scene extents.
            ///
            /// 3DGS uses 1.6e-4.
            position_lr_init <"RATE">: f64 = 1.6e-4, positive, setting;

            /// Final learning rate of positions, scene extents.
            ///
            /// The rate falls log-linearly. 3DGS reaches 1.6e-6 at step 30000.
            position_lr_final <"RATE">: f64 = 1.6e-6, positive, setting;

            /// Learning rate of the colour of degree 0.
            ///
            /// 3DGS uses 2.5e-3.
            feature_lr <"RATE">: f64 = 2.5e-3, not_negative, setting;

            /// Learning rate of opacity logits.
            ///
            /// 3DGS of 2023 uses 0.05.
            opacity_lr <"RATE">: f64 = 0.05, not_negative, setting;

            /// Learning rate of log-scales.
            ///
            /// 3DGS uses 0.005.
            scaling_lr <"RATE">: f64 = 0.005, not_negative, setting;

            /// Learning rate of quaternions.
            ///
            /// 3DGS uses 0.001.
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
