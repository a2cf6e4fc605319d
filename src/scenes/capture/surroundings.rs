//! Surroundings that do not follow the poses: an object turned before a camera that stands still.
//!
//! The poses are those of the object. In a scene, the borders of photos from different directions show different things; on
//! a turntable they show the same wall. No scene explains both, and a training makes fog of it before the object.

use super::{Fault, Finding};
use labelgs_files::resize::{bounded_size, shrink_photo};
use labelgs_scene::{Camera, Dataset, LabelMap, Photo, Pixels, Result, View, parallel};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// Most photos that are compared, evenly chosen, and fewest.
const PHOTOS_MAX: usize = 48;
const PHOTOS_MIN: usize = 6;
/// Longest side of the photos that are compared, px.
const SIDE: u32 = 48;
/// Width of the border, as a share of that side.
const BORDER: f64 = 0.08;
/// Difference of a channel from which two pixels differ.
const DIFFERENCE: u8 = 12;
/// Angle between two cameras from which they show different surroundings, degrees.
const TURN_MIN: f64 = 25.0;
/// Share of a photo's pairs that say how much of its border stays: an object may have been turned over between series,
/// before another part of the wall.
const PAIRS: f64 = 0.2;
/// Share of the border that stays from which the surroundings do not follow the poses. Turned objects have 0.48 and more,
/// scenes up to 0.23, where the sky is the same all around.
const STILL_SHARE: f64 = 0.35;
/// Fewest pixels of a side that two photos have to show both.
const PIXELS_MIN: usize = 12;

/// The pixels of a side of a photo in a fixed order, those that count.
type Side = Vec<Option<[u8; 3]>>;

/// The border of a photo.
struct Border {
    camera: Camera,
    sides: [Side; 4],
}

impl Border {
    fn of(view: &View) -> Result<Option<Self>> {
        let Some(photo) = view.photo.as_ref().map(Pixels::get).transpose()? else { return Ok(None) };
        let (width, height) = bounded_size((photo.width, photo.height), Some(SIDE));
        let small = shrink_photo(&photo, width, height);
        let mask = view.mask()?.map(|mask| mask.resized(width, height));
        Ok(Some(Self { camera: view.camera.clone(), sides: sides(&small, mask.as_ref()) }))
    }

    /// Returns the share of the border that looks the same in both photos: the mean of the two sides with the least, since a
    /// sky is the same above most cameras. `None` if nothing can be said.
    fn alike(&self, other: &Self) -> Option<f64> {
        let turn = self.camera.rotation * other.camera.rotation.transpose();
        let cosine = (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0) / 2.0;
        if cosine > TURN_MIN.to_radians().cos() {
            return None;
        }
        let mut shares: Vec<f64> = self.sides.iter().zip(&other.sides).filter_map(|(a, b)| same(a, b)).collect();
        shares.sort_by(f64::total_cmp);
        (shares.len() >= 2).then(|| (shares[0] + shares[1]) / 2.0)
    }

    /// Returns the shape of the border: only borders of one shape can be compared.
    fn shape(&self) -> [usize; 2] {
        [self.sides[0].len(), self.sides[2].len()]
    }
}

/// Returns the share of a side that looks the same in two photos; `None` with too few pixels.
fn same(a: &Side, b: &Side) -> Option<f64> {
    let (mut same, mut count) = (0, 0);
    for (a, b) in a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?))) {
        count += 1;
        same += usize::from((0..3).all(|channel| a[channel].abs_diff(b[channel]) < DIFFERENCE));
    }
    (count >= PIXELS_MIN).then(|| same as f64 / count as f64)
}

/// Returns the opaque pixels near the top, the bottom, the left and the right border that no mask marks.
fn sides(photo: &Photo, mask: Option<&LabelMap>) -> [Side; 4] {
    let (width, height) = (photo.width, photo.height);
    let reach = ((BORDER * f64::from(width.max(height))).round() as u32).max(1).min(width).min(height);
    let pixel = |x: u32, y: u32| {
        let [r, g, b, alpha] = photo.rgba[(y * width + x) as usize];
        let is_free = mask.is_none_or(|mask| mask.at(x, y) == 0);
        (alpha == u8::MAX && is_free).then_some([r, g, b])
    };
    let part = |columns: Range<u32>, rows: Range<u32>| -> Side {
        rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
    };
    [
        part(0..width, 0..reach),
        part(0..width, height - reach..height),
        part(0..reach, 0..height),
        part(width - reach..width, 0..height),
    ]
}

/// Returns the share of the border of the usual photo that stays when the camera turns, if it is so much that the
/// surroundings cannot follow the poses.
pub fn still_share(dataset: &Dataset) -> Result<Option<f64>> {
    let share = measured(&dataset.all())?;
    Ok(share.filter(|&share| share >= STILL_SHARE))
}

/// Returns the share of the border of the usual photo that stays when the camera turns; `None` with too few photos from other
/// directions.
fn measured(views: &[&View]) -> Result<Option<f64>> {
    let chosen: Vec<&View> = views.iter().copied().step_by(views.len().div_ceil(PHOTOS_MAX).max(1)).collect();
    let found = parallel::map_views("comparing the borders of photos", &chosen, Border::of);
    let found: Vec<Border> = found.into_iter().collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
    let mut shapes: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    found.iter().for_each(|border| *shapes.entry(border.shape()).or_default() += 1);
    let usual = shapes.into_iter().max_by_key(|&(_, count)| count).map(|(shape, _)| shape);
    let borders: Vec<&Border> = found.iter().filter(|border| Some(border.shape()) == usual).collect();
    let of_photo = |border: &&Border| {
        let mut shares: Vec<f64> = borders.iter().filter_map(|other| border.alike(other)).collect();
        shares.sort_by(|a, b| b.total_cmp(a));
        shares.get((PAIRS * shares.len() as f64) as usize).copied()
    };
    let mut shares: Vec<f64> = borders.par_iter().filter_map(of_photo).collect();
    shares.sort_by(f64::total_cmp);
    Ok((shares.len() >= PHOTOS_MIN).then(|| shares[shares.len() / 2]))
}

/// Finds surroundings that do not follow the poses.
pub(super) fn findings(dataset: &Dataset) -> Result<Vec<Finding>> {
    let share = still_share(dataset)?;
    Ok(share.map(|share| Finding::new(Fault::Surroundings, None, text(share))).into_iter().collect())
}

/// Says what is wrong.
pub fn text(share: f64) -> String {
    format!(
        "the surroundings do not follow the poses: {:.0} % of the border looks the same from cameras that are turned by more \
         than {TURN_MIN:.0} degrees against each other, as where an object is turned before a camera that stands still. A \
         training makes fog of them before the object",
        100.0 * share
    )
}
