//! 3D-OVS: `segmentations/classes.txt` lists the classes, `segmentations/FRAME/CLASS.png` are their masks in the
//! annotated frames. The published score is the mean IoU over classes and frames.

use super::{Ask, Layout, by_frame_and_object, tasks};
use std::path::PathBuf;

pub(super) fn layout(files: &[PathBuf], classes: Option<&str>, ask: Ask) -> Result<Layout, String> {
    let Some(classes) = classes else {
        return Err(
            "holds no classes.txt; expected classes.txt and FRAME/CLASS.png, as in 3D-OVS/sofa/segmentations".into()
        );
    };
    let classes: Vec<&str> = classes.split(['\n', ',']).map(str::trim).filter(|class| !class.is_empty()).collect();
    let mut left_out = Vec::new();
    let mut objects = by_frame_and_object(files, &mut left_out);
    for class in &classes {
        if !objects.contains_key(*class) {
            left_out.push(format!("class {class} of classes.txt has no mask in any frame"));
        }
    }
    objects.retain(|name, truths| {
        let known = classes.contains(&name.as_str());
        if !known {
            left_out.push(format!("{name} ({} masks) is not in classes.txt", truths.len()));
        }
        known
    });
    if objects.is_empty() {
        return Err(format!("holds no mask of a class; classes.txt names {}", classes.join(", ")));
    }
    let mut layout = tasks(objects, ask);
    layout.left_out.extend(left_out);
    Ok(layout)
}
