//! Draws frames and answers picks, for a finished model and for one in training alike.

use super::finder::Spot;
use super::hub::{ClientId, Hub};
use super::message::{Frame, LookRequest, PIXELS_MAX, Pane, Viewpoint};
use super::pace::Pace;
use super::pictures::{self, PanelData};
use super::views::{SceneView, Score, Views};
use crate::error::{Error, Result};
use crate::files::resize::bounded_size;
use crate::render::pictures::depth_range;
use crate::render::{Parts, Render};
use crate::scene::{Camera, Pixels, View};
use crate::scenes::camera_json::camera_of;
use glam::{DVec2, DVec3};
use serde_json::json;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Time of a moving frame, s: on a GPU, and on a CPU.
const MOVING_FRAME_SECONDS: [f64; 2] = [0.04, 0.08];

/// Longest side of an image in which the surface is looked up, px.
pub(super) const SURFACE_SIDE_MAX: u32 = 1024;

/// A source of renders.
pub(super) trait Source {
    /// Renders the drawn model.
    fn render(&mut self, camera: &Camera, parts: Parts) -> Result<Render>;
    /// Confidence by row of the drawn model.
    fn confidence(&self) -> Option<&[f32]>;
    /// Returns the row of the whole model of a row of the drawn one.
    fn row(&self, drawn: usize) -> usize {
        drawn
    }
    /// Largest image, px, if there is a limit.
    fn largest(&mut self) -> Option<(u32, u32)>;
    /// Step of the training; 0 for a finished model.
    fn step(&self) -> u32;
}

/// The surface at a pixel.
pub(super) struct Surface {
    /// Camera of the full image.
    pub(super) camera: Camera,
    /// In the world.
    pub(super) place: DVec3,
    /// Along the axis of the camera, world units.
    pub(super) depth: f64,
    /// The main Gaussian.
    pub(super) row: usize,
}

/// Draws at a size that is fast enough while the camera moves.
pub(super) struct Painter {
    pub(super) views: Arc<Views>,
    pace: Pace,
    target: f64,
}

impl Painter {
    pub(super) fn new(views: Arc<Views>, is_cpu: bool) -> Self {
        Self { views, pace: Pace::default(), target: MOVING_FRAME_SECONDS[usize::from(is_cpu)] }
    }

    /// Draws and sends a frame. Only a broken device is an error; other problems are reported to the page.
    pub(super) fn look(&mut self, hub: &Hub, id: ClientId, look: &LookRequest, source: &mut dyn Source) -> Result<()> {
        let drawn = self.draw(hub, id, look, source);
        hub.finish(id, drawn.as_ref().ok());
        match drawn {
            Ok(_) => Ok(()),
            Err(error) => {
                hub.reply(id, &json!({ "kind": "lost", "seq": look.seq, "text": error.to_string() }));
                if is_fatal(&error) { Err(error) } else { Ok(()) }
            }
        }
    }

