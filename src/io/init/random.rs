//! Points for a scene that has none.
//!
//! Where the border of the photos has one colour throughout (a synthetic scene over a plain background), candidates
//! are drawn evenly in the ball that the cameras see in common, and one that is seen in the background colour is free
//! space: what remains is the visual hull. A point gets the mean colour of the pixels it falls on.
//!
//! Elsewhere four of five points come from [`sweep`](super::sweep), which finds the depth of random pixels, and the
//! rest, even in inverse depth, from anywhere before the cameras. All are seen by three training cameras where there
//! are as many. Without photos every place before the cameras is as good and colours are random.

use super::region::{self, Region};
use super::sweep::Sweep;
use super::texel::texel;
use crate::error::{Error, Result};
use crate::scene::{Camera, Dataset, Point, View};
use glam::{DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Candidates are drawn in batches; after this many batches without enough points the tests are eased.
const BATCHES: usize = 24;
/// Part of the points that may lie anywhere before the cameras, if photos tell where most should.
const ANYWHERE: f64 = 0.2;
/// Colour difference up to which a pixel counts as background.
const BACKGROUND_TOLERANCE: u8 = 3;
/// Views whose border is looked at.
const BORDER_VIEWS: usize = 40;

/// What a candidate must pass.
struct Test<'a> {
    views: &'a [View],
    /// Cameras that must see it.
    seen_by: usize,
    /// Colour of free space.
    backdrop: Option<[u8; 3]>,
}

/// `count` points, the same for the same seed and scene.
pub(super) fn points(dataset: &Dataset, seed: u64, count: usize) -> Result<Vec<Point>> {
    let views = &dataset.train;
    if views.is_empty() {
        return Err(Error::data(&dataset.root, "", "has neither points nor training views to place Gaussians by"));
    }
    let region = region::find(views, dataset.extent());
    let mut test = Test { views, seen_by: views.len().min(3), backdrop: backdrop(views) };
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut points = Vec::with_capacity(count);
    if test.backdrop.is_none() {
        let found = Sweep::new(views, region.depths()).points(&mut random, count);
        points.extend(found.into_iter().take(((1.0 - ANYWHERE) * count as f64) as usize));
    }
    // The tests are eased until they leave enough: no free space, then two cameras, one, none.
    loop {
        for _ in 0..BATCHES {
            if points.len() >= count {
                points.truncate(count);
                return Ok(points);
            }
            let plain = test.backdrop.is_some();
            let drawn: Vec<Point> =
                (0..count.max(1024)).map(|_| candidate(&mut random, views, region, plain)).collect();
            let kept: Vec<Option<Point>> = drawn.par_iter().map(|point| test.judge(*point)).collect();
            points.extend(kept.into_iter().flatten());
        }
        if test.backdrop.take().is_none() {
            test.seen_by = test.seen_by.saturating_sub(1);
        }
    }
}

/// A point with a random colour: in the ball if there is one and nothing around it, else before some camera.
fn candidate(random: &mut Pcg64Mcg, views: &[View], region: Region, plain: bool) -> Point {
    let colour = random.random::<[u8; 3]>();
    let position = match region {
        Region::Ball { centre, radius, .. } if plain => centre + radius * in_unit_ball(random),
        _ => {
            let camera = &views[random.random_range(0..views.len())].camera;
            ahead(random, camera, region.depths())
        }
    };
    Point { position, colour }
}

fn in_unit_ball(random: &mut Pcg64Mcg) -> DVec3 {
    loop {
        let at =
            DVec3::new(random.random_range(-1.0..1.0), random.random_range(-1.0..1.0), random.random_range(-1.0..1.0));
        if at.length_squared() <= 1.0 {
            return at;
        }
    }
}

/// A point in some pixel of `camera`, evenly in inverse depth between two depths.
fn ahead(random: &mut Pcg64Mcg, camera: &Camera, (near, far): (f64, f64)) -> DVec3 {
    let pixel = DVec2::new(
        random.random_range(0.0..f64::from(camera.width)),
        random.random_range(0.0..f64::from(camera.height)),
    );
    let depth = 1.0 / random.random_range(1.0 / far..1.0 / near);
    region::unproject(camera, pixel, depth)
}

impl Test<'_> {
    /// The point with its colour, if it passes.
    fn judge(&self, point: Point) -> Option<Point> {
        let (mut seen, mut coloured, mut free, mut sum) = (0, 0u32, 0, [0u32; 3]);
        for view in self.views {
            let Some(pixel) = region::sees(&view.camera, point.position) else { continue };
            seen += 1;
            let Some(texel) = view.photo.as_ref().and_then(|photo| texel(photo, pixel)) else { continue };
            coloured += 1;
            (0..3).for_each(|channel| sum[channel] += u32::from(texel[channel]));
            free += u32::from(self.backdrop.is_some_and(|backdrop| near(texel, backdrop)));
        }
        // A part of a dark subject may have the colour of the background now and then, free space has it soon.
        if seen < self.seen_by || free * 10 > coloured {
            return None;
        }
        let colour =
            if coloured > 0 { sum.map(|value| ((value + coloured / 2) / coloured) as u8) } else { point.colour };
        Some(Point { colour, ..point })
    }
}

fn near(a: [u8; 3], b: [u8; 3]) -> bool {
    a.iter().zip(b).all(|(&a, b)| a.abs_diff(b) <= BACKGROUND_TOLERANCE)
}

/// The colour of nine tenths of the border pixels of some views, if there is one.
fn backdrop(views: &[View]) -> Option<[u8; 3]> {
    let mut border: Vec<[u8; 3]> = Vec::new();
    for photo in views.iter().step_by(views.len() / BORDER_VIEWS + 1).filter_map(|view| view.photo.as_ref()) {
        let (width, height) = (photo.width as usize, photo.height as usize);
        let rows = [0, height - 1].into_iter().flat_map(|y| (0..width).map(move |x| (x, y)));
        let columns = [0, width - 1].into_iter().flat_map(|x| (0..height).map(move |y| (x, y)));
        let texels = rows.chain(columns).map(|(x, y)| photo.rgba[y * width + x]);
        border.extend(texels.filter(|texel| texel[3] == 255).map(|[r, g, b, _]| [r, g, b]));
    }
    border.sort_unstable();
    let middle = *border.get(border.len() / 2)?;
    let same = border.iter().filter(|&&texel| near(texel, middle)).count();
    (same * 10 >= border.len() * 9).then_some(middle)
}
