//! The constants of the reference and of a scene against those of the shaders.

use crate::reference::Rules;
use crate::reference::rules::GRADIENT_MAX;
use labelgs::scene::gaussians::ALPHA_MAX;
use labelgs::scene::harmonics::SH_C0;
use labelgs::shaders::constants as glsl;

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
        (r.moment_ratio, glsl::MOMENT_RATIO),
        (r.moment_log, glsl::MOMENT_LOG as f32),
        (r.moment_floor, glsl::MOMENT_FLOOR as f32),
        (f64::from(GRADIENT_MAX), glsl::GRADIENT_MAX),
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
