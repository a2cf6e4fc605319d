//! Every hyper-parameter of training: value, source, effect.
//!
//! Defaults are what LabelGS and 3DGS print or ship. "LabelGS" below is the paper (arXiv 2508.19699) with its authors'
//! code, "3DGS" is Kerbl et al. 2023 with its code.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Where the label loss gets its occluders from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Occlusion {
    /// No occluder is known: every pixel outside an object's mask is expected to be black.
    None,
    /// Monocular depth from files, --depths, by the paper's rule: who is nearer on the average along the contour.
    Depth,
    /// Depth of the model itself, rendered every [`TrainConfig::occlusion_every`] steps. The paper asks a network for
    /// monocular depth instead.
    #[default]
    Rendered,
    /// Lists from a file, --occlusion-file.
    #[value(skip)]
    File,
}

/// How a Gaussian gets its label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum LabelRule {
    /// From the pixels of the step's view in which it has most weight; the last view wins (LabelGS).
    Main,
    /// From the sums of its weights in the pixels of all views, counted every [`TrainConfig::vote_every`] steps and at
    /// the end.
    #[default]
    Votes,
}

/// What a training run does, decided. `Default` is the paper's setting but for labels, where it is what was measured to
/// be better; [`TrainConfig::paper`] is the paper's throughout.
///
/// Steps count from 1, as in the reference code.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainConfig {
    /// Number of steps, one view each. 15000 (LabelGS).
    pub iterations: u32,
    /// Photos are shrunk until neither side is longer, px; 0 keeps their size. 0 (the reference shrinks to a height of
    /// 1080). Smaller is faster and loses fine texture.
    pub max_resolution: u32,
    /// Steps at the start that look at photos of half the size, without labels: a quarter of the pixels while the model is
    /// rough anyway. 0 (3DGS). With a third of the steps a run takes a tenth less time, for the same PSNR.
    pub coarse_until: u32,
    /// Every n-th view, by name, is held out for scoring; 0 trains on all. 8 (LabelGS, 3DGS).
    pub test_every: u32,
    /// Seed of every random stream: order of views, sampled objects, splits. 0 (LabelGS).
    pub seed: u64,
    /// Upper bound of the number of Gaussians; densification stops there. 0 lets the memory of the device decide.
    pub max_gaussians: u64,
    /// Colour behind the scene, r, g, b in 0 to 1. Black (LabelGS, 3DGS). The label loss is always on black.
    pub background: [f32; 3],
    /// Gaussians nearer to the camera plane are not drawn, world units. 0 lets the scene decide: 0.2 (3DGS), or a
    /// twentieth of the median depth of its first Gaussians where that is less.
    pub near: f32,

    /// First step that lifts labels and adds the label loss. 1000 (LabelGS): before, the geometry is too rough.
    pub label_from: u32,
    /// How a Gaussian gets its label. Votes; the paper's rule is `main`, to which the next two settings belong.
    pub label_rule: LabelRule,
    /// Steps between two counts of votes. 500.
    pub vote_every: u32,
    /// Masks that disagree with what all views made of the model vote with less weight. On.
    pub vote_trust: bool,
    /// Pixels so near to a contour of their mask have neither votes nor label loss, px. 0 (masks are taken as exact);
    /// 2 suits masks of trackers, which work on shrunk photos.
    pub mask_border: u32,
    /// A Gaussian gets a label only from a pixel where its blending weight is at least this. 0.6 (LabelGS). Higher
    /// labels fewer Gaussians, more surely.
    pub label_threshold: f32,
    /// Gaussian projection filter: the centre must project into the same mask. On (LabelGS).
    pub gpf: bool,
    /// Objects sampled per step for lift and label loss. 10 (LabelGS), where it bounds memory.
    pub label_samples: u32,
    /// Weight of the sum of the label losses of a step. 0.3; LabelGS's code has 1.0 (the paper's lambda 2 has no value),
    /// which costs the whole picture more and makes objects no better.
    pub label_weight: f32,
    /// Objects weigh as one over the root of their area in the view. Off (LabelGS): with votes small objects are not lost
    /// beside large ones, and the weight costs the whole picture.
    pub label_balance: bool,
    /// Weight of an alpha term in the label loss: the object's opacity against its mask. 0 (LabelGS has none). Of use for
    /// objects as dark as the black behind them, which may vanish without cost.
    pub label_alpha: f32,
    /// Source of the occluders whose pixels the label loss leaves out. Rendered depth.
    pub occlusion: Occlusion,
    /// Steps between two looks at the occluders. 1000.
    pub occlusion_every: u32,

    /// Share of D-SSIM in the photometric loss; the rest is L1. 0.2 (3DGS).
    pub lambda_dssim: f32,
    /// Degree of the spherical harmonics, 0 to 3. 3 (3DGS). Lower saves memory and loses shine.
    pub sh_degree: u32,
    /// Steps until the next degree is let in. 1000 (3DGS).
    pub sh_degree_interval: u32,

    /// Learning rate of positions at the start, in units of the scene extent. 1.6e-4 (3DGS).
    pub position_lr_init: f64,
    /// Learning rate of positions at `position_lr_max_steps`, log-linear in between. 1.6e-6 (3DGS).
    pub position_lr_final: f64,
    /// Step at which the final rate is met. 30000 (LabelGS keeps 3DGS's value for its 15000 steps).
    pub position_lr_max_steps: u32,
    /// Learning rate of the degree-0 colour. 2.5e-3 (3DGS).
    pub feature_lr: f64,
    /// Learning rate of the colours above degree 0; absent: `feature_lr` / 20 (3DGS).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feature_rest_lr: Option<f64>,
    /// Learning rate of opacity logits. 0.05 (3DGS of 2023).
    pub opacity_lr: f64,
    /// Learning rate of log-scales. 0.005 (3DGS).
    pub scaling_lr: f64,
    /// Learning rate of quaternions. 0.001 (3DGS).
    pub rotation_lr: f64,

    /// Densification starts after this step. 500 (3DGS).
    pub densify_from: u32,
    /// Densification, pruning and opacity resets end at this step; absent: at half of the run, as 3DGS does (15000 of
    /// 30000), but not before 1000 steps of densification. LabelGS has 40000, to the end of its runs: that makes three
    /// quarters more Gaussians, and slower steps, for the same PSNR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub densify_until: Option<u32>,
    /// Steps between two densifications. 100 (3DGS).
    pub densify_interval: u32,
    /// Mean screen-space gradient of a position above which a Gaussian is cloned or split, in units of half the image
    /// (normalised device coordinates). 2e-4 (3DGS). Lower grows more Gaussians.
    pub densify_grad_threshold: f32,
    /// Standard deviation, in units of the scene extent, up to which a Gaussian is cloned and above which it is split.
    /// 0.01 (3DGS).
    pub percent_dense: f32,
    /// Gaussians of lower opacity are pruned. 0.005 (3DGS).
    pub min_opacity: f32,
    /// Gaussians of a larger standard deviation, in units of the scene extent, are pruned once the first opacity reset is
    /// past; never where there is none. 0.1 (3DGS).
    pub max_scale: f32,
    /// Steps between two opacity resets; 0 makes none. 0: after resets (3DGS: 3000) Gaussians next to the cameras take the
    /// place of a sky or of what else is far, and views between those cameras turn to fog.
    pub opacity_reset_interval: u32,
    /// No opacity reset within this many steps of the end. 1500 (LabelGS).
    pub opacity_reset_margin: u32,

    /// Steps after which the model is saved besides the last one. None.
    pub save_at: Vec<u32>,
    /// Steps between two preview pictures of a held-out view; 0 makes none. 1000.
    pub preview_every: u32,
    /// Steps between two checkpoints, from which `--resume` goes on; 0 writes one at an interrupt only. 1000.
    pub checkpoint_every: u32,
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            iterations: 15_000,
            max_resolution: 0,
            coarse_until: 0,
            test_every: 8,
            seed: 0,
            max_gaussians: 0,
            background: [0.0; 3],
            near: 0.0,
            label_from: 1000,
            label_rule: LabelRule::Votes,
            vote_every: 500,
            vote_trust: true,
            mask_border: 0,
            label_threshold: 0.6,
            gpf: true,
            label_samples: 10,
            label_weight: 0.3,
            label_balance: false,
            label_alpha: 0.0,
            occlusion: Occlusion::Rendered,
            occlusion_every: 1000,
            lambda_dssim: 0.2,
            sh_degree: 3,
            sh_degree_interval: 1000,
            position_lr_init: 1.6e-4,
            position_lr_final: 1.6e-6,
            position_lr_max_steps: 30_000,
            feature_lr: 2.5e-3,
            feature_rest_lr: None,
            opacity_lr: 0.05,
            scaling_lr: 0.005,
            rotation_lr: 0.001,
            densify_from: 500,
            densify_until: None,
            densify_interval: 100,
            densify_grad_threshold: 2e-4,
            percent_dense: 0.01,
            min_opacity: 0.005,
            max_scale: 0.1,
            opacity_reset_interval: 0,
            opacity_reset_margin: 1500,
            save_at: Vec::new(),
            preview_every: 1000,
            checkpoint_every: 1000,
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

    /// Refuses values that make no sense; messages name the flag.
    pub fn check(&self) -> Result<()> {
        let positive = [
            ("--iterations", self.iterations),
            ("--label-samples", self.label_samples),
            ("--occlusion-every", self.occlusion_every),
            ("--vote-every", self.vote_every),
            ("--sh-degree-interval", self.sh_degree_interval),
            ("--position-lr-max-steps", self.position_lr_max_steps),
            ("--densify-interval", self.densify_interval),
        ];
        for (flag, value) in positive {
            if value == 0 {
                return Err(Error::usage(flag, "is 0, needs at least 1"));
            }
        }
        if self.sh_degree > 3 {
            return Err(Error::usage("--sh-degree", format!("is {}, the highest degree is 3", self.sh_degree)));
        }
        if self.test_every == 1 {
            return Err(Error::usage(
                "--test-every",
                "is 1, which leaves no view to train on; 2 or more, or --no-test",
            ));
        }
        self.check_ranges()
    }

    /// The part of [`Self::check`] that looks at real numbers.
    fn check_ranges(&self) -> Result<()> {
        let ranges = [
            ("--label-threshold", f64::from(self.label_threshold), f64::MIN_POSITIVE, 1.0),
            ("--lambda-dssim", f64::from(self.lambda_dssim), 0.0, 1.0),
            ("--min-opacity", f64::from(self.min_opacity), 0.0, 1.0),
            ("--background", f64::from(self.background[0]), 0.0, 1.0),
            ("--background", f64::from(self.background[1]), 0.0, 1.0),
            ("--background", f64::from(self.background[2]), 0.0, 1.0),
            ("--label-alpha", f64::from(self.label_alpha), 0.0, f64::MAX),
            ("--label-weight", f64::from(self.label_weight), 0.0, f64::MAX),
            ("--densify-grad-threshold", f64::from(self.densify_grad_threshold), f64::MIN_POSITIVE, f64::MAX),
            ("--percent-dense", f64::from(self.percent_dense), 0.0, f64::MAX),
            ("--max-scale", f64::from(self.max_scale), 0.0, f64::MAX),
            ("--near", f64::from(self.near), 0.0, f64::MAX),
            ("--position-lr-init", self.position_lr_init, f64::MIN_POSITIVE, f64::MAX),
            ("--position-lr-final", self.position_lr_final, f64::MIN_POSITIVE, f64::MAX),
            ("--feature-lr", self.feature_lr, 0.0, f64::MAX),
            ("--feature-rest-lr", self.feature_rest_lr(), 0.0, f64::MAX),
            ("--opacity-lr", self.opacity_lr, 0.0, f64::MAX),
            ("--scaling-lr", self.scaling_lr, 0.0, f64::MAX),
            ("--rotation-lr", self.rotation_lr, 0.0, f64::MAX),
        ];
        for (flag, value, low, high) in ranges {
            // A NaN is in no range.
            if !(low..=high).contains(&value) {
                let range = match (low, high) {
                    (0.0, f64::MAX) => "0 or more".to_owned(),
                    (_, f64::MAX) => "more than 0".to_owned(),
                    (0.0, high) => format!("0 to {high}"),
                    (_, high) => format!("more than 0, at most {high}"),
                };
                return Err(Error::usage(flag, format!("is {value}, needs {range}")));
            }
        }
        Ok(())
    }
}
