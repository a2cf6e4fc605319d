//! The first Gaussians of a scene: on its points, or where its cameras look if it has none.

mod random;
mod region;
mod sweep;
mod texel;

use crate::error::{Error, Result};
use crate::scene::origin::far_origin;
use crate::scene::{Dataset, Gaussians, Point};
use crate::shaders::constants::exact::SH_C0;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::num::NonZero;

/// Opacity of a new Gaussian.
const OPACITY: f64 = 0.1;
/// Smallest mean squared distance to the neighbours (3DGS): world units squared, or squared extents of the scene where
/// that is smaller than 1.
const DISTANCE2_MIN: f64 = 1e-7;
/// Neighbours that decide the size of a Gaussian.
const NEIGHBOURS: usize = 3;
/// Largest standard deviation of a Gaussian on a point that was made up, as a part of the longer side of the image in
/// the nearest camera that sees it. Points in the wide gaps before the cameras would cover whole pictures, and cost more
/// than all others together; half of this costs quality at first.
const SIZE_MAX: f64 = 0.02;
/// With fewer points a scene counts as one without points.
const POINTS_MIN: usize = 16;
/// A sensible number of Gaussians for a scene without points.
pub const RANDOM_COUNT: usize = 50_000;

/// Gaussians to start training from: SH degree 3 with only the constant colour set, opacity 0.1, no rotation, the
/// same size in all directions, namely the root mean square distance to the three nearest neighbours, no labels.
///
/// They stand on the points of the scene. Without points (or with fewer than 16), `count_if_no_points` of them are
/// placed where the training cameras look and, with photos, where the photos agree on a colour; none is then larger
/// than a fiftieth of a picture.
pub fn initial_gaussians(dataset: &Dataset, seed: u64, count_if_no_points: usize) -> Result<Gaussians> {
    if dataset.points.len() >= POINTS_MIN {
        check_seen(dataset)?;
        let distances2 = neighbour_distances2(&dataset.points, dataset.extent())?;
        return Ok(from_points(&dataset.points, &distances2, dataset.extent()));
    }
    let mut points = random::points(dataset, seed, count_if_no_points)?;
    points.extend_from_slice(&dataset.points);
    let mut distances2 = neighbour_distances2(&points, dataset.extent())?;
    distances2.par_iter_mut().zip(&points).for_each(|(distance2, point)| {
        *distance2 = distance2.min((SIZE_MAX * region::image_side(&dataset.train, point.position)).powi(2));
    });
    Ok(from_points(&points, &distances2, dataset.extent()))
}

/// Refuses points of which no camera sees any: nothing would ever be drawn, and nothing learnt.
fn check_seen(dataset: &Dataset) -> Result<()> {
    let seen = |point: &Point| dataset.train.iter().any(|view| region::sees(&view.camera, point.position).is_some());
    if dataset.train.is_empty() || dataset.points.par_iter().any(seen) {
        return Ok(());
    }
    let problem = format!(
        "none of the {} points is in the picture of any of {} training cameras: poses are of another kind than the \
         format says (world-to-camera for camera-to-world, or other axes), or the points belong to another scene; \
         without points training would start anywhere before the cameras",
        dataset.points.len(),
        dataset.train.len()
    );
    Err(Error::data(&dataset.root, "points", problem))
}

/// One Gaussian per point, in their order; `distances2` are their squared sizes.
fn from_points(points: &[Point], distances2: &[f64], extent: f64) -> Gaussians {
    let least = DISTANCE2_MIN * extent.min(1.0).powi(2);
    let logit = (OPACITY / (1.0 - OPACITY)).ln() as f32;
    let count = points.len();
    let scale = |&distance2: &f64| [(0.5 * distance2.max(least).ln()) as f32; 3];
    let constant = |value: u8| ((f64::from(value) / 255.0 - 0.5) / SH_C0) as f32;
    let origin = far_origin(&points.iter().map(|point| point.position).collect::<Vec<_>>());
    let mut gaussians = Gaussians {
        origin,
        means: points.iter().map(|point| (point.position - origin).as_vec3().to_array()).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        scales: distances2.iter().map(scale).collect(),
        opacities: vec![logit; count],
        sh0: points.iter().map(|point| point.colour.map(constant)).collect(),
        sh_degree: 3,
        ..Gaussians::default()
    };
    gaussians.sh_rest = vec![[0.0; 3]; count * gaussians.rest_per_gaussian()];
    gaussians
}

/// Mean squared distance of each point to its three nearest neighbours; to fewer where there are fewer, and a
/// hundredth of the scene for a lone point.
fn neighbour_distances2(points: &[Point], extent: f64) -> Result<Vec<f64>> {
    let positions: Vec<[f64; 3]> = points.iter().map(|point| point.position.to_array()).collect();
    let nearest = NEIGHBOURS.min(positions.len().saturating_sub(1));
    // One more than wanted, because a point is its own nearest neighbour.
    let Some(asked) = NonZero::new(nearest + 1).filter(|_| nearest > 0) else {
        return Ok(vec![(extent * 0.01).powi(2); positions.len()]);
    };
    let tree: ImmutableKdTree<f64, 3> = ImmutableKdTree::new_from_slice(&positions)
        .map_err(|error| Error::Bug(format!("the k-d tree of the points failed: {error:?}")))?;
    let mean = |(index, position): (usize, &[f64; 3])| {
        let found = tree.query(position).nearest_n::<SquaredEuclidean<f64>>(asked).execute();
        // Among many points at one place the point itself may be missing from the answer.
        let others = found.iter().filter(|item| item.item as usize != index).take(nearest);
        others.map(|item| item.distance).sum::<f64>() / nearest as f64
    };
    Ok(positions.par_iter().enumerate().map(mean).collect())
}
