//! The operations of VGG16: convolution and pooling.

use rayon::prelude::*;

/// An image with many channels, one row-major plane after another.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    /// Number of channels.
    pub channels: usize,
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// Values, `[channels, height, width]`.
    pub values: Vec<f32>,
}

/// A convolution layer with a 3 x 3 window.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Weights, `[outputs, inputs, 3, 3]`.
    pub weight: Vec<f32>,
    /// Biases, `[outputs]`.
    pub bias: Vec<f32>,
}

/// Applies convolution (zero padding), bias and ReLU. One thread sums each output channel in a fixed order.
pub fn convolve(input: &Planes, layer: &Layer) -> Planes {
    let (width, height, area) = (input.width, input.height, input.width * input.height);
    let channel = |(output, plane): (usize, &mut [f32])| {
        plane.fill(layer.bias[output]);
        for (from, source) in input.values.chunks_exact(area).enumerate() {
            let start = (output * input.channels + from) * 9;
            let weight = &layer.weight[start..start + 9];
            for (y, row) in plane.chunks_exact_mut(width).enumerate() {
                for dy in 0..3 {
                    let Some(above) = (y + dy).checked_sub(1).filter(|&at| at < height) else { continue };
                    add_row(row, &source[above * width..(above + 1) * width], &weight[3 * dy..3 * dy + 3]);
                }
            }
        }
        plane.iter_mut().for_each(|value| *value = value.max(0.0));
    };
    let mut values = vec![0.0; layer.bias.len() * area];
    values.par_chunks_mut(area).enumerate().for_each(channel);
    Planes { channels: layer.bias.len(), width, height, values }
}

/// Adds a source row convolved with three weights.
fn add_row(row: &mut [f32], source: &[f32], weight: &[f32]) {
    let last = row.len() - 1;
    for (sum, three) in row[1..].iter_mut().zip(source.windows(3)) {
        *sum += weight[0] * three[0] + weight[1] * three[1] + weight[2] * three[2];
    }
    row[0] += weight[1] * source[0];
    if last > 0 {
        row[0] += weight[2] * source[1];
        row[last] += weight[0] * source[last - 1] + weight[1] * source[last];
    }
}

/// Max-pools 2 x 2 pixels; an odd last row or column is dropped.
pub fn halve(input: &Planes) -> Planes {
    let (width, height, area) = (input.width / 2, input.height / 2, input.width * input.height);
    let one = |channel: usize, x: usize, y: usize| {
        let at = |dx: usize, dy: usize| input.values[channel * area + (2 * y + dy) * input.width + 2 * x + dx];
        at(0, 0).max(at(1, 0)).max(at(0, 1)).max(at(1, 1))
    };
    let rows = (0..input.channels).flat_map(|channel| (0..height).map(move |y| (channel, y)));
    let values = rows.flat_map(|(channel, y)| (0..width).map(move |x| one(channel, x, y))).collect();
    Planes { channels: input.channels, width, height, values }
}
