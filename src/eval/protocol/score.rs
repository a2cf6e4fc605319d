//! Scores of one object in one frame.

use crate::eval::boundary::boundary_iou;
use crate::eval::metrics::{Overlap, PAPER_COVERED_VALUE_MIN, covered, mean, paper_score, psnr, scores};
use crate::eval::ssim::ssim;
use crate::eval::ssim8::{ssim8, to_bytes};
use crate::render::Render;
use crate::scene::Photo;
use crate::scenes::truth::TruthMask;

/// A perceptual distance of two pictures with colours from 0 to 1.
pub trait Distance: std::fmt::Debug {
    /// Returns the distance; 0 for equal pictures.
    fn distance(&self, a: &[[f32; 3]], b: &[[f32; 3]], width: usize, height: usize) -> crate::Result<f64>;
}

scores! {
    /// Scores of an object, in one frame or on average; `None` if there was nothing to compare.
    PairScores {
        /// Intersection over union of opacity above 0.5 and the ground-truth mask.
        iou,
        /// Intersection over union of "any channel above 0.01" and the mask, the rule of the LabelGS paper.
        iou_colour,
        /// Intersection over union of the rims of opacity above 0.5 and of the mask.
        boundary_iou,
        /// Share of pixels at which opacity above 0.5 agrees with the mask.
        accuracy,
        /// PSNR of the object on black against photo times mask over the whole frame, dB.
        psnr,
        /// SSIM of the object on black against photo times mask.
        ssim,
        /// LPIPS of the object on black against photo times mask.
        lpips,
    }
}

impl PairScores {
    /// Returns the scores of a missing prediction: the worst of each; 1 for LPIPS.
    pub fn absent(with_lpips: bool) -> Self {
        let zero = Some(0.0);
        let lpips = with_lpips.then_some(1.0);
        Self { iou: zero, iou_colour: zero, boundary_iou: zero, accuracy: zero, psnr: zero, ssim: zero, lpips }
    }
}

/// Scores a picture against a mask and a photo of the same size. Invalid photo pixels do not count. `compat`
/// uses the PSNR and SSIM of the paper's scorer: every pixel, PSNR of the unclamped picture as the mean over channels,
/// SSIM of 8-bit pictures with a uniform window.
pub(crate) fn score(
    drawn: &Render,
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
    let covered = covered(&drawn.alpha);
    let coloured: Vec<bool> =
        drawn.rgb.iter().map(|colour| colour.iter().any(|&value| value > PAPER_COVERED_VALUE_MIN)).collect();
    let counts = |index: usize| compat || photo.rgba[index][3] > 0;
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
        iou: Overlap::over(&covered, &truth.inside, counts).iou(),
        iou_colour: Overlap::over(&coloured, &truth.inside, counts).iou(),
        boundary_iou: boundary_iou(&covered, &truth.inside, (width, height), counts),
        accuracy: mean((0..pixels).filter(|&index| counts(index)).map(agrees)),
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
