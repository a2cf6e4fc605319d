//! The settings of a step: schedules and learning rates.

use crate::train::{ExposureMode, LabelRule, StrategyKind, TrainConfig};

/// Run length that the 3DGS learning rates are meant for, steps.
const LONG_RUN_STEPS: f64 = 30_000.0;
/// Exponent of the rate factor. Rates of a run of N steps are multiplied by (LONG_RUN_STEPS / N)^RATE_POWER, at most by
/// RATE_MAX.
const RATE_POWER: f64 = 0.3;
/// Largest rate factor.
const RATE_MAX: f64 = 3.0;
/// Share of the run after which the rates fall.
const RATE_FALL_FROM_SHARE: f64 = 0.6;
/// Step at which the position learning rate is final; LabelGS keeps the 3DGS value for its 15000 steps.
const POSITION_LR_STEPS: f64 = 30_000.0;
/// Divisor of the degree-0 colour rate that gives the rate of higher degrees (3DGS).
const FEATURE_REST_DIVISOR: f64 = 20.0;
/// Fewest densification steps with the 3DGS strategy.
const ADC_STEPS_MIN: u32 = 1000;
/// Default budget: most Gaussians per step of the run.
const GAUSSIANS_PER_STEP_MAX: f64 = 30.0;
/// Photo size in the first steps, as a share of full size.
const START_SIZE_SHARE: f32 = 0.4;
/// Longest photo side in the first steps, px.
const START_SIDE_MAX_PX: f32 = 160.0;
/// Share of the run after which photos have full size.
const FULL_SIZE_FROM_SHARE: f64 = 0.6;
/// The same for a run that is too short to resolve full size.
const FULL_SIZE_FROM_SHARE_MAX: f64 = 0.9;
/// Weights of opacity and size in the loss (3DGS-MCMC).
const REGULARISER_WEIGHT: f64 = 0.01;
/// Share of the run in which Gaussians relocate (3DGS-MCMC).
const RELOCATE_UNTIL_SHARE: f64 = 25.0 / 30.0;
/// Share of the run after which Gaussians with little weight are pruned, and those across contours split. It is soon
/// after growth, so that the others can adapt.
const EXCHANGE_AT_SHARE: f64 = 0.55;

/// Interval between steps with object layers. Only these steps see hidden parts of objects, and they cost up to twice
/// as much.
const LAYER_STEP_INTERVAL: u32 = 8;
/// Interval between steps with label disagreement, which is weighted accordingly.
const DISAGREEMENT_STEP_INTERVAL: u32 = 2;
/// Interval between vote counts, as a share of the run. Counting visits all views, so by default it happens when labels
/// start and at the end.
const VOTE_INTERVAL_SHARE: f64 = 0.5;
/// Interval between searches for occluders, as a share of the run, for the same reason.
const OCCLUSION_INTERVAL_SHARE: f64 = 0.5;
/// Share of the run after which known depths have no weight.
const DEPTHS_UNTIL_SHARE: f64 = 0.6;

/// Learning rates of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Positions, scene extents.
    pub position: f64,
    /// Opacity logits.
    pub opacity: f64,
    /// Log-scales.
    pub scale: f64,
    /// Quaternions.
    pub rotation: f64,
    /// Colour of degree 0.
    pub colour: f64,
    /// Colours above degree 0.
    pub colour_rest: f64,
}

impl TrainConfig {
    /// Returns a share of the run in steps.
    fn share(&self, share: f64) -> u32 {
        (share * f64::from(self.iterations)).round() as u32
    }

    pub(in crate::train) fn rate_factor(&self) -> f64 {
        let derived = (LONG_RUN_STEPS / f64::from(self.iterations)).powf(RATE_POWER).clamp(1.0, RATE_MAX);
        self.rate_factor.unwrap_or(derived)
    }

    /// Returns the decay factor of all rates at `step`.
    pub(in crate::train) fn rate_fall(&self, step: u32) -> f64 {
        let from = self.share(RATE_FALL_FROM_SHARE);
        let late = f64::from(step.saturating_sub(from)) / f64::from((self.iterations - from).max(1));
        self.rate_final.powf(late.min(1.0))
    }

    /// Returns the learning rates of `step`.
    pub fn rates_at(&self, step: u32) -> Rates {
        let t = (f64::from(step) / POSITION_LR_STEPS).clamp(0.0, 1.0);
        let position = ((1.0 - t) * self.position_lr_init.ln() + t * self.position_lr_final.ln()).exp();
        let (fall, factor) = (self.rate_fall(step), self.rate_factor() * self.rate_fall(step));
        Rates {
            position: factor * position,
            opacity: fall * self.opacity_lr,
            scale: factor * self.scaling_lr,
            rotation: factor * self.rotation_lr,
            colour: factor * self.feature_lr,
            colour_rest: factor * (self.feature_lr / FEATURE_REST_DIVISOR),
        }
    }

