//! The messages between page and server. The page sends JSON; the server answers with JSON and with frames.
//!
//! A frame is a header of little-endian numbers and its images, each after its length: what a browser decodes by
//! itself, PNG or JPEG.

use super::finder::News;
use crate::edit::Edit;
use crate::edit::selection::{Combine, Region, Side};
use crate::scenes::camera_json::CameraFile;
use serde::Deserialize;
use std::path::PathBuf;

/// Largest message of a page, bytes.
pub(super) const BYTES_MAX: usize = 256 << 10;
/// Maximum number of messages of a page per second; short bursts may have twice as many.
pub(super) const RATE_MAX: f64 = 240.0;
/// Maximum number of pixels of an image.
pub(super) const PIXELS_MAX: u64 = 8 << 20;

/// The content of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Pane {
    /// Colour.
    Colour,
    /// Labels in their colours.
    Labels,
    /// Labels over colour.
    Tinted,
    /// Depth.
    Depth,
    /// Opacity.
    Opacity,
    /// Confidence of the label of the main Gaussian.
    Confidence,
    /// Difference from the photo of the view.
    Error,
}

/// A camera: of a view by its number, or free.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Viewpoint {
    /// The camera of a view, exactly.
    View(usize),
    /// A free camera.
    Camera(CameraFile),
}

/// A request for a frame.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LookRequest {
    /// Number of the request, for the answer.
    pub(super) seq: u32,
    pub(super) from: Viewpoint,
    /// Width and height of the image, px, if they differ from the camera's.
    #[serde(default)]
    pub(super) size: Option<[u32; 2]>,
    /// One or two images.
    pub(super) panes: Vec<Pane>,
    /// The camera moves: the image may be smaller than the camera says.
    pub(super) moving: bool,
}

/// A change to the selection of Gaussians.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "select", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum SelectionChange {
    /// By what is drawn over an image.
    Draw {
        /// Camera of the full image.
        from: Viewpoint,
        /// What is drawn, in its pixels.
        region: Region,
        /// Also what is hidden.
        through: bool,
        how: Combine,
    },
    /// In a ball around what is at a pixel.
    Ball {
        /// Camera of the full image.
        from: Viewpoint,
        /// Column and row.
        pixel: [u32; 2],
        /// Radius of the ball in the image, px.
        radius: f64,
        how: Combine,
    },
    /// Connected Gaussians of a colour similar to the main Gaussian of a pixel.
    Flood {
        /// Camera of the full image.
        from: Viewpoint,
        /// Column and row.
        pixel: [u32; 2],
        /// Difference of colour between neighbours, 0 to 1.
        tolerance: f32,
        how: Combine,
    },
    /// In front of what is at a pixel, or behind.
    Depth {
        /// Camera of the full image.
        from: Viewpoint,
        /// Column and row.
        pixel: [u32; 2],
        side: Side,
        how: Combine,
    },
    /// The object that strokes are on, and others are not.
    Stroke {
        /// Camera of the full image.
        from: Viewpoint,
        /// The line, px from the corner of the first pixel.
        points: Vec<[f64; 2]>,
        /// Distance that it reaches to each side, px.
        radius: f64,
        /// It is on the object.
        on: bool,
    },
    /// By label.
    Labels { labels: Vec<u32>, how: Combine },
    /// With its neighbours.
    Grow,
    /// Without those beside others.
    Shrink,
    /// All others.
    Invert,
    /// Nothing.
    Nothing,
    /// Protects the selected Gaussians from later selections.
    Lock,
    /// Nothing is locked.
    Unlock,
}

/// An export to a separate file; the shown model does not change.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Export {
    /// These labels; none: everything.
    pub(super) labels: Vec<u32>,
    /// The selected Gaussians, instead of labels.
    #[serde(default)]
    pub(super) chosen: bool,
    /// Name without ending.
    pub(super) name: String,
    /// Ending of the format.
    pub(super) format: String,
}

