//! Converts values in images to bytes and colours.

/// Converts a value from 0 to 1 to a byte.
pub fn to_byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Colours of error maps, from no error to large errors: five stops of the colour map inferno.
pub const HEAT_COLOURS: [[u8; 3]; 5] = [[0, 0, 4], [87, 16, 110], [188, 55, 84], [249, 142, 9], [252, 255, 164]];
/// Mean absolute difference of the channels, 0 to 1, at the last colour of [`HEAT_COLOURS`].
pub const HEAT_MAX: f32 = 0.25;

/// Returns the colour of a share from 0 to 1 on a scale, interpolated between its stops.
pub fn colour_on_scale(scale: &[[u8; 3]], share: f32) -> [u8; 3] {
    let last = scale.len().saturating_sub(1);
    let at = share.clamp(0.0, 1.0) * last as f32;
    let low = (at as usize).min(last.saturating_sub(1));
    let (Some(a), Some(b)) = (scale.get(low), scale.get(last.min(low + 1))) else { return [0; 3] };
    let part = at - low as f32;
    [0, 1, 2].map(|c| (f32::from(a[c]) * (1.0 - part) + f32::from(b[c]) * part).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::{HEAT_COLOURS, colour_on_scale};

    #[test]
    fn a_scale_passes_through_its_colours() {
        for (index, colour) in HEAT_COLOURS.into_iter().enumerate() {
            assert_eq!(colour_on_scale(&HEAT_COLOURS, index as f32 / 4.0), colour);
        }
        assert_eq!(colour_on_scale(&HEAT_COLOURS, -1.0), HEAT_COLOURS[0]);
        assert_eq!(colour_on_scale(&HEAT_COLOURS, 9.0), HEAT_COLOURS[4]);
        assert_eq!(colour_on_scale(&[[0; 3], [10, 20, 30]], 0.5), [5, 10, 15]);
        assert_eq!((colour_on_scale(&[], 0.5), colour_on_scale(&[[7; 3]], 0.5)), ([0; 3], [7; 3]));
    }
}
