//! COCO instances: a single JSON with all photos. CVAT and Label Studio also export it.

use super::marks::{FoundMarks, Mark, Shape, require_aspect};
use super::names;
use super::photos::PhotoIndex;
use super::polygon::Polygons;
use super::rle::Rle;
use labelgs_files::read;
use labelgs_scene::{Error, Result, View};
use serde::Deserialize;
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
struct File {
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    #[serde(default)]
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct Image {
    id: Value,
    file_name: String,
    /// Label Studio omits unknown sizes.
    width: Option<u32>,
    height: Option<u32>,
}

#[derive(Deserialize)]
struct Annotation {
    #[serde(default)]
    id: Value,
    image_id: Value,
    #[serde(default)]
    category_id: Value,
    #[serde(default)]
    segmentation: Value,
    #[serde(default)]
    iscrowd: Value,
    #[serde(default)]
    track_id: Value,
    #[serde(default)]
    attributes: Value,
}

#[derive(Deserialize)]
struct Category {
    id: Value,
    name: String,
}

const EXPECTED_FORM: &str = r#"expected instances of COCO: {"images": [{"id": 1, "file_name": "a.jpg"}], "annotations": [{"id": 1, "image_id": 1, "category_id": 1, "segmentation": [[x, y, ...]]}], "categories": [{"id": 1, "name": "cup"}]}"#;

/// Folders in which tools put the file, relative to the exported one.
const COCO_FOLDERS: [&str; 2] = ["", "annotations"];

/// Returns the COCO files in a folder, or the path if it is a file.
pub(super) fn files(path: &Path) -> Result<Vec<PathBuf>> {
    if path.is_file() {
        return Ok(vec![path.to_owned()]);
    }
    let mut found = Vec::new();
    for folder in COCO_FOLDERS.map(|name| path.join(name)).iter().filter(|folder| folder.is_dir()) {
        for file in read::folder(folder)? {
            let is_json = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
            if is_json && file.is_file() && looks_like_it(&read::bytes(&file)?) {
                found.push(file);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Recognises broken files too, so that the reader can explain what is wrong.
fn looks_like_it(text: &[u8]) -> bool {
    let has = |key: &str| text.windows(key.len()).any(|part| part == key.as_bytes());
    has("\"images\"") && has("\"annotations\"") && has("\"image_id\"")
}

/// Returns the only COCO file.
pub(super) fn file(path: &Path) -> Result<PathBuf> {
    match &files(path)?[..] {
        [file] => Ok(file.clone()),
        [] => Err(Error::data(path, "", format!("has no JSON with images and annotations; {EXPECTED_FORM}"))),
        several => {
            let names: Vec<String> = several.iter().map(|file| file.display().to_string()).collect();
            Err(Error::data(path, "", format!("has several COCO files; name one of them: {}", names.join(", "))))
        }
    }
}

/// Reads the file.
pub(super) fn read(path: &Path, views: &[&View]) -> Result<FoundMarks> {
    let file: File = read::json(path, EXPECTED_FORM)?;
    let photos = names(views);
    let images = images(path, &photos, &file.images)?;
    let names: HashMap<String, &str> =
        file.categories.iter().map(|category| (category.id.to_string(), category.name.as_str())).collect();
    let mut found = FoundMarks { of_photo: vec![Vec::new(); views.len()], ..FoundMarks::default() };
    found.names = file.categories.iter().map(|category| category.name.clone()).collect();
    let mut boxes = 0;
    for (at, annotation) in file.annotations.iter().enumerate() {
        let place = match &annotation.id {
            Value::Null => format!("annotation at place {} of the list", at + 1),
            id => format!("annotation {id}"),
        };
        let Some((photo, image)) = images.get(&annotation.image_id.to_string()) else {
            let problem =
                format!("is of image {}, which `images` does not list; export the file again", annotation.image_id);
            return Err(Error::data(path, place, problem));
        };
        let Some(photo) = *photo else {
            if found.strays.last() != Some(&image.file_name) {
                found.strays.push(image.file_name.clone());
            }
            continue;
        };
        let place = format!("{place} (photo {})", photos[photo]);
        match shape(annotation, image, views[photo]) {
            Ok(Some(shape)) => found.of_photo[photo].push(mark(annotation, &names, shape)),
            Ok(None) => boxes += 1,
            Err(problem) => return Err(Error::data(path, place, problem)),
        }
    }
    found.strays.sort();
    found.strays.dedup();
    if boxes > 0 {
        found.notes.push(format!(
            "{boxes} of {} annotations are boxes without an outline and were omitted",
            file.annotations.len()
        ));
    }
    if boxes > 0 && found.of_photo.iter().all(Vec::is_empty) {
        let problem = format!(
            "none of the {boxes} annotations has a `segmentation`: boxes mark no pixels; export polygons or masks"
        );
        return Err(Error::data(path, "annotations", problem));
    }
    let named: Vec<String> = file.images.into_iter().map(|image| image.file_name).collect();
    super::marks::require_photo(path, &photos, &found, &named)?;
    Ok(found)
}

/// Returns the images by id, with their photos.
fn images<'a>(
    path: &Path,
    photos: &[&str],
    images: &'a [Image],
) -> Result<HashMap<String, (Option<usize>, &'a Image)>> {
    let index = PhotoIndex::new(photos);
    let mut owners: HashMap<usize, &str> = HashMap::new();
    let mut found = HashMap::new();
    for image in images {
        let wrong = |problem: String| Err(Error::data(path, format!("image `{}`", image.file_name), problem));
        let photo = index.find(&image.file_name);
        let other = photo.and_then(|photo| owners.insert(photo, &image.file_name));
        if let (Some(photo), Some(other)) = (photo, other) {
            return wrong(format!("and image `{other}` both belong to the photo {}; keep one of them", photos[photo]));
        }
        if found.insert(image.id.to_string(), (photo, image)).is_some() {
            return wrong(format!("has the id {} of another image; ids must be unique", image.id));
        }
    }
    Ok(found)
}

fn mark(annotation: &Annotation, names: &HashMap<String, &str>, shape: Shape) -> Mark {
    let name = match &annotation.category_id {
        Value::Null => None,
        id => Some(names.get(&id.to_string()).map_or_else(|| format!("category {id}"), |name| (*name).to_owned())),
    };
    // CVAT stores the track of a video among the attributes.
    let tracks = [Some(&annotation.track_id), annotation.attributes.get("track_id")];
    let track = tracks.into_iter().flatten().find(|track| !track.is_null()).map(Value::to_string);
    let is_crowd =
        annotation.iscrowd == Value::Bool(true) || annotation.iscrowd.as_u64().is_some_and(|crowd| crowd > 0);
    Mark { track, is_crowd, ..Mark::new(name, shape) }
}

/// Returns the pixels, or `None` for a box. The error describes what is wrong.
fn shape(annotation: &Annotation, image: &Image, view: &View) -> Result<Option<Shape>, String> {
    let photo = view.camera.size();
    match &annotation.segmentation {
        Value::Null => Ok(None),
        Value::Array(lists) if lists.is_empty() => Ok(None),
        Value::Array(lists) => {
            let size = (image.width.unwrap_or(photo.0), image.height.unwrap_or(photo.1));
            require_aspect("the image", size, view)?;
            Ok(Some(Shape::Polygons(Polygons::read(lists, size)?)))
        }
        value => {
            let rle = Rle::read(value)?;
            require_aspect("the mask", rle.size, view)?;
            Ok(Some(Shape::Rle(rle)))
        }
    }
}
