//! The pinhole views of a photo: the photo itself, undistorted, or faces of a cube around its camera.

use super::lens::{Lens, Optics};
use super::lookup::Lookup;
use super::photo_recipe::at_photo_size;
use glam::{DMat3, DVec2, DVec3};
use labelgs_scene::{Camera, LabelMap, Result};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// A photo with a larger field of view, radians, becomes several views. At 110 degrees, a pinhole image stretches its
/// border three times as much as its centre.
const ONE_VIEW_ANGLE_MAX: f64 = 110.0 / 180.0 * std::f64::consts::PI;
/// A polynomial keeps its own intrinsics, like other programs that undistort, if they show at least this share of the
/// fitted field of view.
const OWN_VIEW_SHARE_MIN: f64 = 0.9;
/// Most pixels of a view, relative to the photo.
const PIXEL_RATIO_MAX: f64 = 2.0;
/// Cells along a side of a face in the search for its covered part.
const CELLS_PER_SIDE: u32 = 64;
/// A face is omitted if the photo covers less than this share of it.
const COVERED_SHARE_MIN: f64 = 0.02;

/// The faces: name, and the axes of the view (right, down, forward) in the photo's axes.
const CUBE_FACES: [(&str, [DVec3; 3]); 6] = [
    ("front", [DVec3::X, DVec3::Y, DVec3::Z]),
    ("right", [DVec3::NEG_Z, DVec3::Y, DVec3::X]),
    ("back", [DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z]),
    ("left", [DVec3::Z, DVec3::Y, DVec3::NEG_X]),
    ("up", [DVec3::X, DVec3::Z, DVec3::NEG_Y]),
    ("down", [DVec3::X, DVec3::NEG_Z, DVec3::Y]),
];

/// A pinhole view of a photo.
#[derive(Clone, Debug)]
pub struct Window {
    /// Name of the view: the photo's name, or with the face before the extension (`00.left.jpg`).
    pub name: String,
    /// Name of the photo.
    pub photo: String,
    /// The photo's camera at the size of its file, with its lens.
    pub optics: Optics,
    /// Camera of the view at full size.
    pub camera: Camera,
    /// Rotation from the view's axes to the photo's.
    turn: DMat3,
}

impl Window {
    /// Returns the view that shows the stored photo unchanged, whatever its lens.
    pub fn stored(name: &str, camera: &Camera) -> Self {
        Self::whole(name, &Optics::new(camera.clone(), Lens::Pinhole), camera.clone())
    }

    fn whole(name: &str, optics: &Optics, camera: Camera) -> Self {
        let name = name.to_owned();
        Self { photo: name.clone(), name, optics: optics.clone(), camera, turn: DMat3::IDENTITY }
    }

    /// Returns the views of a photo, whose camera has the size of its file.
    ///
    /// A lens up to `ONE_VIEW_ANGLE_MAX` becomes a single view with the scale at the photo's centre and the field of
    /// view between the centres of its edges. A polynomial keeps focal lengths, principal point and size if these show
    /// at least `OWN_VIEW_SHARE_MIN` of that field of view. Wider lenses and panoramas become cube faces of 90 degrees
    /// at that scale, without parts that the photo does not cover.
    pub fn all(name: &str, camera: &Camera, lens: &Lens) -> Vec<Self> {
        let optics = Optics::new(camera.clone(), *lens);
        if *lens == Lens::Pinhole {
            return vec![Self::whole(name, &optics, camera.clone())];
        }
        let edges = edges(&optics);
        if 2.0 * edges.into_iter().fold(0.0, f64::max) < ONE_VIEW_ANGLE_MAX {
            let fitted = fitted(&optics, edges);
            let keeps = matches!(lens, Lens::Polynomial(_))
                && plane_size(camera).cmpge(OWN_VIEW_SHARE_MIN * plane_size(&fitted)).all();
            return vec![Self::whole(name, &optics, if keeps { camera.clone() } else { fitted })];
        }
        CUBE_FACES.iter().filter_map(|&(face, axes)| Self::face(name, &optics, face, axes)).collect()
    }

