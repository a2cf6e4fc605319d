//! Values of pictures as bytes.

/// Returns the byte of a value from 0 to 1 in a picture.
pub fn to_byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}
