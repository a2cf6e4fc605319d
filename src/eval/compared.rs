//! Scored pictures beside their ground truth, for display.

use crate::Result;
use crate::scene::{LabelMap, Photo};

/// A scored picture.
#[derive(Clone, Debug)]
pub struct ScoredPicture<'a> {
    /// Name of the view.
    pub view: &'a str,
    /// Name of the object; `None` for the whole view.
    pub object: Option<String>,
    /// The photo, at the picture's size.
    pub photo: &'a Photo,
    /// The picture, r, g, b, not clamped, row-major.
    pub rgb: &'a [[f32; 3]],
    /// Label map of the picture, for a whole view.
    pub labels: Option<&'a LabelMap>,
    /// Mask of the view, to compare with the label map.
    pub truth: Option<&'a LabelMap>,
    /// Predicted and ground-truth mask of the object, row-major.
    pub masks: Option<(&'a [bool], &'a [bool])>,
    /// Scores with their names.
    pub numbers: Vec<(&'static str, Option<f64>)>,
    /// Note for the user, such as the reason for a missing prediction.
    pub note: String,
}

impl<'a> ScoredPicture<'a> {
    /// Makes an entry for a whole view, without scores.
    pub fn new(view: &'a str, photo: &'a Photo, rgb: &'a [[f32; 3]]) -> Self {
        Self {
            view,
            object: None,
            photo,
            rgb,
            labels: None,
            truth: None,
            masks: None,
            numbers: Vec::new(),
            note: String::new(),
        }
    }

    /// Returns a score by name.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.numbers.iter().find(|number| number.0 == name)?.1
    }
}

/// Receives every scored picture.
pub trait PictureObserver {
    /// Receives a picture after it was scored.
    fn observe(&mut self, _picture: &ScoredPicture) -> Result<()> {
        Ok(())
    }

    /// Counts a picture without ground truth.
    fn skip(&mut self) -> Result<()> {
        Ok(())
    }
}

/// Ignores all pictures.
impl PictureObserver for () {}