/// A request about the object that a page points at.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "object", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum ObjectRequest {
    /// It is at a pixel, or that does not belong to it.
    Click {
        /// Camera of the full image.
        from: Viewpoint,
        /// Column and row.
        pixel: [u32; 2],
        /// On the object.
        on: bool,
    },
    /// It is in a box.
    Box {
        /// Camera of the full image.
        from: Viewpoint,
        /// First column and row, and the last.
        corners: [u32; 4],
    },
    /// It becomes a label.
    Keep {
        /// Its name; empty for none.
        name: String,
    },
    /// It is forgotten.
    Drop,
}

/// A command for a running training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Command {
    /// Pause.
    Pause,
    /// Go on.
    Resume,
    /// Write a checkpoint.
    Save,
    /// Write model and checkpoint, and end.
    Stop,
}

/// A message of a page.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum Message {
    /// A request for a frame. A newer one replaces it.
    Look(LookRequest),
    /// A frame was drawn.
    Ack {
        /// Number of the request.
        seq: u32,
    },
    /// What is at a pixel?
    Pick {
        /// Number, for the answer.
        seq: u32,
        /// Camera of the full image.
        from: Viewpoint,
        /// Column and row.
        pixel: [u32; 2],
    },
    /// Sets the colour behind the model.
    Background {
        /// r, g, b, 0 to 1.
        colour: [f32; 3],
    },
    /// Sets the visible labels: all except the hidden ones, or only some.
    Show {
        /// Labels that are not drawn.
        hidden: Vec<u32>,
        /// Labels that are drawn alone; empty: no such choice.
        solo: Vec<u32>,
    },
    /// Changes the model. Rows are those that are chosen.
    Edit {
        /// The change.
        what: Edit,
    },
    /// Selects Gaussians.
    Choose {
        /// How.
        what: SelectionChange,
    },
    /// Writes a file for the page to fetch.
    Export {
        /// What.
        what: Export,
    },
    /// Points at an object, or says what becomes of it.
    Object {
        /// What.
        what: ObjectRequest,
    },
    /// News of that object, from the thread that looks for it.
    #[serde(skip)]
    News {
        /// Number of its task.
        number: u64,
        /// What.
        news: News,
    },
    /// Opens another model, which a page has sent.
    #[serde(skip)]
    Open {
        /// Its file.
        path: PathBuf,
    },
    /// Takes back the last change.
    Undo,
    /// Makes it again.
    Redo,
    /// Writes the changed model.
    Write,
    /// Asks something of the training.
    Train {
        /// What.
        what: Command,
    },
    /// The page is still there.
    Alive,
    /// Sets the share of time for viewing while a training runs.
    Share {
        /// 0 to 1.
        share: f32,
    },
}

/// A rendered frame, ready to be sent.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    pub(super) seq: u32,
    pub(super) step: u32,
    /// Size of the images, px.
    pub(super) size: (u32, u32),
    /// Every pixel of the image that was asked for, without loss.
    pub(super) exact: bool,
    /// Time of the render and of the compression, microseconds.
    pub(super) micros: u32,
    /// Nearest and farthest depth that an image of depths shows, world units.
    pub(super) depths: [f32; 2],
    /// The last image has the label of each pixel.
    pub(super) mapped: bool,
    pub(super) pictures: Vec<Vec<u8>>,
}

impl Frame {
    /// Bytes of the header.
    pub(super) const HEADER_BYTES: usize = 36;

    pub(super) fn encode(&self) -> Vec<u8> {
        let mut bytes =
            Vec::with_capacity(Self::HEADER_BYTES + self.pictures.iter().map(|p| p.len() + 4).sum::<usize>());
        let count = self.pictures.len() as u32;
        let flags = count << 2 | u32::from(self.mapped) << 1 | u32::from(self.exact);
        let [near, far] = self.depths.map(f32::to_bits);
        for word in [1, self.seq, self.step, self.size.0, self.size.1, self.micros, flags, near, far] {
            bytes.extend_from_slice(&word.to_le_bytes());
        }
        for picture in &self.pictures {
            bytes.extend_from_slice(&(picture.len() as u32).to_le_bytes());
            bytes.extend_from_slice(picture);
        }
        bytes
    }
}
