//! Places sorted for questions about the nearest ones.

use kiddo::ImmutableKdTree;
use labelgs_scene::{Error, Result};

/// A tree of places, world units.
pub type Tree = ImmutableKdTree<f64, 3>;

/// Sorts places. There is at least one, and all are finite.
///
/// # Errors
///
/// A tree that cannot be built, which is a bug.
pub fn tree(places: &[[f64; 3]]) -> Result<Tree> {
    Tree::new_from_slice(places).map_err(|error| Error::Bug(format!("the k-d tree of the Gaussians failed: {error:?}")))
}
