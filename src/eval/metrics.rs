//! Scores of one image against another. Colours are r, g, b in 0 to 1. Sums are in f64.

use crate::error::{Error, Result};
use crate::scene::{LabelMap, Photo};

/// Opacity above which an object rendered alone covers a pixel.
const COVERED_OPACITY_MIN: f32 = 0.5;
/// Channel value above which an object on black covers a pixel, by the paper's rule.
pub(crate) const PAPER_COVERED_VALUE_MIN: f32 = 0.01;

/// Returns the pixels that an object rendered alone covers.
pub(crate) fn covered(alpha: &[f32]) -> Vec<bool> {
    alpha.iter().map(|&alpha| alpha > COVERED_OPACITY_MIN).collect()
}

/// Returns the value of a photo's byte in 0 to 1, rounded to f32 as on the device, so that an exact render has no
/// error.
pub(crate) fn byte_value(byte: u8) -> f64 {
    f64::from(f32::from(byte) / 255.0)
}

/// Returns a rendered colour, clamped to 0 to 1.
pub(crate) fn clamped(colour: [f32; 3]) -> [f64; 3] {
    colour.map(|value| f64::from(value.clamp(0.0, 1.0)))
}

/// Returns the colour of a pixel of a photo.
pub(crate) fn colour_of([r, g, b, _]: [u8; 4]) -> [f64; 3] {
    [r, g, b].map(byte_value)
}

/// Returns the mean squared difference of two colours.
pub(crate) fn square(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|channel| (a[channel] - b[channel]).powi(2)).sum::<f64>() / 3.0
}

/// Returns the peak signal-to-noise ratio for a mean squared error, dB; infinite for equal images.
pub(crate) fn psnr_of(mean_squared_error: f64) -> f64 {
    -10.0 * mean_squared_error.log10()
}

/// Returns the PSNR of a render against a photo, dB. The render is clamped to 0..1, and the mean is over all channels
/// of the photo's valid pixels. NaN without valid pixels.
pub fn psnr(render: &[[f32; 3]], photo: &Photo) -> f64 {
    psnr_over(render, photo, |_| true).unwrap_or(f64::NAN)
}

/// Like [`psnr`] over the valid pixels that count; `None` without any.
pub(crate) fn psnr_over(render: &[[f32; 3]], photo: &Photo, counts: impl Fn(usize) -> bool) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_u64);
    for (index, (colour, &[r, g, b, valid])) in render.iter().zip(&photo.rgba).enumerate() {
        if valid == 0 || !counts(index) {
            continue;
        }
        for (&value, truth) in colour.iter().zip([r, g, b]) {
            let difference = f64::from(value.clamp(0.0, 1.0)) - byte_value(truth);
            sum += difference * difference;
        }
        count += 3;
    }
    (count > 0).then(|| psnr_of(sum / count as f64))
}

/// Pixel counts of the intersection and union of two masks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlap {
    /// Pixels in both masks.
    pub both: u64,
    /// Pixels in at least one mask.
    pub either: u64,
}

impl Overlap {
    /// Counts over pairs (predicted, ground truth).
    pub fn count(pairs: impl IntoIterator<Item = (bool, bool)>) -> Self {
        pairs.into_iter().fold(Self::default(), |sum, (a, b)| Self {
            both: sum.both + u64::from(a && b),
            either: sum.either + u64::from(a || b),
        })
    }

    /// Counts the pixels for which `counts` is true.
    pub(crate) fn over(found: &[bool], truth: &[bool], counts: impl Fn(usize) -> bool) -> Self {
        Self::count((0..truth.len()).filter(|&index| counts(index)).map(|index| (found[index], truth[index])))
    }

    /// Returns the intersection over union; `None` if both masks are empty.
    pub fn iou(&self) -> Option<f64> {
        (self.either > 0).then(|| self.both as f64 / self.either as f64)
    }
}

/// The scores of the paper for one object in one view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperScore {
    /// Intersection over union of "any channel above 0.01" and the mask; `None` if both are empty.
    pub iou: Option<f64>,
    /// PSNR against photo times mask over the whole frame, mean over the three channels, dB.
    pub psnr: f64,
}

/// Scores an object, rendered alone on black and not clamped, by the rule of the paper. `inside` is the object's mask.
pub fn paper_score(object: &[[f32; 3]], photo: &Photo, inside: &[bool]) -> PaperScore {
    let mut squares = [0.0; 3];
    for ((colour, truth), &inside) in object.iter().zip(&photo.rgba).zip(inside) {
        for channel in 0..3 {
            let truth = if inside { byte_value(truth[channel]) } else { 0.0 };
            squares[channel] += (f64::from(colour[channel]) - truth).powi(2);
        }
    }
    let pixels = object.len() as f64;
    let psnr = squares.iter().map(|sum| psnr_of(sum / pixels)).sum::<f64>() / 3.0;
    let covered = object.iter().map(|colour| colour.iter().any(|&value| value > PAPER_COVERED_VALUE_MIN));
    PaperScore { iou: Overlap::count(covered.zip(inside.iter().copied())).iou(), psnr }
}

/// Returns the mean IoU of a label map over the objects of a mask of the same size.
pub(crate) fn label_iou<T: Copy + Into<u32>>(found: &[T], truth: &LabelMap) -> Option<f64> {
    let pairs = |id: u16| found.iter().zip(&truth.ids).map(move |(&a, &b)| (a.into() == u32::from(id), b == id));
    mean(truth.objects().into_iter().filter_map(|id| Overlap::count(pairs(id)).iou()))
}

/// Returns the mean of the values; `None` without values.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.into_iter().fold((0.0, 0_u64), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}

/// Declares a struct of scores; `None` if there was nothing to compare.
macro_rules! scores {
    ($(#[$of:meta])* $name:ident { $($(#[$doc:meta])* $field:ident,)+ }) => {
        $(#[$of])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
        pub struct $name {
            $($(#[$doc])* pub $field: Option<f64>,)+
        }

        impl $name {
            /// Returns the mean of each score, ignoring missing values.
            pub fn mean<'a>(of: impl Iterator<Item = &'a Self> + Clone) -> Self {
                Self { $($field: $crate::eval::metrics::mean(of.clone().filter_map(|scores| scores.$field)),)+ }
            }

            /// Returns the scores with their names.
            pub fn named(&self) -> Vec<(&'static str, Option<f64>)> {
                vec![$((stringify!($field), self.$field),)+]
            }
        }
    };
}
pub(crate) use scores;

/// Compares the means of a model with the bounds of `--min-psnr` and `--min-iou`.
pub(crate) fn check_means(found: [Option<f64>; 2], bounds: [Option<f64>; 2]) -> Result<()> {
    for (((what, unit), found), least) in [("PSNR", " dB"), ("IoU", "")].into_iter().zip(found).zip(bounds) {
        let Some(least) = least else { continue };
        let Some(found) = found else {
            return Err(Error::Check(format!("there is no {what} to compare with {least}{unit}")));
        };
        // NaN fails too.
        if !(found >= least) {
            return Err(Error::Check(format!("mean {what} is {found:.4}{unit}, less than {least}{unit}")));
        }
    }
    Ok(())
}
