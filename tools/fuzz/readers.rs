//! For each target: the other files of its folder, the reader, and checks of its result.

use super::seeds;
use labelgs::cli::commands::profile::compare::{Profile, compare};
use labelgs::eval::lpips::weights::read_tensors;
use labelgs::files::{LabelTable, image};
use labelgs::masks::{Format, ImportOptions, import, mask};
use labelgs::records::OcclusionTable;
use labelgs::records::checkpoint::Checkpoint;
use labelgs::scene::{Camera, Dataset, Gaussians, Photo};
use labelgs::scenes::{self, DepthFolder, Frames, LoadOptions, camera_json, points};
use labelgs::{Result, formats};
use std::path::Path;

pub fn put(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, bytes).expect("a file");
}

pub fn colmap_bin(folder: &Path) {
    put(folder, "sparse/0/cameras.bin", &seeds::colmap_cameras_bin()[0]);
    put(folder, "sparse/0/images.bin", seeds::colmap_images_bin());
    put(folder, "sparse/0/points3D.bin", seeds::colmap_points_bin());
}

pub fn colmap_txt(folder: &Path) {
    put(folder, "sparse/0/cameras.txt", &seeds::colmap_cameras_txt()[0]);
    put(folder, "sparse/0/images.txt", seeds::colmap_images_txt());
    put(folder, "sparse/0/points3D.txt", seeds::colmap_points_txt());
}

pub fn transforms(folder: &Path) {
    put(folder, "images/00.png", &seeds::photo_png()[0]);
    put(folder, "points.ply", &seeds::ply_cloud()[0]);
}

pub fn masks(folder: &Path) {
    colmap_bin(folder);
    put(folder, "in/pred.json", seeds::pred_json());
}

pub fn pred_masks(folder: &Path) {
    colmap_bin(folder);
    put(folder, "in/00.png", &seeds::mask_rgb()[0]);
}

pub fn sam_pictures(folder: &Path) {
    colmap_bin(folder);
    (0..3).for_each(|mask| put(folder, &format!("in/00/{mask}.png"), &seeds::mask_binary()[0]));
}

pub fn open(folder: &Path) -> Result<Dataset> {
    scenes::open(folder, &LoadOptions { photos: false, test_every: None, ..LoadOptions::default() })
}

/// Reads a scene and its initial Gaussians.
pub fn scene(folder: &Path, _: &Path) -> Result<()> {
    let dataset = open(folder)?;
    dataset.train.iter().for_each(|view| sound_camera(&view.camera));
    assert!(dataset.points.iter().all(|point| point.position.as_vec3().is_finite()), "a point that is no f32");
    assert!(dataset.extent() > 0.0 && (dataset.extent() as f32).is_finite(), "the extent is {}", dataset.extent());
    if dataset.train.len() <= 8 {
        sound_model(&scenes::initial_gaussians(&dataset, 1, 8)?);
    }
    Ok(())
}

/// Returns numbers to pass to a device.
pub fn sound_camera(camera: &Camera) {
    let Camera { fx, fy, cx, cy, width, height, .. } = *camera;
    assert!(width > 0 && height > 0, "{camera:?}");
    assert!([fx, fy].iter().all(|&f| (f as f32).is_finite() && f as f32 > 0.0), "{camera:?}");
    assert!([cx, cy].iter().all(|&c| (c as f32).is_finite()), "{camera:?}");
    assert!(camera.translation.as_vec3().is_finite() && camera.centre().as_vec3().is_finite(), "{camera:?}");
    let rows = camera.rotation.transpose();
    let lengths = [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.length());
    assert!(lengths.iter().all(|length| (length - 1.0).abs() < 1e-6), "{camera:?}");
    assert!((camera.rotation.determinant() - 1.0).abs() < 1e-6, "{camera:?}");
}

pub fn sound_model(model: &Gaussians) {
    let (count, rest) = (model.len(), model.rest_per_gaussian());
    let lengths = [model.quats.len(), model.scales.len(), model.opacities.len(), model.sh0.len()];
    assert!(lengths.iter().all(|&length| length == count), "{lengths:?} of {count}");
    assert_eq!(model.sh_rest.len(), count * rest);
    assert!(model.labels.as_ref().is_none_or(|labels| labels.len() == count), "labels");
    assert!(model.label_confidence.as_ref().is_none_or(|shares| shares.len() == count), "shares");
    let triples = model.means.iter().chain(&model.scales).chain(&model.sh0).chain(&model.sh_rest).flatten();
    let all = triples.chain(model.quats.iter().flatten()).chain(&model.opacities);
    assert!(all.into_iter().all(|value| value.is_finite()), "a value that is not finite");
}

