//! Points for a scene without points.
//!
//! Some scenes have photos with a border of a single colour (synthetic scenes over a plain background). Candidates are
//! then drawn uniformly in the ball that all cameras see. A candidate that a photo shows in the background colour is in
//! free space; the remaining ones fill the visual hull. The colour of a point is the mean over its pixels.
//!
//! In other scenes, four of five points come from [`sweep`](super::sweep), which finds the depth of random pixels. The
//! others are anywhere in front of the cameras, uniform in inverse depth. Three training cameras see each point if
//! possible. Without photos, all positions in front of the cameras are equal, and colours are random.

use super::region::{self, Region};
use super::sweep::Sweep;
use super::texel::texel;
use glam::{DVec2, DVec3};
use labelgs_scene::{Camera, Dataset, Error, Photo, Pixels, Point, Result, View};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Batches of candidates without enough points before the tests are relaxed.
const BATCHES_MAX: usize = 24;
/// Share of the points anywhere in front of the cameras if photos place the others.
const ANYWHERE_SHARE: f64 = 0.2;
/// Largest colour difference from the background for a background pixel.
const BACKGROUND_TOLERANCE: u8 = 3;
/// Number of views whose border is examined.
const BORDER_VIEWS_MAX: usize = 40;

struct CandidateTest<'a> {
    views: &'a [View],
    /// Number of cameras that must see the candidate.
    seen_by: usize,
    /// Colour of the background.
    background_colour: Option<[u8; 3]>,
}

/// Returns `count` points, determined by seed and scene.
pub(super) fn points(dataset: &Dataset, seed: u64, count: usize) -> Result<Vec<Point>> {
    let views = &dataset.train;
    if views.is_empty() {
        return Err(Error::data(
            &dataset.root,
            "",
            "has neither points nor training views, which place the first Gaussians",
        ));
    }
    let region = region::find(views, dataset.extent());
    let mut test = CandidateTest { views, seen_by: views.len().min(3), background_colour: background_colour(views)? };
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut points = Vec::with_capacity(count);
    if test.background_colour.is_none() {
        let found = Sweep::new(views, region.depths())?.points(&mut random, count);
        points.extend(found.into_iter().take(((1.0 - ANYWHERE_SHARE) * count as f64) as usize));
    }
    // Relax the tests until enough points pass: first free space, then two cameras, one, none.
    loop {
        for _ in 0..BATCHES_MAX {
            if points.len() >= count {
                points.truncate(count);
                return Ok(points);
            }
            let plain = test.background_colour.is_some();
            let drawn: Vec<Point> =
                (0..count.max(1024)).map(|_| candidate(&mut random, views, region, plain)).collect();
            points.extend(test.passing(drawn)?);
        }
        if test.background_colour.take().is_none() {
            test.seen_by = test.seen_by.saturating_sub(1);
        }
    }
}

/// Draws a point with a random colour: in the ball if there is one over a plain background, otherwise in front of a
/// camera.
fn candidate(random: &mut Pcg64Mcg, views: &[View], region: Region, plain: bool) -> Point {
    let colour = random.random::<[u8; 3]>();
    let position = match region {
        Region::Ball { centre, radius, .. } if plain => centre + radius * in_unit_ball(random),
        _ => {
            let camera = &views[random.random_range(0..views.len())].camera;
            in_front(random, camera, region.depths())
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

/// Draws a point in a random pixel of `camera`, uniform in inverse depth between two depths.
fn in_front(random: &mut Pcg64Mcg, camera: &Camera, (near, far): (f64, f64)) -> DVec3 {
    let pixel = DVec2::new(
        random.random_range(0.0..f64::from(camera.width)),
        random.random_range(0.0..f64::from(camera.height)),
    );
    let depth = 1.0 / random.random_range(1.0 / far..1.0 / near);
    camera.unproject(pixel, depth)
}

/// What the views show at a candidate.
#[derive(Clone, Copy, Default)]
struct CandidateEvidence {
    /// Views that see the candidate.
    seen: usize,
    /// Number of photos with a colour there, the sum of these colours, and how many have the background colour.
    coloured: u32,
    sum: [u32; 3],
    free: u32,
}

impl CandidateTest<'_> {
    /// Returns the points that pass the test, with their colours. Loads one photo at a time, because not all may be in
    /// memory.
    fn passing(&self, drawn: Vec<Point>) -> Result<Vec<Point>> {
        let mut shown = vec![CandidateEvidence::default(); drawn.len()];
        for view in self.views {
            let photo = view.photo.as_ref().map(Pixels::get).transpose()?;
            shown.par_iter_mut().zip(&drawn).for_each(|(shown, point)| self.look(shown, point, view, photo.as_deref()));
        }
        Ok(drawn.into_iter().zip(shown).filter_map(|(point, shown)| self.judge(point, shown)).collect())
    }

    fn look(&self, shown: &mut CandidateEvidence, point: &Point, view: &View, photo: Option<&Photo>) {
        let Some(pixel) = view.camera.sees(point.position) else { return };
        shown.seen += 1;
        let Some(texel) = photo.and_then(|photo| texel(photo, pixel)) else { return };
        shown.coloured += 1;
        (0..3).for_each(|channel| shown.sum[channel] += u32::from(texel[channel]));
        shown.free += u32::from(self.background_colour.is_some_and(|background_colour| near(texel, background_colour)));
    }

    /// Returns the point with its colour if it passes the test.
    fn judge(&self, point: Point, CandidateEvidence { seen, coloured, sum, free }: CandidateEvidence) -> Option<Point> {
        // Some pixels of a dark subject may have the background colour, so accept a few.
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

/// Returns the colour of nine tenths of the border pixels of some views, if there is such a colour.
fn background_colour(views: &[View]) -> Result<Option<[u8; 3]>> {
    let mut border: Vec<[u8; 3]> = Vec::new();
    for photo in views.iter().step_by(views.len() / BORDER_VIEWS_MAX + 1).filter_map(|view| view.photo.as_ref()) {
        let photo = photo.get()?;
        let (width, height) = (photo.width as usize, photo.height as usize);
        let rows = [0, height - 1].into_iter().flat_map(|y| (0..width).map(move |x| (x, y)));
        let columns = [0, width - 1].into_iter().flat_map(|x| (0..height).map(move |y| (x, y)));
        let texels = rows.chain(columns).map(|(x, y)| photo.rgba[y * width + x]);
        border.extend(texels.filter(|texel| texel[3] >= 128).map(|[r, g, b, _]| [r, g, b]));
    }
    border.sort_unstable();
    let Some(&middle) = border.get(border.len() / 2) else { return Ok(None) };
    let same = border.iter().filter(|&&texel| near(texel, middle)).count();
    Ok((same * 10 >= border.len() * 9).then_some(middle))
}