    fn draw(&mut self, hub: &Hub, id: ClientId, look: &LookRequest, source: &mut dyn Source) -> Result<Frame> {
        if look.panes.is_empty() || look.panes.len() > 2 {
            return Err(Error::usage("panes", "must be one or two"));
        }
        let start = Instant::now();
        let views = Arc::clone(&self.views);
        let (mut full, posed) = camera(&views, &look.from)?;
        if let Some([width, height]) = look.size {
            let pixels = u64::from(width) * u64::from(height);
            if pixels == 0 || pixels > PIXELS_MAX {
                return Err(Error::usage(
                    "size",
                    format!("{width} x {height} px is empty, or more than {PIXELS_MAX} pixels"),
                ));
            }
            full = full.resized(width, height);
        }
        let fits = fitting(&full, source.largest());
        let pixels = |size: (u32, u32)| f64::from(size.0) * f64::from(size.1);
        let scale = if look.moving { self.pace.scale(pixels(fits), self.target) } else { 1.0 };
        let side = |full: u32| ((f64::from(full) * scale).round() as u32).max(1);
        let size = (side(fits.0), side(fits.1));
        let is_full = size == (full.width, full.height);
        let camera = full.resized(size.0, size.1);
        let is_lossy = look.moving && hub.is_slow(id, pixels(size), self.target);
        let mut parts = pictures::parts(&look.panes);
        // Clicks on a still image are answered by the page.
        parts.labels |= !look.moving;
        let rendered = source.render(&camera, parts)?;
        let compares = look.panes.contains(&Pane::Error);
        let photo = posed.and_then(|posed| posed.photo.as_ref()).filter(|_| compares).map(Pixels::get).transpose()?;
        let beside = PanelData { confidence: source.confidence(), photo: photo.as_deref() };
        let encode = |&pane| pictures::encode(pane, &rendered, beside, is_lossy);
        let mut encoded = look.panes.iter().map(encode).collect::<Result<Vec<_>>>()?;
        if !look.moving {
            encoded.push(pictures::label_map(&rendered)?);
        }
        let time = start.elapsed();
        self.pace.note(pixels(size), time.as_secs_f64());
        Ok(Frame {
            seq: look.seq,
            step: source.step(),
            size,
            exact: is_full && !is_lossy,
            micros: u32::try_from(time.as_micros()).unwrap_or(u32::MAX),
            mapped: !look.moving,
            depths: depth_range(&rendered.depth),
            pictures: encoded,
        })
    }

    /// Reports the label of the label map and the main Gaussian at a pixel.
    pub(super) fn pick(
        &self,
        hub: &Hub,
        id: ClientId,
        ask: (u32, &Viewpoint, [u32; 2]),
        source: &mut dyn Source,
    ) -> Result<()> {
        let (seq, from, pixel) = ask;
        match self.describe_pixel(from, pixel, source) {
            Ok(mut found) => {
                found["kind"] = "picked".into();
                found["seq"] = seq.into();
                hub.reply(id, &found);
                Ok(())
            }
            Err(error) if is_fatal(&error) => Err(error),
            Err(error) => {
                hub.reply(id, &json!({ "kind": "problem", "text": error.to_string() }));
                Ok(())
            }
        }
    }

    fn describe_pixel(&self, from: &Viewpoint, pixel: [u32; 2], source: &mut dyn Source) -> Result<serde_json::Value> {
        let (camera, scale, rendered) = self.seen(from, Parts::ALL, None, source)?;
        let index = index_of(&camera, scale, pixel)?;
        let drawn = usize::try_from(rendered.top_id[index]).ok();
        let confidence = drawn.and_then(|row| source.confidence()?.get(row).copied());
        Ok(json!({
            "label": rendered.labels[index],
            "gaussian": drawn.map(|row| source.row(row)),
            "weight": rendered.top_weight[index],
            "depth": rendered.mean_depth()?[index],
            "opacity": rendered.alpha[index],
            "confidence": confidence,
        }))
    }

    /// Renders a full image, or a smaller one if memory or `longest` (px) require it. Returns its camera and its size
    /// as shares of the full size.
    pub(super) fn seen(
        &self,
        from: &Viewpoint,
        parts: Parts,
        longest: Option<u32>,
        source: &mut dyn Source,
    ) -> Result<(Camera, [f64; 2], Render)> {
        let (full, _) = camera(&self.views, from)?;
        let (width, height) = bounded_size(fitting(&full, source.largest()), longest);
        let scale = [f64::from(width) / f64::from(full.width), f64::from(height) / f64::from(full.height)];
        let small = full.resized(width, height);
        let rendered = source.render(&small, parts)?;
        Ok((small, scale, rendered))
    }

    /// Returns what is at a pixel of a full image. Nothing is an error.
    pub(super) fn surface(&self, from: &Viewpoint, pixel: [u32; 2], source: &mut dyn Source) -> Result<Surface> {
        let (small, scale, rendered) = self.seen(from, Parts { depth: true, ..Parts::MAIN }, None, source)?;
        let index = index_of(&small, scale, pixel)?;
        let none = || Error::usage("point", "there is no Gaussian here");
        let depth = f64::from(rendered.depth_at(index).ok_or_else(none)?);
        let row = source.row(usize::try_from(rendered.top_id[index]).map_err(|_| none())?);
        let place = small.unproject(small.pixel_centre(index), depth);
        let (full, _) = camera(&self.views, from)?;
        Ok(Surface { camera: full, place, depth, row })
    }

