//! Values after activation, as other formats store them, before activation.

use super::format::Export;

/// Opacities at which the logit is still finite in 32 bits.
const OPACITY_MIN: f32 = 1e-7;
const OPACITY_MAX: f32 = 1.0 - 1e-7;
/// A size of 0, which some formats allow, as one that has a logarithm.
const SCALE_MIN: f32 = 1e-12;

/// The opacity of a logit.
pub(super) fn sigmoid(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit).exp())
}

/// The logit of an opacity, kept from 0 and 1, where it is not finite in 32 bits.
pub(super) fn logit(opacity: f32) -> f32 {
    let inside = opacity.clamp(OPACITY_MIN, OPACITY_MAX);
    (inside / (1.0 - inside)).ln()
}

/// What a format loses that holds opacities as floats and has no mark for antialiased models, a line each.
pub(super) fn losses(export: &Export) -> Vec<String> {
    let saturated = export.rows.iter().filter(|&&row| !(sigmoid(export.model.opacities[row]) < 1.0)).count();
    let saturated =
        (saturated > 0).then(|| format!("{saturated} opacities are 1 in 32 bits and come back as 0.9999999"));
    let bold = export.model.antialiased.then(|| {
        "the format has no mark for antialiased models; only labelgs draws its fine parts right, others too bold"
            .to_owned()
    });
    saturated.into_iter().chain(bold).collect()
}

/// The logit of an opacity in steps of 1/255; 0 and 255, which have none, count as a quarter of a step from the end.
pub(super) fn logit_of_byte(byte: u8) -> f32 {
    let share = f32::from(byte).clamp(0.25, 254.75) / 255.0;
    (share / (1.0 - share)).ln()
}

/// The logarithm of a size; that of a negative size is NaN.
pub(super) fn log_scale(scale: f32) -> f32 {
    if (0.0..SCALE_MIN).contains(&scale) { SCALE_MIN.ln() } else { scale.ln() }
}

/// The quaternion of unit length.
pub(super) fn unit(quat: [f32; 4]) -> [f32; 4] {
    let length = quat.iter().map(|&value| f64::from(value).powi(2)).sum::<f64>().sqrt();
    quat.map(|value| (f64::from(value) / length) as f32)
}

/// The place of the component that is farthest from 0, the first of equal ones.
pub(super) fn place_of_largest(quat: [f32; 4]) -> usize {
    (0..4).fold(0, |best, at| if quat[at].abs() > quat[best].abs() { at } else { best })
}

/// The quaternion of its largest component, the place of that, and the others in order.
pub(super) fn with_largest(largest: f64, place: u32, [a, b, c]: [f64; 3]) -> [f64; 4] {
    match place {
        0 => [largest, a, b, c],
        1 => [a, largest, b, c],
        2 => [a, b, largest, c],
        _ => [a, b, c, largest],
    }
}

/// The value from 0 to 255 that is nearest.
pub(super) fn byte(value: f32) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

/// The byte of an opacity in steps of 1/255, without 0 and 255, of which other readers make infinite logits.
pub(super) fn opacity_byte(logit: f32) -> u8 {
    byte(255.0 * sigmoid(logit)).clamp(1, 254)
}
