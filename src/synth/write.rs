//! The files of a synthetic scene: COLMAP model, photos, masks with names, isolated objects, depth.

use super::cameras::cameras;
use super::object::Object;
use super::points::{self, ObservedPoint};
use super::trace::{TracedView, involved, repaint, trace_isolated, trace_photo, trace_view};
use super::world::World;
use super::{SynthLens, SynthOptions, exposure, lens, turntable, view_name};
use glam::DQuat;
use labelgs_files::label_table::{self, LabelEntry, LabelTable};
use labelgs_files::{atomic, image};
use labelgs_scene::{Camera, Error, Result, Setting};
use labelgs_scenes::ReadOptions;
use labelgs_scenes::lens::Optics;
use rayon::prelude::*;
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

/// The result of [`write()`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Folder of the scene.
    pub scene: PathBuf,
    /// Number of views.
    pub views: u32,
    /// Number of points.
    pub points: usize,
    /// The objects, with their numbers of pixels and views.
    pub objects: Vec<LabelEntry>,
}

/// Creates a scene in `folder`, which must be empty or new. `after_view` receives the number of finished views; its
/// error stops the work.
pub fn write(options: &SynthOptions, folder: &Path, after_view: &dyn Fn(u32) -> Result<()>) -> Result<Summary> {
    if options.width == 0 || options.height == 0 || options.width > 16_384 || options.height > 16_384 {
        return Err(Error::usage("width, height", "need 1 to 16384 px each"));
    }
    if options.views == 0 || options.views > 10_000 {
        return Err(Error::usage(Setting("views"), "needs 1 to 10000"));
    }
    let world = World::new(options.preset, options.seed);
    lens::check(options)?;
    let optics: Vec<Optics> = cameras(options).iter().map(|camera| lens::mounted(options, camera)).collect();
    create_folders(folder, &world, optics.iter().all(|optics| optics.lens.is_pinhole()))?;
    let entry = |object: &Object| LabelEntry { name: Some(object.name.into()), ..LabelEntry::new(object.id.into()) };
    let mut table = LabelTable::new(world.objects.iter().map(entry).collect());
    let seen = points::sample(&world, &optics, options);
    write_colmap(folder, options.lens, &optics, &seen)?;
    for (index, optics) in optics.iter().enumerate() {
        let camera = &optics.camera;
        if optics.lens.is_pinhole() {
            let (world, camera) = turntable::staged(options, &world, camera, index as u32);
            let (world, camera) = (&*world, &*camera);
            let made = trace_view(world, camera, index as u32);
            let rgb = exposure::exposed(options, index as u32, made.rgb.clone());
            write_photo(folder, index, camera, &rgb, &made.ids)?;
            write_truth(folder, index, world, camera, &made)?;
            if index.is_multiple_of(ReadOptions::default().test_every as usize) {
                write_without(folder, index, world, camera, &made.rgb)?;
            }
            count(&mut table, &made.ids);
        } else {
            // The other images are compared with renders, which use pinhole cameras.
            let (world, staged) = turntable::staged(options, &world, camera, index as u32);
            let (rgb, ids) = trace_photo(&world, &Optics::new(staged.into_owned(), optics.lens), index as u32);
            write_photo(folder, index, camera, &exposure::exposed(options, index as u32, rgb), &ids)?;
            count(&mut table, &ids);
        }
        after_view(index as u32 + 1)?;
    }
    table.write(&folder.join("masks").join(label_table::FILE_NAME))?;
    Ok(Summary { scene: folder.to_owned(), views: options.views, points: seen.len(), objects: table.labels })
}

fn count(table: &mut LabelTable, ids: &[u8]) {
    for entry in &mut table.labels {
        let pixels = ids.iter().filter(|&&id| u32::from(id) == entry.id).count() as u64;
        entry.pixels += pixels;
        entry.views += u32::from(pixels > 0);
    }
}

fn create_folders(folder: &Path, world: &World, with_truth: bool) -> Result<()> {
    atomic::require_empty("DIR", folder)?;
    let of_objects = ["amodal", "objects", "without", "shadowed"]
        .map(|kind| world.objects.iter().map(move |object| format!("{kind}/{}", object.id)));
    let truth = of_objects.into_iter().flatten().chain(["depth".to_owned()]).filter(|_| with_truth);
    for name in ["images", "sparse/0", "masks"].map(str::to_owned).into_iter().chain(truth) {
        let path = folder.join(name);
        fs::create_dir_all(&path).map_err(Error::write(&path))?;
    }
    Ok(())
}

fn write_photo(folder: &Path, index: usize, camera: &Camera, rgb: &[[u8; 3]], ids: &[u8]) -> Result<()> {
    let name = view_name(index);
    image::write_png_rgb8(folder.join("images").join(&name), camera.width, camera.height, rgb)?;
    image::write_png_grey8(folder.join("masks").join(&name), camera.width, camera.height, ids)
}

