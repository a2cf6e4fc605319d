//! Converts activated values, as other formats store them, to values before activation.

use super::format::Export;

/// Opacities whose logit is still finite in 32 bits.
const OPACITY_MIN: f32 = 1e-7;
const OPACITY_MAX: f32 = 1.0 - 1e-7;
/// Replaces a size of 0, which some formats allow but which has no logarithm.
const SCALE_MIN: f32 = 1e-12;

/// Returns the opacity of a logit.
pub(super) fn sigmoid(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit).exp())
}

/// Returns the logit of an opacity, clamped to where it is finite in 32 bits.
pub(super) fn logit(opacity: f32) -> f32 {
    let inside = opacity.clamp(OPACITY_MIN, OPACITY_MAX);
    (inside / (1.0 - inside)).ln()
}

/// Lists what is lost in a format with float opacities and without a mark for antialiased models, one note per line.
pub(super) fn losses(export: &Export) -> Vec<String> {
    let saturated = export.rows.iter().filter(|&&row| !(sigmoid(export.model.opacities[row]) < 1.0)).count();
    let saturated =
        (saturated > 0).then(|| format!("{saturated} opacities are 1 in 32 bits and will be read as 0.9999999"));
    let bold = export.model.antialiased.then(|| {
        "the format cannot mark antialiased models; other programs will draw its fine parts too bold".to_owned()
    });
    saturated.into_iter().chain(bold).collect()
}

/// Returns the logit of an opacity in steps of 1/255. 0 and 255, which have no logit, are moved by a quarter of a step.
pub(super) fn logit_of_byte(byte: u8) -> f32 {
    let share = f32::from(byte).clamp(0.25, 254.75) / 255.0;
    (share / (1.0 - share)).ln()
}

/// Returns the logarithm of a size; NaN if the size is negative.
pub(super) fn log_scale(scale: f32) -> f32 {
    if (0.0..SCALE_MIN).contains(&scale) { SCALE_MIN.ln() } else { scale.ln() }
}

/// Returns the unit quaternion.
pub(super) fn unit(quat: [f32; 4]) -> [f32; 4] {
    let length = quat.iter().map(|&value| f64::from(value).powi(2)).sum::<f64>().sqrt();
    quat.map(|value| (f64::from(value) / length) as f32)
}

/// Returns the index of the component with the largest absolute value; of equal ones, the first.
pub(super) fn index_of_largest(quat: [f32; 4]) -> usize {
    (0..4).fold(0, |best, at| if quat[at].abs() > quat[best].abs() { at } else { best })
}

/// Assembles a quaternion from its largest component, the index of that component, and the others in order.
pub(super) fn with_largest(largest: f64, place: u32, [a, b, c]: [f64; 3]) -> [f64; 4] {
    match place {
        0 => [largest, a, b, c],
        1 => [a, largest, b, c],
        2 => [a, b, largest, c],
        _ => [a, b, c, largest],
    }
}

/// Rounds to the nearest value from 0 to 255.
pub(super) fn byte(value: f32) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

/// Returns an opacity in steps of 1/255, except 0 and 255, which other readers turn into infinite logits.
pub(super) fn opacity_byte(logit: f32) -> u8 {
    byte(255.0 * sigmoid(logit)).clamp(1, 254)
}
