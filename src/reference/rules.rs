//! All constants of the method: the engine's f32 values, widened to f64.
//!
//! This is an independent copy, so that an error in the shaders' constants does not enter the mirrors; a test of the
//! engine compares the two (`tests/verify/constants.rs`).

use glam::DVec3;
use labelgs_scene::Zone;

/// Larger gradients are dropped: their square overflows in Adam.
pub const GRADIENT_MAX: f32 = 1e18;

/// The f32 constant as f64.
pub fn wide(value: f32) -> f64 {
    f64::from(value)
}

/// Declares the constants with their values.
macro_rules! rules {
    ($($(#[$doc:meta])+ $name:ident: $type:ty = $value:expr,)+) => {
        /// Constants of all passes.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Rules {
            $($(#[$doc])+ pub $name: $type,)+
        }

        impl Default for Rules {
            fn default() -> Self {
                Self { $($name: $value,)+ }
            }
        }
    };
}

rules! {
    /// Camera-space depth up to which a Gaussian is not drawn, world units.
    near: f64 = wide(0.2),
    /// Added to the diagonal of the 2-D covariance, px^2.
    dilation: f64 = wide(0.3),
    /// Reduces opacity to compensate for the dilation, so that a splat's light stays the same.
    antialiased: bool = false,
    /// Smallest standard deviation of a smooth Gaussian, in pixels of its nearest view.
    finest: f64 = 0.2_f64.sqrt(),
    /// Margin around the image within which a view counts for that, as a share of the image size.
    smooth_margin: f64 = wide(0.15),
    /// Limit of x/z and y/z in the Jacobian beyond the image, in units of tan(fov/2).
    jacobian_margin: f64 = wide(0.3),
    /// Smallest alpha that counts.
    alpha_min: f64 = wide(1.0 / 255.0),
    /// Largest alpha.
    alpha_max: f64 = wide(0.99),
    /// The ray ends before a splat that would leave less transmittance than this.
    transmittance_min: f64 = wide(1e-4),
    /// Added to the colour of the spherical harmonics.
    colour_bias: f64 = wide(0.5),
    /// Spherical-harmonics factor, degree 0.
    sh_c0: f64 = wide(0.282_094_79),
    /// Spherical-harmonics factor, degree 1.
    sh_c1: f64 = wide(0.488_602_5),
    /// Spherical-harmonics factors, degree 2, in the order xy, yz, 2zz-xx-yy, xz, xx-yy.
    sh_c2: [f64; 5] = [1.092_548_4, -1.092_548_4, 0.315_391_57, -1.092_548_4, 0.546_274_2].map(wide),
    /// Spherical-harmonics factors, degree 3, in the order of `sh::basis`.
    sh_c3: [f64; 7] =
        [-0.590_043_6, 2.890_611_4, -0.457_045_8, 0.373_176_34, -0.457_045_8, 1.445_305_7, -0.590_043_6].map(wide),
    /// Weight of the absolute difference in the photo loss.
    l1_weight: f64 = wide(0.8),
    /// Weight of 1 - SSIM in the photo loss.
    dssim_weight: f64 = wide(0.2),
    /// Weight of the label loss (lambda 2).
    label_weight: f64 = 1.0,
    /// Weight of the alpha term within the label loss.
    label_alpha: f64 = 0.1,
    /// Opacity error of an object rendered alone that causes no loss.
    alpha_slack: f64 = 0.5,
    /// Standard deviation of the SSIM window, px.
    ssim_sigma: f64 = 1.5,
    /// Radius of the SSIM window, px (window = 2 reach + 1).
    ssim_reach: usize = 5,
    /// Stabiliser of the SSIM luminance term.
    ssim_c1: f64 = wide(0.01 * 0.01),
    /// Stabiliser of the SSIM contrast term.
    ssim_c2: f64 = wide(0.03 * 0.03),
    /// Decay of Adam's first moment.
    // The shader compiler computes 1 - beta from the decimal numbers.
    adam_beta1: f64 = 0.9,
    /// Decay of Adam's second moment.
    adam_beta2: f64 = 0.999,
    /// Added to Adam's denominator.
    adam_eps: f64 = wide(1e-15),
    /// Quantisation steps of packed moments: per unit of m / sqrt(v),
    moment_ratio: f64 = 4096.0,
    /// per octave of sqrt(v),
    moment_log: f64 = 1024.0,
    /// and octaves of sqrt(v) below 1.
    moment_floor: f64 = 50.0,
    /// Mean 2-D gradient (NDC units) at which a Gaussian is cloned or split.
    densify_gradient: f64 = wide(2e-4),
    /// Largest scale that is cloned, in units of the scene extent; larger Gaussians are split.
    percent_dense: f64 = wide(0.01),
    /// Divisor of the scale: a split child has its parent's scale divided by this.
    split_shrink: f64 = wide(1.6),
    /// Box in which Gaussians grow; `None`: everywhere.
    grow_box: Option<Zone> = None,
    /// Splits go along the longest axis instead of to random places.
    splits_long: bool = false,
    /// Distance of the children of such a split from their parent, standard deviations.
    split_offset: f64 = 0.5,
    /// Factor of the longest axis in such a split.
    split_long: f64 = 0.5,
    /// Factor of the other axes.
    split_others: f64 = 0.85,
    /// Factor of the opacity.
    split_opacity: f64 = wide(0.6),
    /// View count that marks a Gaussian for removal.
    stat_near: f64 = 1e9,
    /// Largest standard deviation relative to the distance from a camera; larger Gaussians are marked.
    free_size: f64 = 0.5,
    /// Gaussians below this opacity are removed.
    prune_opacity: f64 = wide(0.005),
    /// Gaussians above this scale are removed, in units of the scene extent.
    prune_scale: f64 = wide(0.1),
    /// Large Gaussians are removed after this step.
    prune_scale_after: u32 = 3000,
    /// Weight of an opaque Gaussian in a draw.
    relocate_one: f64 = 255.0,
    /// Most copies of a Gaussian in a stack.
    relocate_most: u32 = 51,
    /// Steepness in opacity at which Gaussians stop moving at random.
    noise_steep: f64 = 100.0,
    /// Opacity at which Gaussians stop moving at random.
    noise_opacity: f64 = wide(0.005),
    /// Ceiling of an opacity reset.
    reset_opacity: f64 = wide(0.01),
    /// Minimum weight for a main Gaussian to take its pixel's label.
    lift_threshold: f64 = wide(0.6),
    /// The label of a pixel has the largest sum of weights; otherwise it is that of the main Gaussian.
    label_sums: bool = true,
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
