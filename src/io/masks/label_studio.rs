//! "Brush labels to PNG" of Label Studio: `task-1-annotation-2-by-3-tag-cup-0.png` for each region. These names tell no
//! photo, so the export "JSON" or "JSON-MIN" of the same project lies beside them.

use super::marks::{Found, Mark, Shape};
use super::photos::PhotoIndex;
use crate::error::{Error, Result};
use crate::io::read;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// What the name of a picture tells. Regions sort by label, then by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Region<'a> {
    task: u64,
    annotation: u64,
    label: &'a str,
    number: u64,
    file: &'a str,
}

/// Takes a name apart. The name of a label may have any sign; names of people and of the tag have no hyphen.
fn region(file: &str) -> Option<Region<'_>> {
    let rest = file.strip_suffix(".png")?.strip_prefix("task-")?;
    let (task, rest) = rest.split_once("-annotation-")?;
    let (annotation, rest) = rest.split_once("-by-")?;
    let (_person, rest) = rest.split_once('-')?;
    let (_tag, rest) = rest.split_once('-')?;
    let (label, number) = rest.rsplit_once('-')?;
    Some(Region {
        task: task.parse().ok()?,
        annotation: annotation.parse().ok()?,
        label: Some(label).filter(|label| !label.is_empty())?,
        number: number.parse().ok()?,
        file,
    })
}

/// True if the files of a folder are such pictures.
pub(super) fn is_it(files: &[String]) -> bool {
    files.iter().any(|file| region(file).is_some())
}

/// Reads the folder.
pub(super) fn read(root: &Path, photos: &[&str], files: &[String]) -> Result<Found> {
    let mut regions: Vec<Region<'_>> = files.iter().filter_map(|file| region(file)).collect();
    regions.sort();
    if let Some(pair) =
        regions.windows(2).find(|pair| pair[0].task == pair[1].task && pair[0].annotation != pair[1].annotation)
    {
        let problem = format!(
            "task {} has the annotations {} and {}, which may disagree; keep the pictures of one of them",
            pair[0].task, pair[0].annotation, pair[1].annotation
        );
        return Err(Error::data(root, pair[1].file, problem));
    }
    let tasks = tasks(root, photos, files)?;
    let mut found = Found { of_photo: vec![Vec::new(); photos.len()], ..Found::default() };
    let mut owners: BTreeMap<usize, u64> = BTreeMap::new();
    let mut named = Vec::new();
    for region in &regions {
        let Some((photo, shown)) = tasks.get(&region.task) else {
            let problem =
                format!("is of task {}, which no JSON here lists; export both from the same project", region.task);
            return Err(Error::data(root.join(region.file), "", problem));
        };
        named.push(shown.clone());
        let Some(photo) = *photo else {
            found.strays.push(region.file.to_owned());
            continue;
        };
        let owner = *owners.entry(photo).or_insert(region.task);
        if owner != region.task {
            let problem =
                format!("the tasks {owner} and {} are both the photo {}; keep one of them", region.task, photos[photo]);
            return Err(Error::data(root, region.file, problem));
        }
        let name = Some(region.label).filter(|label| *label != "no_label").map(str::to_owned);
        found.of_photo[photo].push(Mark::new(name, Shape::Png(region.file.to_owned())));
    }
    named.dedup();
    super::marks::require_photo(root, photos, &found, &named)?;
    Ok(found)
}

/// Reads the photo of each task, and what the task calls it.
fn tasks(root: &Path, photos: &[&str], files: &[String]) -> Result<BTreeMap<u64, (Option<usize>, String)>> {
    let index = PhotoIndex::new(photos);
    let mut found = BTreeMap::new();
    let jsons: Vec<&String> = files.iter().filter(|file| file.ends_with(".json") && !file.contains('/')).collect();
    if jsons.is_empty() {
        let problem = "the names of these pictures tell tasks and no photos: export the same project as JSON too, and put \
                       that file into this folder";
        return Err(Error::data(root, "", problem));
    }
    for file in jsons {
        let path = root.join(file);
        let expected = r#"expected a list of tasks: [{"id": 1, "data": {"image": "/data/upload/1/a.jpg"}}]"#;
        let list: Vec<Value> = read::json(&path, expected)?;
        for (at, task) in list.iter().enumerate() {
            let Some(id) = task.get("id").and_then(Value::as_u64) else {
                return Err(Error::data(
                    &path,
                    format!("task at place {} of the list", at + 1),
                    format!("has no `id`; {expected}"),
                ));
            };
            let data = task.get("data").unwrap_or(task).as_object();
            let texts: Vec<&str> = data.into_iter().flat_map(|data| data.values()).filter_map(Value::as_str).collect();
            let photo = texts.iter().find_map(|text| Some((index.find(text)?, *text)));
            let shown = photo.map(|(_, text)| text).or(texts.first().copied()).unwrap_or_default();
            found.insert(id, (photo.map(|(photo, _)| photo), shown.to_owned()));
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_taken_apart() {
        let found = region("task-12-annotation-3-by-a@b.org-tag-big cup-2-old-0.png").expect("a region");
        assert_eq!((found.task, found.annotation, found.label, found.number), (12, 3, "big cup-2-old", 0));
        for other in
            ["task-1.png", "task-x-annotation-1-by-1-tag-a-0.png", "task-1-annotation-1-by-1-tag-a.png", "a.png"]
        {
            assert_eq!(region(other), None, "{other}");
        }
    }
}