    /// Returns true if the view has the pixels of the photo.
    pub fn is_photo(&self) -> bool {
        self.optics.lens.is_pinhole()
    }

    /// Returns the position in the photo of a position in the view, px; `None` outside the photo.
    pub fn source(&self, pixel: DVec2) -> Option<DVec2> {
        if self.is_photo() {
            return Some(pixel);
        }
        self.optics.pixel(self.turn * self.camera.ray(pixel)).filter(|&at| self.optics.holds(at))
    }

    /// Returns the position in the view of a direction in the photo's axes, px; `None` outside the view.
    fn target(&self, direction: DVec3) -> Option<DVec2> {
        let own = self.turn.transpose() * direction;
        let at = self.camera.project(own);
        let size = DVec2::new(f64::from(self.camera.width), f64::from(self.camera.height));
        (own.z > 0.0 && at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all()).then_some(at)
    }

    fn face(name: &str, optics: &Optics, face: &str, axes: [DVec3; 3]) -> Option<Self> {
        let scale = scale(optics);
        let pixels = PIXEL_RATIO_MAX * f64::from(optics.camera.width) * f64::from(optics.camera.height);
        // An even side puts the back of a panorama, where its borders meet, between two pixels.
        let half = (scale.x * scale.y).sqrt().min(pixels.sqrt() / 2.0).round().max(1.0);
        let turn = DMat3::from_cols(axes[0], axes[1], axes[2]);
        let photo = &optics.camera;
        let mut camera = Camera {
            rotation: turn.transpose() * photo.rotation,
            translation: turn.transpose() * photo.translation,
            fx: half,
            fy: half,
            cx: half,
            cy: half,
            width: 2 * half as u32,
            height: 2 * half as u32,
        };
        let mut view = Self {
            name: face_name(name, face),
            photo: name.to_owned(),
            optics: optics.clone(),
            camera: camera.clone(),
            turn,
        };
        let [left, top, right, bottom] = view.covered()?;
        (camera.cx, camera.cy) = (half - f64::from(left), half - f64::from(top));
        (camera.width, camera.height) = (right - left, bottom - top);
        view.camera = camera;
        Some(view)
    }

    /// Returns the part of a whole face that the photo covers, px: left, top, right and bottom. The part contains the
    /// centre of the face, because the principal point of a view must be inside its image.
    fn covered(&self) -> Option<[u32; 4]> {
        let (side, half) = (self.camera.width, self.camera.width / 2);
        let cell = f64::from(side) / f64::from(CELLS_PER_SIDE);
        let (mut box_, mut count) = ([half.saturating_sub(1), half.saturating_sub(1), half + 1, half + 1], 0);
        for (x, y) in (0..=CELLS_PER_SIDE).flat_map(|y| (0..=CELLS_PER_SIDE).map(move |x| (x, y))) {
            let at = DVec2::new(f64::from(x), f64::from(y)) * cell;
            if self.source(at).is_none() {
                continue;
            }
            count += 1;
            let (low, high) =
                ((at - cell).floor().max(DVec2::ZERO), (at + cell).ceil().min(DVec2::splat(f64::from(side))));
            box_ = [
                box_[0].min(low.x as u32),
                box_[1].min(low.y as u32),
                box_[2].max(high.x as u32),
                box_[3].max(high.y as u32),
            ];
        }
        (f64::from(count) >= COVERED_SHARE_MIN * f64::from((CELLS_PER_SIDE + 1).pow(2))).then_some(box_)
    }
}

/// Returns how the views of `scene` (as in [`super::open`]) map to their photos, by view name. Accepts photos anywhere
/// and omits unreadable ones, because they were checked when the scene was opened.
pub fn windows(scene: &Path, lookup: &Lookup) -> Result<BTreeMap<String, Window>> {
    let mut found = BTreeMap::new();
    for listed in super::list(scene, &Lookup { allow_outside: true, ..lookup.clone() })?.views {
        if let Ok(camera) = at_photo_size(&listed) {
            let views = Window::all(&listed.name, &camera, &listed.lens);
            found.extend(views.into_iter().map(|view| (view.name.clone(), view)));
        }
    }
    Ok(found)
}

