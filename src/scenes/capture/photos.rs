//! Measures the sharpness of photos, and finds problems of sharpness, brightness and white balance.

use super::{CaptureProblem, Finding, ViewReport};
use labelgs_files::resize::{bounded_size, shrink_photo};
use labelgs_scene::median::median;
use labelgs_scene::{Photo, Pixels, Result, View, parallel};

/// Longest side of the compared photos, px: sensor noise vanishes at this size.
const SIDE_MAX: u32 = 800;
/// Number of nearest photos, by position, with which a photo's sharpness is compared.
const PHOTOS_BESIDE: usize = 6;
/// A photo is blurred if its sharpness relative to the others is below this value.
const SHARPNESS_MIN: f64 = 0.4;
/// A photo's exposure differs if its brightness relative to the others exceeds this factor, up or down.
const GAIN_MAX: f64 = 1.15;
/// A photo's white balance differs if the gains of two channels differ by more than this factor.
const TINT_MAX: f64 = 1.15;

pub(super) fn grey([r, g, b, _]: [u8; 4]) -> f64 {
    (0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b)) / 255.0
}

/// Returns the mean squared Laplacian divided by the mean squared brightness: fine detail at any exposure.
fn detail(photo: &Photo) -> f64 {
    let (width, height) = bounded_size((photo.width, photo.height), Some(SIDE_MAX));
    let small = shrink_photo(photo, width, height);
    let (width, height) = (width as usize, height as usize);
    let at = |x: usize, y: usize| grey(small.rgba[y * width + x]);
    let (mut sum, mut light, mut count) = (0.0, 0.0, 0.0);
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let around = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1);
            sum += (around - 4.0 * at(x, y)).powi(2);
            light += at(x, y).powi(2);
            count += 1.0;
        }
    }
    if count > 0.0 && light > 0.0 { sum / light } else { f64::NAN }
}

/// Returns the sharpness of each photo relative to its neighbours.
pub(super) fn sharpness(views: &[&View]) -> Result<Vec<Option<f64>>> {
    let of_view = |view: &View| {
        let photo = view.photo.as_ref().map(Pixels::get).transpose()?;
        Ok(photo.map(|photo| detail(&photo)).filter(|value| value.is_finite()))
    };
    let details: Vec<Option<f64>> =
        parallel::map_views("measuring the sharpness of photos", views, of_view).into_iter().collect::<Result<_>>()?;
    let relative = |(index, view): (usize, &&View)| {
        let mut near: Vec<(f64, f64)> = views
            .iter()
            .zip(&details)
            .enumerate()
            .filter(|(other, _)| *other != index)
            .filter_map(|(_, (other, detail))| Some((other.camera.centre().distance(view.camera.centre()), (*detail)?)))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let usual = median(near.iter().take(PHOTOS_BESIDE).map(|&(_, detail)| detail))?;
        // The square root makes half the contrast of fine detail a sharpness of one half.
        (usual > 0.0).then_some((details[index]? / usual).sqrt())
    };
    Ok(views.iter().enumerate().map(relative).collect())
}

/// Finds blurred photos, and photos with a different exposure or white balance.
pub(super) fn findings(views: &[ViewReport]) -> Vec<Finding> {
    let mut found = Vec::new();
    for view in views {
        if let Some(sharpness) = view.sharpness.filter(|&sharpness| sharpness < SHARPNESS_MIN) {
            let text = format!("has {:.0} % of the fine detail of its neighbours", 100.0 * sharpness);
            found.push(Finding::new(CaptureProblem::Blur, Some(&view.name), text));
        }
        if let Some(gain) = view.gain.filter(|&gain| !(1.0 / GAIN_MAX..=GAIN_MAX).contains(&gain)) {
            let text = format!("is {gain:.2} times as bright as the mean photo, judged by shared points");
            found.push(Finding::new(CaptureProblem::Exposure, Some(&view.name), text));
        }
        if let Some([red, green, blue]) = view.channel_gains
            && red.max(green).max(blue) > TINT_MAX * red.min(green).min(blue)
        {
            let text =
                format!("has {red:.2}, {green:.2} and {blue:.2} times the red, green and blue of the mean photo");
            found.push(Finding::new(CaptureProblem::WhiteBalance, Some(&view.name), text));
        }
    }
    found
}