    pub(in crate::train) fn halve_rates(&mut self) {
        for rate in [
            &mut self.position_lr_init,
            &mut self.position_lr_final,
            &mut self.feature_lr,
            &mut self.opacity_lr,
            &mut self.scaling_lr,
            &mut self.rotation_lr,
        ] {
            *rate *= 0.5;
        }
    }

    /// Returns the degree of the spherical harmonics at `step`.
    pub fn sh_degree_at(&self, step: u32) -> u32 {
        (step / self.sh_interval()).min(self.sh_degree)
    }

    pub(crate) fn sh_interval(&self) -> u32 {
        self.sh_degree_interval.unwrap_or(self.share(0.1).min(1000)).max(1)
    }

    /// Returns the first step at full size.
    pub fn full_size_from(&self) -> u32 {
        if self.start_size == Some(1.0) { 0 } else { self.full_size_from.unwrap_or(self.share(FULL_SIZE_FROM_SHARE)) }
    }

    /// Returns true for steps that set labels and have a label loss, given masks.
    pub fn labels_at(&self, step: u32) -> bool {
        step >= self.labels_from()
    }

    /// Returns the first step with labels; steps on downscaled photos have none.
    pub fn labels_from(&self) -> u32 {
        self.label_from.unwrap_or(self.share(0.6)).max(self.full_size_from())
    }

    /// Returns the interval of steps with object layers; 0 for none.
    pub fn layer_every(&self) -> u32 {
        self.layer_every.unwrap_or(if self.label_rule == LabelRule::Main { 1 } else { LAYER_STEP_INTERVAL })
    }

    /// Returns true for steps with labels that also render objects alone.
    pub fn has_layers_at(&self, step: u32) -> bool {
        self.layer_every() > 0 && self.is_label_turn(step, self.layer_every())
    }

    /// Returns the interval of steps with label disagreement; the paper's rule lifts labels in every step.
    pub fn disagreement_every(&self) -> u32 {
        if self.label_rule == LabelRule::Main { 1 } else { DISAGREEMENT_STEP_INTERVAL }
    }

    /// Returns true for steps with label disagreement, if they have no object layers.
    pub fn has_disagreement_at(&self, step: u32) -> bool {
        // Starts with the second step with labels, because the first has layers.
        self.labels_at(step) && self.is_label_turn(step + 1, self.disagreement_every())
    }

    /// Returns true if the votes are counted before `step`.
    pub fn counts_votes_at(&self, step: u32) -> bool {
        self.is_label_turn(step, self.vote_every.unwrap_or(self.share(VOTE_INTERVAL_SHARE)))
    }

    /// Returns true if the occluders are updated before `step`.
    pub fn updates_occluders_at(&self, step: u32) -> bool {
        self.is_label_turn(step, self.occlusion_every.unwrap_or(self.share(OCCLUSION_INTERVAL_SHARE)))
    }

    fn is_label_turn(&self, step: u32, every: u32) -> bool {
        self.labels_at(step) && (step - self.labels_from()).is_multiple_of(every.max(1))
    }

    pub(in crate::train) fn has_depths(&self) -> bool {
        self.depth_weight.is_some_and(|weight| weight > 0.0)
    }

    pub(in crate::train) fn depths_until(&self) -> u32 {
        if self.has_depths() { self.labels_from().min(self.share(DEPTHS_UNTIL_SHARE)) } else { 0 }
    }

    /// Returns the weight of known depths at `step`.
    pub fn depth_weight_at(&self, step: u32) -> f64 {
        self.depth_weight.unwrap_or(0.0) * (1.0 - f64::from(step) / f64::from(self.depths_until().max(1))).max(0.0)
    }

    /// Returns the step after which densification starts.
    pub fn densify_from(&self) -> u32 {
        self.densify_from.unwrap_or(self.share(0.05).min(500))
    }

    /// Returns the number of Gaussians suitable for a photo size, regardless of run length.
    fn pixel_budget(&self, (width, height): (u32, u32)) -> f64 {
        self.detail * f64::from(width) * f64::from(height)
    }