/// Reads a model of any format, and checks that it survives writing and reading as a PLY.
pub fn model(folder: &Path, file: &Path) -> Result<()> {
    let read = formats::read_model(file)?;
    sound_model(&read.gaussians);
    let again = folder.join("again.ply");
    assert_eq!(formats::write_model(&again, &read.gaussians).expect("written"), 0);
    assert_eq!(formats::read_model(&again).expect("what was written").gaussians, read.gaussians);
    Ok(())
}

pub fn ply_cloud(_: &Path, file: &Path) -> Result<()> {
    let points = points::read_points(file)?;
    assert!(points.iter().all(|point| point.position.as_vec3().is_finite()), "a point that is no f32");
    Ok(())
}

pub fn id_mask(_: &Path, file: &Path) -> Result<()> {
    let map = mask::read_mask(file)?;
    assert_eq!(map.ids.len(), map.width as usize * map.height as usize);
    Ok(())
}

pub fn mask_rgb(folder: &Path, _: &Path) -> Result<()> {
    imported(folder, Format::DevaLong)
}

/// Masks of a scene with one changed image.
pub fn imported(folder: &Path, format: Format) -> Result<()> {
    let dataset = open(folder)?;
    let out = folder.join("out");
    let options = ImportOptions { folder: folder.join("in"), format, ..ImportOptions::default() };
    let answer = import(&dataset, &options, &out).map(|_| ());
    if out.exists() {
        std::fs::remove_dir_all(&out).expect("removed");
    }
    answer
}

pub fn depth(folder: &Path, _: &Path) -> Result<()> {
    let dataset = open(folder)?;
    let map = DepthFolder::open(&folder.join("depths"), folder, &labelgs::scenes::Lookup::default())?
        .read(&dataset.train[0])?;
    assert_eq!(map.values.len(), map.width as usize * map.height as usize);
    Ok(())
}

pub fn photo(_: &Path, file: &Path) -> Result<()> {
    let sound = |photo: &Photo| assert_eq!(photo.rgba.len(), photo.width as usize * photo.height as usize);
    let size = image::photo_size(file)?;
    let read = image::read_photo(file, [0.5; 3])?;
    sound(&read);
    assert_eq!((read.width, read.height), size);
    assert!(read.rgba.iter().all(|texel| texel[3] == 255), "transparency is blended");
    sound(&image::read_rgba(file)?);
    let (width, height, values) = image::read_grey(file)?;
    assert_eq!(values.len(), width as usize * height as usize);
    Ok(())
}

pub fn checkpoint(_: &Path, file: &Path) -> Result<()> {
    Checkpoint::read(file)?;
    labelgs::train::state::TrainState::read(file).map(|_| ())
}

pub fn config(_: &Path, file: &Path) -> Result<()> {
    labelgs::run::Settings::read(file)?.check()
}

pub fn camera(_: &Path, file: &Path) -> Result<()> {
    sound_camera(&camera_json::read_camera(file)?);
    Ok(())
}

pub fn labels(folder: &Path, file: &Path) -> Result<()> {
    let table = LabelTable::read(file)?;
    let again = folder.join("again.json");
    table.write(&again).expect("written");
    assert_eq!(LabelTable::read(&again).expect("what was written"), table);
    Ok(())
}

pub fn occlusion(_: &Path, file: &Path) -> Result<()> {
    OcclusionTable::read(file).map(|_| ())
}

pub fn profile(_: &Path, file: &Path) -> Result<()> {
    let profile = Profile::read(file)?;
    assert!(!profile.samples.is_empty(), "a profile without a step");
    // Compared with itself and with another profile.
    compare(&profile.samples, &profile.samples, 0.05).iter().for_each(|row| assert!(!row.regressed, "{row:?}"));
    Ok(())
}

/// Two small tensors, because the weights of VGG16 are too large for a seed.
pub fn weights(_: &Path, file: &Path) -> Result<()> {
    let wanted = [("features.0.bias".into(), vec![4]), ("lin0.model.1.weight".into(), vec![1, 2, 1, 1])];
    let read = read_tensors(file, &wanted)?;
    assert_eq!(read.iter().map(Vec::len).collect::<Vec<_>>(), [4, 2]);
    assert!(read.iter().flatten().all(|value| value.is_finite()), "a value that is not finite");
    Ok(())
}

pub fn frames(_: &Path, file: &Path) -> Result<()> {
    Frames::read(file).map(|_| ())
}
