//! Single cameras as JSON, and the `cameras.json` that 3DGS viewers read.

use super::lens::Lens;
use super::listing::{check_camera, rotation_of};
use super::transforms::affine;
use glam::{DMat3, DVec3};
use labelgs_files::{atomic, read, run_folder};
use labelgs_scene::{Camera, Error, Result, View};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::path::Path;

/// File with the cameras of a run, named as in 3DGS.
pub const CAMERAS_FILE: &str = "cameras.json";

/// A camera in the JSON layout of `labelgs render --camera`.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct CameraFile {
    /// Camera-from-world, 4 x 4, row-major, OpenCV axes.
    pub w2c: Vec<Vec<f64>>,
    /// Horizontal focal length, px.
    pub fx: f64,
    /// Vertical focal length, px.
    pub fy: f64,
    /// Principal point x, px; the centre of the first pixel is at 0.5.
    pub cx: f64,
    /// Principal point y, px.
    pub cy: f64,
    /// Width, px.
    #[serde(rename = "W")]
    pub width: u32,
    /// Height, px.
    #[serde(rename = "H")]
    pub height: u32,
}

impl From<&Camera> for CameraFile {
    fn from(camera: &Camera) -> Self {
        let row = |axis: usize| {
            let row = camera.rotation.row(axis);
            vec![row.x, row.y, row.z, camera.translation[axis]]
        };
        let Camera { fx, fy, cx, cy, width, height, .. } = *camera;
        Self { w2c: vec![row(0), row(1), row(2), vec![0.0, 0.0, 0.0, 1.0]], fx, fy, cx, cy, width, height }
    }
}

/// Reads a camera: `{"w2c": 4x4 row-major with OpenCV axes, "fx", "fy", "cx", "cy", "W", "H"}`.
pub fn read_camera(path: impl AsRef<Path>) -> Result<Camera> {
    let path = path.as_ref();
    let expected = "expected {\"w2c\": 4x4 rows, \"fx\", \"fy\", \"cx\", \"cy\", \"W\", \"H\"}";
    let file: CameraFile = read::json(path, expected)?;
    camera_of(path, &file)
}

/// Returns the camera after checking it. Errors name `path`, its source.
pub fn camera_of(path: &Path, file: &CameraFile) -> Result<Camera> {
    let refuse =
        || Error::data(path, "w2c", "is not a camera-from-world pose: 4 x 4 numbers, the upper left 3 x 3 a rotation");
    let pose = affine(&file.w2c).ok_or_else(refuse)?;
    let rotation = rotation_of(pose.matrix3).ok_or_else(refuse)?;
    // A pose with a scale would need a scaled translation too. No known program writes one.
    if (pose.matrix3.determinant() - 1.0).abs() > 1e-2 {
        return Err(refuse());
    }
    let CameraFile { fx, fy, cx, cy, width, height, .. } = *file;
    let camera = Camera { rotation, translation: pose.translation, fx, fy, cx, cy, width, height };
    check_camera(path, "", &camera, &Lens::default())?;
    Ok(camera)
}

/// An entry of `cameras.json`: the fields in the order of 3DGS, then the principal point.
#[derive(Debug, Serialize, Deserialize)]
struct Entry<'a> {
    #[serde(default)]
    id: usize,
    img_name: Cow<'a, str>,
    width: u32,
    height: u32,
    position: [f64; 3],
    rotation: [[f64; 3]; 3],
    fy: f64,
    fx: f64,
    /// 3DGS omits the principal point, which then is the image centre.
    cx: Option<f64>,
    cy: Option<f64>,
}

