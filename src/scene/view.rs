//! Posed photos with their masks, and the scene they make up.

use super::{Camera, LabelMap};
use glam::DVec3;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

/// A decoded photo, row-major RGBA8. Alpha is 255 where the photo holds a colour and 0 where it has no source
/// (outside the original image after undistortion); pixels with alpha 0 stay out of every loss and score.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Photo {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// [height, width] of (r, g, b, valid).
    pub rgba: Vec<[u8; 4]>,
}

/// One posed photo. Photo and mask are shared by all its copies.
#[derive(Clone, Debug)]
pub struct View {
    /// Name as the data set lists it, such as `00.jpg` or `left/00.jpg`.
    pub name: String,
    /// Camera of the photo as it is in memory (undistorted, resized).
    pub camera: Camera,
    /// The photo; `None` if photos were not asked for.
    pub photo: Option<Arc<Photo>>,
    /// Visible objects; `None` if no masks were asked for or this view has none.
    pub mask: Option<Arc<LabelMap>>,
}

impl View {
    /// Name for output files: without extension, path separators as `_`.
    pub fn stem(&self) -> String {
        let path = std::path::Path::new(&self.name).with_extension("");
        path.to_string_lossy().replace(['/', '\\'], "_")
    }
}

/// Names for output files of several views, none twice: [`View::stem`], with a number behind it where another view before
/// it has the same (`a/1.jpg` and `a_1.png`).
pub(crate) fn stems(views: &[&View]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let mut name = |view: &&View| {
        let stem = view.stem();
        let free = (1..).map(|n| if n == 1 { stem.clone() } else { format!("{stem}_{n}") });
        let name = free.into_iter().find(|name| !taken.contains(name)).unwrap_or_default();
        taken.insert(name.clone());
        name
    };
    views.iter().map(&mut name).collect()
}

/// A coloured 3-D point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// World position.
    pub position: DVec3,
    /// Colour.
    pub colour: [u8; 3],
}

/// A scene as read from disk.
#[derive(Clone, Debug, Default)]
pub struct Dataset {
    /// Folder of the scene.
    pub root: PathBuf,
    /// Views to train on, sorted by name.
    pub train: Vec<View>,
    /// Held-out views, sorted by name.
    pub test: Vec<View>,
    /// Points to start from; may be empty.
    pub points: Vec<Point>,
    /// What a person should know about the way it was read, a line each.
    pub notes: Vec<String>,
}

impl Dataset {
    /// All views, sorted by name.
    pub fn all(&self) -> Vec<&View> {
        let mut views: Vec<&View> = self.train.iter().chain(&self.test).collect();
        views.sort_by(|a, b| a.name.cmp(&b.name));
        views
    }

    /// Radius of the training cameras around their mean, times 1.1 (method of 3DGS); 1 where that is nothing but
    /// rounding.
    pub fn extent(&self) -> f64 {
        let centres: Vec<DVec3> = self.train.iter().map(|view| view.camera.centre()).collect();
        if centres.is_empty() {
            return 1.0;
        }
        let mean = centres.iter().sum::<DVec3>() / centres.len() as f64;
        let radius = centres.iter().map(|c| c.distance(mean)).fold(0.0, f64::max);
        let far = centres.iter().map(|centre| centre.length()).fold(1.0, f64::max);
        if radius > 1e-9 * far { radius * 1.1 } else { 1.0 }
    }
}
