//! The messages between page and server. The page sends JSON; the server answers with JSON and with frames.
//!
//! A frame is a header of little-endian numbers and its pictures, each after its length: what a browser decodes by
//! itself, PNG or JPEG.

use super::finder::News;
use crate::scenes::camera_json::CameraFile;
use serde::Deserialize;
use std::sync::Arc;

/// Largest message of a page, bytes.
pub(super) const BYTES_MAX: usize = 256 << 10;
/// Most messages of a page per second, with a reserve of as many.
pub(super) const RATE_MAX: f64 = 240.0;
/// Most pixels of a picture.
pub(super) const PIXELS_MAX: u64 = 8 << 20;
/// Longest name of a label, bytes.
const NAME_MAX: usize = 200;

/// What a picture shows.
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
pub(super) struct Look {
    /// Number of the request, for the answer.
    pub(super) seq: u32,
    pub(super) from: Viewpoint,
    /// One or two pictures.
    pub(super) panes: Vec<Pane>,
    /// Labels to draw an outline around.
    #[serde(default)]
    pub(super) mark: Vec<u32>,
    /// The camera moves: the picture may be smaller than the camera says.
    pub(super) moving: bool,
}

/// A change of the labels, as a command of the command line would make it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "edit", rename_all = "lowercase", deny_unknown_fields)]
pub enum Edit {
    /// Names a label.
    Rename {
        /// The label.
        label: u32,
        /// Its name.
        name: String,
    },
    /// Makes several labels one, with the smallest id.
    Merge {
        /// The labels.
        labels: Vec<u32>,
    },
    /// Mixes a colour into the Gaussians.
    Recolour {
        /// The labels.
        labels: Vec<u32>,
        /// r, g, b, 0 to 1.
        colour: [f32; 3],
        /// Share of the new colour, 0 to 1.
        mix: f32,
    },
    /// Removes the Gaussians.
    Remove {
        /// The labels.
        labels: Vec<u32>,
    },
    /// Gives an object that was found a label.
    #[serde(skip)]
    Label {
        /// Which Gaussians it is.
        rows: Arc<[bool]>,
        /// Its name, if any.
        name: Option<String>,
        /// What was pointed at: flags of `labelgs label`, and what follows them.
        flags: Vec<(&'static str, String)>,
    },
    /// Writes the Gaussians as a model of their own; the shown model stays.
    Export {
        /// The labels.
        labels: Vec<u32>,
    },
}

impl Edit {
    /// Returns what is wrong with the values, if anything.
    pub(super) fn problem(&self) -> Option<String> {
        match self {
            Self::Rename { name, .. } | Self::Label { name: Some(name), .. } => name_problem(name),
            Self::Recolour { colour, mix, .. }
                if !colour.iter().chain([mix]).all(|value| (0.0..=1.0).contains(value)) =>
            {
                Some("colour and share are from 0 to 1".to_owned())
            }
            Self::Merge { labels } if labels.len() < 2 => Some("choose at least two labels to merge".to_owned()),
            _ => None,
        }
    }
}

fn name_problem(name: &str) -> Option<String> {
    if name.trim().is_empty() {
        Some("a name has at least one letter".to_owned())
    } else if name.len() > NAME_MAX {
        Some(format!("a name has at most {NAME_MAX} bytes"))
    } else if name.contains(char::is_control) {
        Some("a name is one line of text without control characters".to_owned())
    } else {
        None
    }
}

/// What a page asks of the object that it points at.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "object", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum Find {
    /// It is at a pixel, or that does not belong to it.
    Click {
        /// Camera of the full picture.
        from: Viewpoint,
        /// Column and row.
        pixel: [u32; 2],
        /// On the object.
        on: bool,
    },
    /// It is in a box.
    Box {
        /// Camera of the full picture.
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

/// What a page can ask of a training.
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
    Look(Look),
    /// A frame was drawn.
    Ack {
        /// Number of the request.
        seq: u32,
    },
    /// What is at a pixel?
    Pick {
        /// Number, for the answer.
        seq: u32,
        /// Camera of the full picture.
        from: Viewpoint,
        /// Column and row.
        pixel: [u32; 2],
    },
    /// Which labels are drawn: all but the hidden ones, or only some.
    Show {
        /// Labels that are not drawn.
        hidden: Vec<u32>,
        /// Labels that are drawn alone; empty: no such choice.
        solo: Vec<u32>,
    },
    /// Changes labels.
    Edit {
        /// The change.
        what: Edit,
    },
    /// Points at an object, or says what becomes of it.
    Object {
        /// What.
        what: Find,
    },
    /// News of that object, from the thread that looks for it.
    #[serde(skip)]
    News {
        /// Number of its task.
        number: u64,
        /// What.
        news: News,
    },
    /// Takes back the last change.
    Undo,
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
    /// Size of the pictures, px.
    pub(super) size: (u32, u32),
    /// The pixels of `render`, in full size.
    pub(super) exact: bool,
    /// Time of the render and of the compression, microseconds.
    pub(super) micros: u32,
    /// The last picture is an outline, to be drawn over the others.
    pub(super) marked: bool,
    pub(super) pictures: Vec<Vec<u8>>,
}

impl Frame {
    /// Bytes of the header.
    pub(super) const HEADER: usize = 28;

    pub(super) fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(Self::HEADER + self.pictures.iter().map(|p| p.len() + 4).sum::<usize>());
        let count = self.pictures.len() as u32;
        let flags = count << 2 | u32::from(self.marked) << 1 | u32::from(self.exact);
        for word in [1, self.seq, self.step, self.size.0, self.size.1, self.micros, flags] {
            bytes.extend_from_slice(&word.to_le_bytes());
        }
        for picture in &self.pictures {
            bytes.extend_from_slice(&(picture.len() as u32).to_le_bytes());
            bytes.extend_from_slice(picture);
        }
        bytes
    }
}
