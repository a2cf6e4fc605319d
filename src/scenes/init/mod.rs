//! The first Gaussians of a scene: at its points, or in the space that its cameras see.

mod hull;
mod random;
mod region;
mod shell;
mod sweep;
mod texel;
mod thin;

use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use labelgs_scene::harmonics::sh0_of;
use labelgs_scene::origin::far_origin;
use labelgs_scene::stage::Stage;
use labelgs_scene::{Dataset, Error, Gaussians, Point, Result};
use rayon::prelude::*;
use std::num::NonZero;

pub use hull::inside;
pub use thin::thinned;

/// Opacity of a new Gaussian.
const INITIAL_OPACITY: f64 = 0.1;
/// Smallest mean squared distance to the neighbours (3DGS), world units squared; in scenes smaller than 1, in squared
/// scene extents.
const DISTANCE2_MIN: f64 = 1e-7;
/// Number of neighbours that determine the size of a Gaussian.
const NEIGHBOUR_COUNT: usize = 3;
/// Largest standard deviation of a Gaussian at a random point, as a share of the longer image side in the nearest
/// camera that sees it. Otherwise, random points in wide gaps near cameras would cover whole images and cost more than
/// all others together. Half of this value lowers the early quality.
const SIZE_MAX: f64 = 0.02;
/// A scene with fewer points counts as one without points.
const POINTS_MIN: usize = 16;

/// Creates the initial Gaussians: SH degree 3 with only the constant colour set, opacity 0.1, no rotation, isotropic,
/// no labels. The standard deviation is the root mean square distance to the three nearest neighbours.
///
/// There is one Gaussian per point of the scene. A scene with fewer than 16 points gets `count_if_no_points` Gaussians
/// in the space that the training cameras see, if possible where the photos agree on a colour; none of these is larger
/// than a fiftieth of an image.
pub fn initial_gaussians(dataset: &Dataset, seed: u64, count_if_no_points: usize) -> Result<Gaussians> {
    first_gaussians(dataset, &dataset.points, seed, count_if_no_points)
}

/// Creates the initial Gaussians at some of the scene's points, like [`initial_gaussians`] for all points.
pub fn first_gaussians(dataset: &Dataset, points: &[Point], seed: u64, count_if_no_points: usize) -> Result<Gaussians> {
    if has_points(dataset) {
        check_seen(dataset)?;
        let distances2 = neighbour_distances2(points, dataset.extent())?;
        return Ok(from_points(points, &distances2, dataset.extent()));
    }
    let _stage = Stage::new("finding places for the first Gaussians", 0);
    let mut points = match dataset.objects_only {
        true => hull::points(dataset, seed, count_if_no_points)?,
        false => random::points(dataset, seed, count_if_no_points)?,
    };
    points.extend_from_slice(&dataset.points);
    let mut distances2 = neighbour_distances2(&points, dataset.extent())?;
    distances2.par_iter_mut().zip(&points).for_each(|(distance2, point)| {
        *distance2 = distance2.min((SIZE_MAX * region::image_side(&dataset.train, point.position)).powi(2));
    });
    Ok(from_points(&points, &distances2, dataset.extent()))
}

/// Returns true if the first Gaussians are at the scene's points and not at random positions.
pub fn has_points(dataset: &Dataset) -> bool {
    dataset.points.len() >= POINTS_MIN
}

/// Adds far Gaussians to the initial ones where photos look past all points of the scene, for example at the sky. Tests
/// `directions` directions. Adds none to a scene without points, because its random points lie at all depths.
pub fn add_far_gaussians(model: &mut Gaussians, dataset: &Dataset, directions: u32) -> Result<()> {
    if !has_points(dataset) {
        return Ok(());
    }
    let (points, deviation) = shell::points(dataset, directions as usize)?;
    tracing::debug!("{} of {directions} directions look past all points", points.len());
    let distances2 = vec![deviation * deviation; points.len()];
    let mut far = from_points(&points, &distances2, dataset.extent());
    let shift = far.origin - model.origin;
    far.means.iter_mut().for_each(|mean| *mean = (DVec3::from(mean.map(f64::from)) + shift).as_vec3().to_array());
    model.append(far);
    Ok(())
}

/// Refuses a scene in which no camera sees a point: nothing would be rendered or trained.
fn check_seen(dataset: &Dataset) -> Result<()> {
    let seen = |point: &Point| dataset.train.iter().any(|view| view.camera.sees(point.position).is_some());
    if dataset.train.is_empty() || dataset.points.par_iter().any(seen) {
        return Ok(());
    }
    let problem = format!(
        "none of the {} points is in the image of any of {} training cameras: the poses follow another convention than \
         the format (world-to-camera for camera-to-world, or other axes), or the points belong to another scene; \
         without the points, training starts from random ones before the cameras",
        dataset.points.len(),
        dataset.train.len()
    );
    Err(Error::data(&dataset.root, "points", problem))
}

/// Creates one Gaussian per point, in order. `distances2` has the squared standard deviations.
fn from_points(points: &[Point], distances2: &[f64], extent: f64) -> Gaussians {
    let least = DISTANCE2_MIN * extent.min(1.0).powi(2);
    let logit = (INITIAL_OPACITY / (1.0 - INITIAL_OPACITY)).ln() as f32;
    let count = points.len();
    let scale = |&distance2: &f64| [(0.5 * distance2.max(least).ln()) as f32; 3];
    let constant = |value: u8| sh0_of(f64::from(value) / 255.0);
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

/// Returns the mean squared distance of each point to its three nearest neighbours, or to all others if there are
/// fewer. A single point gets a hundredth of the scene extent.
fn neighbour_distances2(points: &[Point], extent: f64) -> Result<Vec<f64>> {
    let _stage = Stage::new(format_args!("measuring the distances of {} points", points.len()), 0);
    let positions: Vec<[f64; 3]> = points.iter().map(|point| point.position.to_array()).collect();
    let nearest = NEIGHBOUR_COUNT.min(positions.len().saturating_sub(1));
    // +1: the query returns the point itself.
    let Some(asked) = NonZero::new(nearest + 1).filter(|_| nearest > 0) else {
        return Ok(vec![(extent * 0.01).powi(2); positions.len()]);
    };
    let tree: ImmutableKdTree<f64, 3> = ImmutableKdTree::new_from_slice(&positions)
        .map_err(|error| Error::Bug(format!("the k-d tree of the points failed: {error:?}")))?;
    let mean = |(index, position): (usize, &[f64; 3])| {
        let found = tree.query(position).nearest_n::<SquaredEuclidean<f64>>(asked).execute();
        // Among many coinciding points, the query may not return the point itself.
        let others = found.iter().filter(|item| item.item as usize != index).take(nearest);
        others.map(|item| item.distance).sum::<f64>() / nearest as f64
    };
    Ok(positions.par_iter().enumerate().map(mean).collect())
}