/// Returns the ids of a photo, at its size, from the maps of its views, each of any scale; 0 where there is no view.
pub fn ids_of_photo(views: &[(&Window, &LabelMap)]) -> Option<LabelMap> {
    let &[(first, map), ..] = views else { return None };
    if first.is_photo() {
        return Some(map.clone());
    }
    let camera = &first.optics.camera;
    let (width, height) = (camera.width, camera.height);
    let id = |direction: DVec3| {
        let found = views.iter().find_map(|(view, map)| Some((view, map, view.target(direction)?)));
        found.map_or(0, |(view, map, at)| {
            let scale = |at: f64, side: u32, of: u32| ((at * f64::from(side) / f64::from(of)) as u32).min(side - 1);
            map.at(scale(at.x, map.width, view.camera.width), scale(at.y, map.height, view.camera.height))
        })
    };
    let pixel = |index: usize| first.optics.direction(camera.pixel_centre(index)).map_or(0, id);
    let ids = (0..width as usize * height as usize).into_par_iter().map(pixel).collect();
    Some(LabelMap { width, height, ids })
}

/// Returns the angles from the axis, radians, of the centres of the left, top, right and bottom edges.
fn edges(optics: &Optics) -> [f64; 4] {
    let Camera { cx, cy, width, height, .. } = optics.camera;
    let angle = |x: f64, y: f64| match optics.direction(DVec2::new(x, y)) {
        Some(direction) => direction.truncate().length().atan2(direction.z),
        // The lens ends before the edge.
        None => optics.reach(),
    };
    [angle(0.0, cy), angle(cx, 0.0), angle(f64::from(width), cy), angle(cx, f64::from(height))]
}

/// Returns the width and height of the image in the plane z = 1.
fn plane_size(camera: &Camera) -> DVec2 {
    DVec2::new(f64::from(camera.width) / camera.fx, f64::from(camera.height) / camera.fy)
}

/// Returns the px per radian at the axis, in x and y.
fn scale(optics: &Optics) -> DVec2 {
    const SMALL: f64 = 1e-4;
    let at = |x: f64, y: f64| optics.pixel(DVec3::new(x, y, 1.0)).unwrap_or(DVec2::NAN);
    let x = (at(SMALL, 0.0) - at(-SMALL, 0.0)).length() / (2.0 * SMALL);
    let y = (at(0.0, SMALL) - at(0.0, -SMALL)).length() / (2.0 * SMALL);
    DVec2::new(x, y)
}

/// Returns the pinhole camera whose view reaches the centres of the edges.
fn fitted(optics: &Optics, edges: [f64; 4]) -> Camera {
    let photo = &optics.camera;
    let tangents = edges.map(f64::tan);
    let size = DVec2::new(tangents[0] + tangents[2], tangents[1] + tangents[3]);
    let scale = scale(optics);
    let pixels = PIXEL_RATIO_MAX * f64::from(photo.width) * f64::from(photo.height);
    let scale = scale * (pixels / (size * scale).element_product()).sqrt().min(1.0);
    let side = |side: f64| (side.round() as u32).max(1);
    let (width, height) = (side(size.x * scale.x), side(size.y * scale.y));
    Camera {
        fx: scale.x,
        fy: scale.y,
        // Rounding may make the image smaller than its left or upper part.
        cx: (scale.x * tangents[0]).min(f64::from(width)),
        cy: (scale.y * tangents[1]).min(f64::from(height)),
        width,
        height,
        ..photo.clone()
    }
}

fn face_name(photo: &str, face: &str) -> String {
    let path = Path::new(photo);
    let extension = path.extension().map(|extension| extension.to_string_lossy().into_owned());
    let name = path.with_extension(extension.map_or(face.to_owned(), |extension| format!("{face}.{extension}")));
    name.to_string_lossy().into_owned()
}