    /// Returns the budget for a photo size in a run that is long enough; `None` for strategies without a budget.
    pub(in crate::train) fn full_budget(&self, size: (u32, u32)) -> Option<u64> {
        let budget = if self.budget > 0 { self.budget } else { self.pixel_budget(size).max(1.0) as u64 };
        (self.strategy != StrategyKind::Adc).then_some(budget)
    }

    /// Decides open settings: budget, first photo size and first step at full size by the photo size, and the interval
    /// of object layers.
    pub fn for_size(&self, (width, height): (u32, u32)) -> Self {
        let by_pixels = self.pixel_budget((width, height));
        let by_steps = GAUSSIANS_PER_STEP_MAX * f64::from(self.iterations);
        let budget = if self.budget > 0 { self.budget } else { by_pixels.min(by_steps).max(1.0) as u64 };
        let start_size =
            self.start_size.unwrap_or(START_SIZE_SHARE.min(START_SIDE_MAX_PX / width.max(height).max(1) as f32));
        // Photo side that the number of Gaussians allowed by the steps can resolve, as a share of full size.
        let resolved = (by_steps / by_pixels).min(1.0).sqrt();
        let derived = self.share(resolved * FULL_SIZE_FROM_SHARE + (1.0 - resolved) * FULL_SIZE_FROM_SHARE_MAX);
        let full_size_from = Some(self.full_size_from.unwrap_or(derived));
        let layer_every = Some(self.layer_every());
        Self { budget, start_size: Some(start_size), full_size_from, layer_every, ..self.clone() }
    }

    /// Takes over what the start of the run decided, where the settings are open.
    pub(crate) fn keep_decided(&mut self, then: &Self) {
        self.near = if self.near == 0.0 { then.near } else { self.near };
        self.budget = if self.budget == 0 { then.budget } else { self.budget };
        self.exposure = if self.exposure == ExposureMode::Auto { then.exposure } else { self.exposure };
        self.depth_weight = self.depth_weight.or(then.depth_weight);
        self.start_size = self.start_size.or(then.start_size);
        self.full_size_from = self.full_size_from.or(then.full_size_from);
        self.layer_every = self.layer_every.or(then.layer_every);
        self.sh_degree_interval = self.sh_degree_interval.or(then.sh_degree_interval);
    }

    /// Returns the most Gaussians after a densification at `step`. It rises linearly from `start` to the budget.
    pub fn budget_at(&self, step: u32, start: u64) -> u64 {
        let (from, last) = (self.densify_from(), self.densify_until().saturating_sub(self.densify_interval()));
        let part = f64::from(step.saturating_sub(from)) / f64::from(last.saturating_sub(from).max(1));
        start + (self.budget.saturating_sub(start) as f64 * part.min(1.0)) as u64
    }

    fn densify_interval(&self) -> u32 {
        self.densify_interval.unwrap_or(self.share(1.0 / 30.0).clamp(20, 100)).max(1)
    }

    /// Returns the step at which densification stops.
    pub fn densify_until(&self) -> u32 {
        // The 3DGS schedule starts late, whatever the run length.
        let least =
            if self.strategy == StrategyKind::Adc { self.densify_from().saturating_add(ADC_STEPS_MIN) } else { 0 };
        self.densify_until.unwrap_or(self.share(0.5).max(least))
    }

    pub(in crate::train) fn opacity_weight(&self) -> f64 {
        self.opacity_weight.unwrap_or(self.regular())
    }

    pub(in crate::train) fn scale_weight(&self) -> f64 {
        self.scale_weight.unwrap_or(self.regular())
    }

    fn regular(&self) -> f64 {
        if self.strategy == StrategyKind::Mcmc { REGULARISER_WEIGHT } else { 0.0 }
    }

    /// Returns true for steps that end with a relocation.
    pub fn relocates_at(&self, step: u32) -> bool {
        let until = self.densify_until().max(self.share(RELOCATE_UNTIL_SHARE));
        step < until && step > self.densify_from() && step.is_multiple_of(self.densify_interval())
    }

    /// Returns true for steps after densification that end with pruning.
    pub fn prunes_at(&self, step: u32) -> bool {
        step >= self.densify_until() && step.is_multiple_of(2 * self.densify_interval())
    }

    /// Returns true for the step after which Gaussians with little weight are replaced.
    pub fn exchanges_at(&self, step: u32) -> bool {
        step == self.share(EXCHANGE_AT_SHARE) && self.prune_share > 0.0
    }

    /// Returns true for steps that end with a densification.
    pub fn densifies_at(&self, step: u32) -> bool {
        step < self.densify_until() && step > self.densify_from() && step.is_multiple_of(self.densify_interval())
    }
}
