//! Benchmarks with a mask per frame and object, `FRAME/OBJECT.png`, white where the object is visible.

use super::{Layout, LayoutInput, SelectBy, TruthFile, folders, is_png, stem, tasks};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Returns the masks of each object. Other files are left out.
fn objects(files: &[PathBuf], left_out: &mut Vec<String>) -> BTreeMap<String, Vec<TruthFile>> {
    let mut objects: BTreeMap<String, Vec<TruthFile>> = BTreeMap::new();
    for file in files.iter().filter(|file| is_png(file)) {
        match &folders(file)[..] {
            [frame] => {
                objects.entry(stem(file)).or_default().push(TruthFile { frame: frame.clone(), file: file.clone() });
            }
            _ => left_out.push(format!("{} is not FRAME/OBJECT.png", file.display())),
        }
    }
    objects
}

/// The evaluation of the LabelGS paper, in `segmentations`. The first frame by name is a training view and the prompt;
/// the other frames are scored. The first frame is excluded even if labels are chosen by name, because the model was
/// trained on it.
pub(super) fn labelgs(files: &[PathBuf], ask: LayoutInput) -> Result<Layout, String> {
    let mut left_out = Vec::new();
    let mut objects = objects(files, &mut left_out);
    let frames = objects.values().flatten().map(|truth| truth.frame.clone());
    let Some(first) = frames.min() else { return Err("contains no masks; expected FRAME/OBJECT.png".into()) };
    if ask.by == SelectBy::Name {
        objects.values_mut().for_each(|truths| truths.retain(|truth| truth.frame != first));
    }
    Ok(tasks(objects, left_out, ask))
}

/// LERF-Mask, the benchmark of Gaussian Grouping, in `test_mask`. Objects are text prompts; a frame is the name of a
/// view, or the number of a held-out view, from 0. The published score averages over the views of a prompt, then over
/// prompts. Its scorer excludes missing predictions.
pub(super) fn lerf_mask(files: &[PathBuf], ask: LayoutInput) -> Result<Layout, String> {
    let mut left_out = Vec::new();
    let objects = objects(files, &mut left_out);
    if objects.is_empty() {
        return Err("contains no masks; expected VIEW/PROMPT.png, as in lerf_mask/figurines/test_mask".into());
    }
    Ok(tasks(objects, left_out, ask))
}

/// 3D-OVS, in `segmentations`: `classes.txt` lists the objects. The published score is the mean IoU over classes and
/// frames.
pub(super) fn three_d_ovs(files: &[PathBuf], classes: Option<&str>, ask: LayoutInput) -> Result<Layout, String> {
    let Some(classes) = classes else {
        return Err(
            "contains no classes.txt; expected classes.txt and FRAME/CLASS.png, as in 3D-OVS/sofa/segmentations".into(),
        );
    };
    let classes: Vec<&str> = classes.split(['\n', ',']).map(str::trim).filter(|class| !class.is_empty()).collect();
    let mut left_out = Vec::new();
    let mut objects = objects(files, &mut left_out);
    for class in classes.iter().filter(|class| !objects.contains_key(**class)) {
        left_out.push(format!("class {class} of classes.txt has no mask in any frame"));
    }
    objects.retain(|name, truths| {
        let known = classes.contains(&name.as_str());
        if !known {
            left_out.push(format!("{name} ({} masks) is not in classes.txt", truths.len()));
        }
        known
    });
    if objects.is_empty() {
        return Err(format!("contains no mask of a class in classes.txt ({})", classes.join(", ")));
    }
    Ok(tasks(objects, left_out, ask))
}
