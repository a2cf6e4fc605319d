//! Scores of one object in one frame.

use crate::eval::boundary::boundary_iou;
use crate::eval::metrics::{COVERED, Overlap, PAPER_COVERED, mean, paper_score, psnr};
use crate::eval::ssim::ssim;
use crate::eval::ssim8::{ssim8, to_bytes};
use crate::scene::Photo;
use crate::scenes::truth::TruthMask;
use serde::Serialize;

/// A perceptual distance of two pictures with colours from 0 to 1.
pub trait Distance: std::fmt::Debug {
    /// Returns the distance; 0 for equal pictures.
    fn distance(&self, a: &[[f32; 3]], b: &[[f32; 3]], width: usize, height: usize) -> crate::Result<f64>;
}

/// Scores of an object, in one frame or on average; `None` if there was nothing to compare.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PairScores {
    /// Intersection over union of opacity above 0.5 and the ground-truth mask.
    pub iou: Option<f64>,
    /// Intersection over union of "any channel above 0.01" and the mask, the rule of the LabelGS paper.
    pub iou_colour: Option<f64>,
    /// Intersection over union of the rims of opacity above 0.5 and of the mask.
    pub boundary_iou: Option<f64>,
    /// Share of pixels at which opacity above 0.5 agrees with the mask.
    pub accuracy: Option<f64>,
    /// PSNR of the object on black against photo times mask over the whole frame, dB.
    pub psnr: Option<f64>,
    /// SSIM of the object on black against photo times mask.
    pub ssim: Option<f64>,
    /// LPIPS of the object on black against photo times mask.
    pub lpips: Option<f64>,
}

impl PairScores {
    /// Returns the scores of a missing prediction: the worst of each; 1 for LPIPS.
    pub fn absent(with_lpips: bool) -> Self {
        let zero = Some(0.0);
        let lpips = with_lpips.then_some(1.0);
        Self { iou: zero, iou_colour: zero, boundary_iou: zero, accuracy: zero, psnr: zero, ssim: zero, lpips }
    }

    /// Returns the mean of each score over its values.
    pub fn average<'a>(scores: impl Iterator<Item = &'a Self> + Clone) -> Self {
        let over = |field: fn(&Self) -> Option<f64>| mean(scores.clone().filter_map(field));
        Self {
            iou: over(|scores| scores.iou),
            iou_colour: over(|scores| scores.iou_colour),
            boundary_iou: over(|scores| scores.boundary_iou),
            accuracy: over(|scores| scores.accuracy),
            psnr: over(|scores| scores.psnr),
            ssim: over(|scores| scores.ssim),
            lpips: over(|scores| scores.lpips),
        }
    }

    /// Returns the scores with their names.
    pub fn named(&self) -> [(&'static str, Option<f64>); 7] {
        [
            ("iou", self.iou),
            ("iou_colour", self.iou_colour),
            ("boundary_iou", self.boundary_iou),
            ("accuracy", self.accuracy),
            ("psnr", self.psnr),
            ("ssim", self.ssim),
            ("lpips", self.lpips),
        ]
    }
}

/// An object rendered alone on black.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// r, g, b, not clamped, row-major.
    pub rgb: Vec<[f32; 3]>,
    /// Opacity, row-major, 0 to 1.
    pub alpha: Vec<f32>,
}

/// Scores a picture against a mask and a photo of the same size. Invalid pixels of the photo do not count. `compat`
/// uses the PSNR and SSIM of the paper's scorer: every pixel, PSNR of the unclamped picture as the mean over channels,
/// SSIM of 8-bit pictures with a uniform window.
pub(crate) fn score(
    drawn: &Drawn,
    truth: &TruthMask,
    photo: &Photo,
    compat: bool,
    lpips: Option<&dyn Distance>,
) -> crate::Result<PairScores> {
    let pixels = truth.inside.len();
    if [drawn.rgb.len(), drawn.alpha.len(), photo.rgba.len()].iter().any(|&length| length != pixels) {
        return Err(crate::Error::Bug("picture, mask and photo differ in size".into()));
    }
    let (width, height) = (truth.width as usize, truth.height as usize);
    let covered: Vec<bool> = drawn.alpha.iter().map(|&alpha| alpha > COVERED).collect();
    let coloured = |index: usize| drawn.rgb[index].iter().any(|&value| value > PAPER_COVERED);
    let counts = |index: usize| compat || photo.rgba[index][3] > 0;
    let counted = || (0..pixels).filter(|&index| counts(index));
    let agrees = |index: usize| if covered[index] == truth.inside[index] { 1.0 } else { 0.0 };
    let target = times_mask(photo, &truth.inside);
    let (psnr, ssim) = if compat {
        let bytes: Vec<[u8; 3]> = drawn.rgb.iter().map(|&colour| to_bytes(colour)).collect();
        let psnr = paper_score(&drawn.rgb, photo, &truth.inside).psnr;
        (psnr, ssim8(&bytes, &target.rgb(), width, height))
    } else {
        (psnr(&drawn.rgb, &target), Some(ssim(&drawn.rgb, &target)))
    };
    let there = |value: &f64| !value.is_nan();
    let lpips = lpips.map(|lpips| {
        let truth: Vec<[f32; 3]> =
            target.rgba.iter().map(|&[r, g, b, _]| [r, g, b].map(|byte| f32::from(byte) / 255.0)).collect();
        let found: Vec<[f32; 3]> = drawn.rgb.iter().map(|colour| colour.map(|value| value.clamp(0.0, 1.0))).collect();
        lpips.distance(&found, &truth, width, height)
    });
    Ok(PairScores {
        iou: Overlap::count(counted().map(|index| (covered[index], truth.inside[index]))).iou(),
        iou_colour: Overlap::count(counted().map(|index| (coloured(index), truth.inside[index]))).iou(),
        boundary_iou: boundary_iou(&covered, &truth.inside, (width, height), counts),
        accuracy: mean(counted().map(agrees)),
        psnr: Some(psnr).filter(there),
        ssim: ssim.filter(there),
        lpips: lpips.transpose()?,
    })
}

/// Returns the photo with black outside of the mask.
fn times_mask(photo: &Photo, inside: &[bool]) -> Photo {
    let texel = |(&[r, g, b, valid], &inside): (&[u8; 4], &bool)| {
        if inside { [r, g, b, valid] } else { [0, 0, 0, valid] }
    };
    Photo { width: photo.width, height: photo.height, rgba: photo.rgba.iter().zip(inside).map(texel).collect() }
}
