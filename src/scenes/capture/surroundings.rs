//! Detects surroundings that do not follow the poses: an object turned in front of a fixed camera.
//!
//! The poses are relative to the object. In a normal scene, the borders of photos from different directions show
//! different things; on a turntable they show the same wall. No scene explains both, so training puts floaters in front
//! of the object.

use super::{CaptureProblem, Finding};
use labelgs_files::resize::{bounded_size, shrink_photo};
use labelgs_scene::{Camera, Dataset, LabelMap, Photo, Pixels, Result, View, parallel};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// Most photos compared, evenly chosen, and fewest.
const PHOTOS_MAX: usize = 48;
const PHOTOS_MIN: usize = 6;
/// Longest side of the compared photos, px.
const SIDE_MAX: u32 = 48;
/// Width of the border, as a share of the longest side.
const BORDER_SHARE: f64 = 0.08;
/// Two pixels differ if a channel differs by at least this value.
const DIFFERENCE_MIN: u8 = 12;
/// Cameras turned by at least this angle against each other show different surroundings, degrees.
const TURN_MIN: f64 = 25.0;
/// Share of a photo's pairs that decide how much of its border stays the same. An object may have been turned over
/// between series, in front of another part of the wall.
const PAIR_SHARE: f64 = 0.2;
/// The surroundings do not follow the poses if at least this share of the border stays the same. Turned objects have
/// 0.48 and more; scenes have up to 0.23, where the sky is the same all around.
const STILL_SHARE_MIN: f64 = 0.35;
/// Fewest pixels of a side that both photos must show.
const PIXELS_MIN: usize = 12;

/// The pixels of a side of a photo in a fixed order; `None` for those that do not count.
type BorderSide = Vec<Option<[u8; 3]>>;

/// The border of a photo.
struct Border {
    camera: Camera,
    sides: [BorderSide; 4],
}

impl Border {
    fn read(view: &View) -> Result<Option<Self>> {
        let Some(photo) = view.photo.as_ref().map(Pixels::get).transpose()? else { return Ok(None) };
        let (width, height) = bounded_size((photo.width, photo.height), Some(SIDE_MAX));
        let small = shrink_photo(&photo, width, height);
        let mask = view.mask()?.map(|mask| mask.resized(width, height));
        Ok(Some(Self { camera: view.camera.clone(), sides: sides(&small, mask.as_ref()) }))
    }

    /// Returns the share of the border that looks the same in both photos: the mean of the two most different sides,
    /// because the sky is the same above most cameras. `None` if too little can be compared.
    fn alike(&self, other: &Self) -> Option<f64> {
        let turn = self.camera.rotation * other.camera.rotation.transpose();
        let cosine = (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0) / 2.0;
        if cosine > TURN_MIN.to_radians().cos() {
            return None;
        }
        let mut shares: Vec<f64> = self.sides.iter().zip(&other.sides).filter_map(|(a, b)| same_share(a, b)).collect();
        shares.sort_by(f64::total_cmp);
        (shares.len() >= 2).then(|| (shares[0] + shares[1]) / 2.0)
    }

    /// Returns the shape of the border: only borders of the same shape are comparable.
    fn shape(&self) -> [usize; 2] {
        [self.sides[0].len(), self.sides[2].len()]
    }
}

/// Returns the share of a side that looks the same in two photos; `None` with too few pixels.
fn same_share(a: &BorderSide, b: &BorderSide) -> Option<f64> {
    let (mut same_share, mut count) = (0, 0);
    for (a, b) in a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?))) {
        count += 1;
        same_share += usize::from((0..3).all(|channel| a[channel].abs_diff(b[channel]) < DIFFERENCE_MIN));
    }
    (count >= PIXELS_MIN).then(|| same_share as f64 / count as f64)
}

/// Returns the opaque, unmasked pixels near the top, bottom, left and right border.
fn sides(photo: &Photo, mask: Option<&LabelMap>) -> [BorderSide; 4] {
    let (width, height) = (photo.width, photo.height);
    let reach = ((BORDER_SHARE * f64::from(width.max(height))).round() as u32).max(1).min(width).min(height);
    let pixel = |x: u32, y: u32| {
        let [r, g, b, alpha] = photo.rgba[(y * width + x) as usize];
        let is_free = mask.is_none_or(|mask| mask.at(x, y) == 0);
        (alpha == u8::MAX && is_free).then_some([r, g, b])
    };
    let part = |columns: Range<u32>, rows: Range<u32>| -> BorderSide {
        rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
    };
    [
        part(0..width, 0..reach),
        part(0..width, height - reach..height),
        part(0..reach, 0..height),
        part(width - reach..width, 0..height),
    ]
}

/// Returns the share of the median photo's border that stays the same when the camera turns, if that is too much for
/// the surroundings to follow the poses.
pub fn still_share(dataset: &Dataset) -> Result<Option<f64>> {
    let share = measure_still_share(&dataset.all())?;
    Ok(share.filter(|&share| share >= STILL_SHARE_MIN))
}

/// Returns the share of the median photo's border that stays the same when the camera turns; `None` with too few photos
/// from other directions.
fn measure_still_share(views: &[&View]) -> Result<Option<f64>> {
    let chosen: Vec<&View> = views.iter().copied().step_by(views.len().div_ceil(PHOTOS_MAX).max(1)).collect();
    let found = parallel::map_views("comparing the borders of photos", &chosen, Border::read);
    let found: Vec<Border> = found.into_iter().collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
    let mut shapes: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    found.iter().for_each(|border| *shapes.entry(border.shape()).or_default() += 1);
    let usual = shapes.into_iter().max_by_key(|&(_, count)| count).map(|(shape, _)| shape);
    let borders: Vec<&Border> = found.iter().filter(|border| Some(border.shape()) == usual).collect();
    let of_photo = |border: &&Border| {
        let mut shares: Vec<f64> = borders.iter().filter_map(|other| border.alike(other)).collect();
        shares.sort_by(|a, b| b.total_cmp(a));
        shares.get((PAIR_SHARE * shares.len() as f64) as usize).copied()
    };
    let mut shares: Vec<f64> = borders.par_iter().filter_map(of_photo).collect();
    shares.sort_by(f64::total_cmp);
    Ok((shares.len() >= PHOTOS_MIN).then(|| shares[shares.len() / 2]))
}

/// Finds surroundings that do not follow the poses.
pub(super) fn findings(dataset: &Dataset) -> Result<Vec<Finding>> {
    let share = still_share(dataset)?;
    Ok(share.map(|share| Finding::new(CaptureProblem::Surroundings, None, text(share))).into_iter().collect())
}

/// Describes the problem.
pub fn text(share: f64) -> String {
    format!(
        "the surroundings do not follow the poses: {:.0} % of the border looks the same from cameras turned by more \
         than {TURN_MIN:.0} degrees against each other, as if an object was turned in front of a fixed camera. A \
         training makes fog of them before the object",
        100.0 * share
    )
}
