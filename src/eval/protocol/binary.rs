//! Black and white masks: `OBJECT/FRAME.png`, or `FRAME.png` for a single object named like the folder.
//!
//! As in SPIn-NeRF, the first frame is the prompt and is not scored.

use super::{Layout, LayoutInput, TruthFile, folders, is_png, stem, tasks};
use std::collections::BTreeMap;
use std::path::PathBuf;

pub(super) fn layout(files: &[PathBuf], ask: LayoutInput) -> Result<Layout, String> {
    let mut objects: BTreeMap<String, Vec<TruthFile>> = BTreeMap::new();
    let mut left_out = Vec::new();
    for file in files.iter().filter(|file| is_png(file)) {
        let object = match &folders(file)[..] {
            [] => ask.truth.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
            [object] => object.clone(),
            _ => {
                left_out.push(format!("{} is neither FRAME.png nor OBJECT/FRAME.png", file.display()));
                continue;
            }
        };
        objects.entry(object).or_default().push(TruthFile { frame: stem(file), file: file.clone() });
    }
    if objects.is_empty() {
        return Err("contains no masks; expected FRAME.png or OBJECT/FRAME.png".into());
    }
    // Each object has its own first frame.
    let mut layout = Layout { tasks: Vec::new(), left_out };
    for (object, truths) in objects {
        let one = tasks(BTreeMap::from([(object, truths)]), Vec::new(), ask);
        layout.tasks.extend(one.tasks);
        layout.left_out.extend(one.left_out);
    }
    Ok(layout)
}