/// Writes the `cameras.json` of 3DGS: name, size, centre and world-from-camera rotation (rows) of each camera.
pub fn write_cameras<'a>(path: impl AsRef<Path>, cameras: &[(&'a str, &Camera)]) -> Result<()> {
    let entry = |(id, &(img_name, camera)): (usize, &(&'a str, &Camera))| Entry {
        id,
        img_name: img_name.into(),
        width: camera.width,
        height: camera.height,
        position: camera.centre().to_array(),
        // Columns of camera-from-world are rows of world-from-camera.
        rotation: camera.rotation.to_cols_array_2d(),
        fy: camera.fy,
        fx: camera.fx,
        cx: Some(camera.cx),
        cy: Some(camera.cy),
    };
    let entries: Vec<Entry> = cameras.iter().enumerate().map(entry).collect();
    atomic::write_json(path.as_ref(), &entries)
}

/// Reads the views in the `cameras.json` of a model's run, from any 3DGS trainer, without photos. Returns an empty list
/// if there is no such file.
pub fn views_of_model(model: &Path) -> Result<Vec<View>> {
    let path = run_folder::find_for_model(model).map(|run| run.join(CAMERAS_FILE)).filter(|path| path.is_file());
    let Some(path) = path else { return Ok(Vec::new()) };
    let expected = "expected a list of cameras, each with img_name, width, height, position, rotation, fx, fy; delete the file \
                    to go on without";
    let entries: Vec<Entry> = read::json(&path, expected)?;
    entries.iter().map(|entry| view(&path, entry)).collect()
}

fn view(path: &Path, entry: &Entry) -> Result<View> {
    let place = format!("camera {}", entry.img_name);
    // Rows of world-from-camera are columns of camera-from-world.
    let rotation = rotation_of(DMat3::from_cols_array_2d(&entry.rotation))
        .ok_or_else(|| Error::data(path, &place, "has no valid rotation; fix it or delete the file"))?;
    let Entry { width, height, fx, fy, .. } = *entry;
    let (cx, cy) = (entry.cx.unwrap_or(f64::from(width) / 2.0), entry.cy.unwrap_or(f64::from(height) / 2.0));
    let translation = -(rotation * DVec3::from_array(entry.position));
    let camera = Camera { rotation, translation, fx, fy, cx, cy, width, height };
    check_camera(path, &place, &camera, &Lens::default())?;
    Ok(View { name: entry.img_name.to_string(), camera, photo: None, mask: None })
}

#[cfg(test)]
mod tests {
    use super::{views_of_model, write_cameras};
    use glam::{DMat3, DVec3};
    use labelgs_scene::Camera;

    #[test]
    fn cameras_of_a_run_are_read_back() {
        let folder = tempfile::tempdir().expect("a folder");
        assert!(views_of_model(folder.path()).expect("no file").is_empty());
        let camera = Camera {
            rotation: DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-0.2),
            translation: DVec3::new(1.0, -2.0, 3.5),
            fx: 100.0,
            fy: 101.0,
            cx: 31.0,
            cy: 25.5,
            width: 64,
            height: 48,
        };
        let file = folder.path().join("cameras.json");
        write_cameras(&file, &[("a.png", &camera)]).expect("written");
        let found = views_of_model(folder.path()).expect("read");
        assert_eq!((found.len(), found[0].name.as_str()), (1, "a.png"));
        assert!(found[0].camera.rotation.abs_diff_eq(camera.rotation, 1e-12));
        assert!(found[0].camera.translation.abs_diff_eq(camera.translation, 1e-12));
        assert_eq!(found[0].camera.cx, 31.0);

        // As 3DGS writes it.
        let entry = r#"[{"id":0,"img_name":"b","width":64,"height":48,"position":[0,0,1],
            "rotation":[[1,0,0],[0,1,0],[0,0,1]],"fy":50.0,"fx":50.0}]"#;
        labelgs_files::atomic::write(&file, |out| out.write_all(entry.as_bytes())).expect("written");
        let found = views_of_model(folder.path()).expect("read");
        assert_eq!((found[0].camera.cx, found[0].camera.translation), (32.0, DVec3::new(0.0, 0.0, -1.0)));

        for (bad, part) in [("[{}]", "img_name"), (&entry.replace("[1,0,0]", "[9,0,0]"), "camera b")] {
            labelgs_files::atomic::write(&file, |out| out.write_all(bad.as_bytes())).expect("written");
            let error = views_of_model(folder.path()).expect_err("refused").to_string();
            assert!(error.contains(part) && error.contains("delete the file"), "{error}");
        }
    }
}
