//! A picture beside its truth, for whoever wants to see what is scored.

use crate::Result;
use crate::scene::Photo;

/// A scored picture.
#[derive(Clone, Debug)]
pub struct Compared<'a> {
    /// Name of the view.
    pub view: &'a str,
    /// Name of the object; `None` for the whole view.
    pub object: Option<String>,
    /// The photo, at the size of the picture.
    pub photo: &'a Photo,
    /// The picture, not clamped, row-major.
    pub rgb: &'a [[f32; 3]],
    /// What was found to be the object, and what is.
    pub masks: Option<(&'a [bool], &'a [bool])>,
    /// Scores by name.
    pub numbers: Vec<(&'static str, Option<f64>)>,
    /// What a person should know about it, such as why there is no prediction.
    pub note: String,
}

impl<'a> Compared<'a> {
    /// A whole view without scores.
    pub fn new(view: &'a str, photo: &'a Photo, rgb: &'a [[f32; 3]]) -> Self {
        Self { view, object: None, photo, rgb, masks: None, numbers: Vec::new(), note: String::new() }
    }
}

/// Sees every picture after it was scored.
pub trait Watch {
    /// A scored picture.
    fn see(&mut self, _picture: &Compared) -> Result<()> {
        Ok(())
    }

    /// A picture for which there is no truth.
    fn skip(&mut self) -> Result<()> {
        Ok(())
    }
}

/// Nobody looks.
impl Watch for () {}