fn write_truth(folder: &Path, index: usize, world: &World, camera: &Camera, made: &TracedView) -> Result<()> {
    let name = view_name(index);
    let (width, height) = (made.width, made.height);
    world.objects.par_iter().zip(&made.whole).enumerate().try_for_each(|(place, (object, whole))| {
        let path = folder.join("amodal").join(object.id.to_string()).join(&name);
        let bytes: Vec<u8> = whole.iter().map(|&covered| if covered { 255 } else { 0 }).collect();
        image::write_png_grey8(&path, width, height, &bytes)?;
        let path = folder.join("objects").join(object.id.to_string()).join(&name);
        image::write_png_rgba8(&path, width, height, &trace_isolated(world, camera, index as u32, place))
    })?;
    image::write_exr_y(folder.join("depth").join(format!("{index:03}.exr")), width, height, &made.depth)
}

/// Writes the photo of the view in the world without each object: `without/ID/OBJECT_NAME.png`, and
/// `shadowed/ID/OBJECT_NAME.png` with its shadow. Only views that are held out by default have these, because removals
/// are scored there.
fn write_without(folder: &Path, index: usize, world: &World, camera: &Camera, photo: &[[u8; 3]]) -> Result<()> {
    let involved = involved(world, camera, index as u32);
    world.objects.par_iter().zip(&involved).try_for_each(|(object, pixels)| {
        for (kind, shadow) in [("without", false), ("shadowed", true)] {
            let path = folder.join(kind).join(object.id.to_string()).join(view_name(index));
            let mut rgb = photo.to_vec();
            repaint(&world.without(object.id, shadow), camera, index as u32, &mut rgb, pixels);
            image::write_png_rgb8(&path, camera.width, camera.height, &rgb)?;
        }
        Ok(())
    })
}

fn save(path: &Path, bytes: &[u8]) -> Result<()> {
    atomic::write(path, |out| out.write_all(bytes))
}

/// Writes `cameras.bin`, `images.bin` and `points3D.bin`, little-endian as in COLMAP.
fn write_colmap(folder: &Path, lens: SynthLens, optics: &[Optics], seen: &[ObservedPoint]) -> Result<()> {
    let folder = folder.join("sparse/0");
    let cameras: Vec<&Camera> = optics.iter().map(|optics| &optics.camera).collect();
    if let Some(camera) = cameras.first() {
        let mut bytes = Vec::new();
        bytes.extend(1_u64.to_le_bytes());
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(lens.number().to_le_bytes());
        bytes.extend(u64::from(camera.width).to_le_bytes());
        bytes.extend(u64::from(camera.height).to_le_bytes());
        lens.parameters(camera).iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        save(&folder.join("cameras.bin"), &bytes)?;
    }
    let mut observed: Vec<Vec<(f64, f64, u64)>> = vec![Vec::new(); cameras.len()];
    let mut points = Vec::new();
    points.extend((seen.len() as u64).to_le_bytes());
    for (index, seen) in seen.iter().enumerate() {
        let id = index as u64 + 1;
        points.extend(id.to_le_bytes());
        seen.point.position.to_array().iter().for_each(|value| points.extend(value.to_le_bytes()));
        points.extend(seen.point.colour);
        // Mean reprojection error, px.
        points.extend(0.5_f64.to_le_bytes());
        points.extend((seen.track.len() as u64).to_le_bytes());
        for &(view, place) in &seen.track {
            let list = &mut observed[view as usize];
            points.extend((view + 1).to_le_bytes());
            points.extend((list.len() as u32).to_le_bytes());
            list.push((place.x, place.y, id));
        }
    }
    save(&folder.join("points3D.bin"), &points)?;
    save(&folder.join("images.bin"), &images_bin(&cameras, &observed))
}

fn images_bin(cameras: &[&Camera], observed: &[Vec<(f64, f64, u64)>]) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend((cameras.len() as u64).to_le_bytes());
    for (index, (camera, observed)) in cameras.iter().zip(observed).enumerate() {
        let q = DQuat::from_mat3(&camera.rotation);
        bytes.extend((index as u32 + 1).to_le_bytes());
        [q.w, q.x, q.y, q.z].iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        camera.translation.to_array().iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(view_name(index).as_bytes());
        bytes.push(0);
        bytes.extend((observed.len() as u64).to_le_bytes());
        for &(x, y, point) in observed {
            bytes.extend(x.to_le_bytes());
            bytes.extend(y.to_le_bytes());
            bytes.extend(point.to_le_bytes());
        }
    }
    bytes
}