    /// Returns what is at pixels of a full image: in the photo of a view, or on the surface.
    pub(super) fn spot(&self, from: &Viewpoint, pixels: &[[u32; 2]], source: &mut dyn Source) -> Result<Spot> {
        let (full, posed) = camera(&self.views, from)?;
        if let Some(View { name, .. }) = posed.filter(|posed| posed.photo.is_some()) {
            let share = |[x, y]: &[u32; 2]| {
                [(f64::from(*x) + 0.5) / f64::from(full.width), (f64::from(*y) + 0.5) / f64::from(full.height)]
            };
            return Ok(Spot::Photo(name.clone(), pixels.iter().map(share).collect()));
        }
        let (small, scale, rendered) = self.seen(from, Parts::DEPTH, Some(SURFACE_SIDE_MAX), source)?;
        let (width, height) = small.size();
        let point = |[x, y]: &[u32; 2]| {
            let place = DVec2::new((f64::from(*x) + 0.5) * scale[0], (f64::from(*y) + 0.5) * scale[1]);
            let at = (place.y as u32).min(height - 1) * width + (place.x as u32).min(width - 1);
            rendered.depth_at(at as usize).map(|depth| small.unproject(place, f64::from(depth)))
        };
        let points: Vec<_> = pixels.iter().filter_map(point).collect();
        if points.is_empty() {
            return Err(Error::usage("point", "there is no Gaussian here"));
        }
        Ok(Spot::Surface(points, full.centre()))
    }

    pub(super) fn score(&self, index: usize, source: &mut dyn Source) -> Result<Score> {
        let posed: &SceneView = self.views.get(index)?;
        let parts = if posed.view.mask.is_some() { Parts::LABELS } else { Parts::COLOUR };
        Score::new(posed, &source.render(&posed.view.camera, parts)?)
    }
}

/// Returns the number of a pixel of a full image in a smaller one.
fn index_of(small: &Camera, scale: [f64; 2], pixel: [u32; 2]) -> Result<usize> {
    let along = |axis: usize| ((f64::from(pixel[axis]) + 0.5) * scale[axis]) as u32;
    let (x, y) = (along(0), along(1));
    if x >= small.width || y >= small.height {
        let problem = format!("{}, {} is outside of the image", pixel[0], pixel[1]);
        return Err(Error::usage("pixel", problem));
    }
    Ok(y as usize * small.width as usize + x as usize)
}

/// Returns the camera of a full image, and its view.
fn camera<'a>(views: &'a Views, from: &Viewpoint) -> Result<(Camera, Option<&'a View>)> {
    match from {
        Viewpoint::View(index) => {
            let view = &views.get(*index)?.view;
            Ok((view.camera.clone(), Some(view)))
        }
        Viewpoint::Camera(file) => {
            let camera = camera_of(Path::new("camera"), file)?;
            let pixels = u64::from(camera.width) * u64::from(camera.height);
            if pixels > PIXELS_MAX {
                let problem =
                    format!("{} x {} px is too large; the maximum is {PIXELS_MAX} pixels", camera.width, camera.height);
                return Err(Error::usage("camera", problem));
            }
            Ok((camera, None))
        }
    }
}
/// Returns true if nothing can be drawn any more.
fn is_fatal(error: &Error) -> bool {
    error.is_device_lost() || matches!(error, Error::Interrupted)
}

/// Returns the size of a camera's image, smaller if it is larger than `largest` or has too many pixels.
fn fitting(camera: &Camera, largest: Option<(u32, u32)>) -> (u32, u32) {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let (most_wide, most_high) = largest.map_or((width, height), |(w, h)| (f64::from(w), f64::from(h)));
    let by_pixels = (PIXELS_MAX as f64 / (width * height)).sqrt();
    let scale = (most_wide / width).min(most_high / height).min(by_pixels).min(1.0);
    let side = |full: f64| ((full * scale).floor() as u32).max(1);
    if scale == 1.0 { (camera.width, camera.height) } else { (side(width), side(height)) }
}
