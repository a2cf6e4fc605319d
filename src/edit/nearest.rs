//! Spatial index for nearest-neighbour queries.

use kiddo::ImmutableKdTree;
use labelgs_scene::{Error, Result};

/// A k-d tree of positions, world units.
pub type Tree = ImmutableKdTree<f64, 3>;

/// Builds the tree. `places` must have at least one position, all finite.
///
/// # Errors
///
/// A tree that cannot be built, which is a bug.
pub fn tree(places: &[[f64; 3]]) -> Result<Tree> {
    Tree::new_from_slice(places).map_err(|error| Error::Bug(format!("the k-d tree of the Gaussians failed: {error:?}")))
}
