//! Small scenes in temporary folders.

use labelgs_scene::Error;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A temporary folder that is removed with the value.
pub struct Scene {
    folder: TempDir,
}

/// A camera of a COLMAP model: model number, name, size, parameters.
#[derive(Clone)]
pub struct ColmapCamera {
    pub model: u32,
    pub name: &'static str,
    pub size: (u64, u64),
    pub parameters: Vec<f64>,
}

pub fn pinhole() -> ColmapCamera {
    ColmapCamera { model: 1, name: "PINHOLE", size: (12, 8), parameters: vec![10.0, 11.0, 5.5, 4.5] }
}

/// Pose of image `index` in the fixtures.
pub fn pose(index: usize) -> ([f64; 4], [f64; 3]) {
    ([0.9, 0.1 * index as f64, -0.2, 0.3], [index as f64, 0.5, 4.0])
}

pub const POINTS: [([f64; 3], [u8; 3]); 2] = [([1.0, 2.0, 3.0], [10, 20, 30]), ([-1.5, 0.25, 7.0], [255, 0, 128])];

impl Scene {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a temporary folder") }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn at(&self, name: &str) -> PathBuf {
        let path = self.path().join(name);
        fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        path
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.at(name);
        fs::write(&path, bytes).expect("a written file");
        path
    }

    /// A photo whose colour depends on the pixel.
    pub fn photo(&self, name: &str, width: u32, height: u32) {
        let texel = |x: u32, y: u32| image::Rgb([(x * 7 % 256) as u8, (y * 11 % 256) as u8, ((x + y) * 3 % 256) as u8]);
        image::RgbImage::from_fn(width, height, texel)
            .save_with_format(self.at(name), image::ImageFormat::Png)
            .expect("a photo");
    }

    pub fn colmap_bin(&self, folder: &str, cameras: &[ColmapCamera], names: &[&str]) {
        let mut out = (cameras.len() as u64).to_le_bytes().to_vec();
        for (index, camera) in cameras.iter().enumerate() {
            out.extend((index as u32 + 1).to_le_bytes());
            out.extend(camera.model.to_le_bytes());
            out.extend(camera.size.0.to_le_bytes());
            out.extend(camera.size.1.to_le_bytes());
            camera.parameters.iter().for_each(|p| out.extend(p.to_le_bytes()));
        }
        self.write(&format!("{folder}/cameras.bin"), out);
        self.write(&format!("{folder}/images.bin"), images_bin(names, cameras.len()));
        let mut out = (POINTS.len() as u64).to_le_bytes().to_vec();
        for (id, (position, colour)) in POINTS.iter().enumerate() {
            out.extend((id as u64 + 7).to_le_bytes());
            position.iter().for_each(|v| out.extend(v.to_le_bytes()));
            out.extend(colour);
            out.extend(0.5f64.to_le_bytes());
            out.extend(2u64.to_le_bytes());
            (0..4u32).for_each(|v| out.extend(v.to_le_bytes()));
        }
        self.write(&format!("{folder}/points3D.bin"), out);
    }

    pub fn colmap_txt(&self, folder: &str, cameras: &[ColmapCamera], names: &[&str]) {
        let mut text = String::from("# Camera list\n# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
        for (index, camera) in cameras.iter().enumerate() {
            let parameters: Vec<String> = camera.parameters.iter().map(f64::to_string).collect();
            let (w, h) = camera.size;
            text += &format!("{} {} {w} {h} {}\n", index + 1, camera.name, parameters.join(" "));
        }
        self.write(&format!("{folder}/cameras.txt"), text);
        let mut text = String::from("# Image list\n");
        for (index, name) in names.iter().enumerate() {
            let ([w, x, y, z], [a, b, c]) = pose(index);
            let camera = index % cameras.len() + 1;
            let observations = if index % 2 == 0 { "" } else { "1.5 2.5 -1 3.0 4.0 7" };
            text += &format!("{} {w} {x} {y} {z} {a} {b} {c} {camera} {name}\n{observations}\n", index + 1);
        }
        self.write(&format!("{folder}/images.txt"), text);
        let mut text = String::from("# 3D point list\n");
        for (id, ([x, y, z], [r, g, b])) in POINTS.iter().enumerate() {
            text += &format!("{id} {x} {y} {z} {r} {g} {b} 0.5 1 0 2 1\n");
        }
        self.write(&format!("{folder}/points3D.txt"), text);
    }
}

/// `images.bin` with the poses of [`pose`] and two observations each.
pub fn images_bin(names: &[&str], cameras: usize) -> Vec<u8> {
    let mut out = (names.len() as u64).to_le_bytes().to_vec();
    for (index, name) in names.iter().enumerate() {
        out.extend((index as u32 + 1).to_le_bytes());
        let (quaternion, translation) = pose(index);
        quaternion.iter().chain(&translation).for_each(|v| out.extend(v.to_le_bytes()));
        out.extend((index as u32 % cameras as u32 + 1).to_le_bytes());
        out.extend(name.as_bytes());
        out.push(0);
        out.extend(2u64.to_le_bytes());
        out.extend([0u8; 48]);
    }
    out
}

/// A scene of `count` pinhole photos `00.png` and so on of 12 x 8 px.
pub fn simple(count: usize) -> Scene {
    let scene = Scene::new();
    let names: Vec<String> = (0..count).map(|index| format!("{index:02}.png")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    scene.colmap_bin("sparse/0", &[pinhole()], &names);
    names.iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
    scene
}

/// The text of an error, which must be an input error.
#[track_caller]
pub fn refusal<T>(result: labelgs_scene::Result<T>) -> String {
    match result {
        Ok(_) => panic!("the input was accepted"),
        Err(error) => {
            assert!(matches!(error, Error::Data { .. } | Error::Read { .. }), "{error}");
            error.to_string()
        }
    }
}
