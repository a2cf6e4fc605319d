//! Sharpness of photos, and what is found of their brightness and white balance.

use super::{Fault, Finding, ViewReport};
use labelgs_files::resize::{bounded_size, shrink_photo};
use labelgs_scene::median::median;
use labelgs_scene::{Photo, Pixels, Result, View, parallel};

/// Longest side of the photos that are compared, px: noise of sensors is gone at this size.
const SIDE_MAX: u32 = 800;
/// Photos that a photo's sharpness is compared with, the nearest by place.
const PHOTOS_BESIDE: usize = 6;
/// Sharpness relative to theirs below which a photo is blurred.
const SHARPNESS_MIN: f64 = 0.4;
/// Brightness relative to the others, up or down, from which a photo's exposure differs.
const GAIN_MAX: f64 = 1.15;
/// Gain of a colour channel over that of another from which a photo's white balance differs.
const TINT_MAX: f64 = 1.15;

pub(super) fn grey([r, g, b, _]: [u8; 4]) -> f64 {
    (0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b)) / 255.0
}

/// Mean square of the Laplacian over that of the brightness: fine detail at any exposure.
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

/// Returns the sharpness of each photo relative to the photos beside it.
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
        // The square root: half is half the contrast of fine detail.
        (usual > 0.0).then_some((details[index]? / usual).sqrt())
    };
    Ok(views.iter().enumerate().map(relative).collect())
}

/// Finds blurred photos, and photos with another exposure or white balance.
pub(super) fn findings(views: &[ViewReport]) -> Vec<Finding> {
    let mut found = Vec::new();
    for view in views {
        if let Some(sharpness) = view.sharpness.filter(|&sharpness| sharpness < SHARPNESS_MIN) {
            let text = format!("has {:.0} % of the fine detail of the photos beside it", 100.0 * sharpness);
            found.push(Finding::new(Fault::Blur, Some(&view.name), text));
        }
        if let Some(gain) = view.gain.filter(|&gain| !(1.0 / GAIN_MAX..=GAIN_MAX).contains(&gain)) {
            let text = format!("is {gain:.2} times as bright as the mean photo, by the points that photos share");
            found.push(Finding::new(Fault::Exposure, Some(&view.name), text));
        }
        if let Some([red, green, blue]) = view.channel_gains
            && red.max(green).max(blue) > TINT_MAX * red.min(green).min(blue)
        {
            let text =
                format!("has {red:.2}, {green:.2} and {blue:.2} times the red, green and blue of the mean photo");
            found.push(Finding::new(Fault::WhiteBalance, Some(&view.name), text));
        }
    }
    found
}
