//! NVOS: one object per scene, strokes in a reference view, a mask in another view.
//!
//! `reference_image/SCENE/FRAME.*`, `scribbles/SCENE/pos_*.png` and `neg_*.png`, `masks/SCENE/FRAME_mask.png`. The
//! scene `horns` occurs twice, as `horns_center` and `horns_left`. If there is a mask
//! `reference_image/SCENE/FRAME_mask.png` of the reference view, which many later papers derive from the strokes, it
//! replaces the strokes.

use super::{Layout, LayoutInput, Prompt, SelectBy, Task, TruthFile, folders, is_png, stem};
use crate::Setting;
use std::collections::BTreeSet;
use std::path::PathBuf;

const MASK_SUFFIX: &str = "_mask";

pub(super) fn layout(files: &[PathBuf], ask: LayoutInput) -> Result<Layout, String> {
    let at = |kind: &str, scene: &str| -> Vec<PathBuf> {
        files.iter().filter(|file| folders(file) == [kind, scene]).cloned().collect()
    };
    let scenes: BTreeSet<String> = files
        .iter()
        .filter_map(|file| match &folders(file)[..] {
            [kind, scene] if kind == "masks" => Some(scene.clone()),
            _ => None,
        })
        .collect();
    let ours = |name: &&String| {
        name.as_str() == ask.scene || name.strip_prefix(ask.scene).is_some_and(|rest| rest.starts_with('_'))
    };
    let wanted: Vec<&String> =
        if scenes.len() == 1 { scenes.iter().collect() } else { scenes.iter().filter(ours).collect() };
    if wanted.is_empty() {
        let there: Vec<&str> = scenes.iter().map(String::as_str).collect();
        return Err(format!(
            "holds no masks/{}/FRAME_mask.png; name the scene folder like its masks{}{}",
            ask.scene,
            if there.is_empty() { "" } else { ": " },
            there.join(", ")
        ));
    }
    let mut layout = Layout::default();
    for scene in wanted {
        let masks = at("masks", scene);
        let truths = masks.into_iter().filter_map(truth).collect();
        let prompt = match ask.by {
            SelectBy::Name => Prompt::Name,
            SelectBy::Prompt => prompt(scene, &at("reference_image", scene), &at("scribbles", scene))?,
        };
        layout.tasks.push(Task { object: scene.clone(), prompt, truths });
    }
    Ok(layout)
}

fn truth(file: PathBuf) -> Option<TruthFile> {
    is_png(&file).then_some(())?;
    let frame = stem(&file).strip_suffix(MASK_SUFFIX)?.to_owned();
    Some(TruthFile { frame, file })
}

fn prompt(scene: &str, references: &[PathBuf], scribbles: &[PathBuf]) -> Result<Prompt, String> {
    if let Some(mask) = references.iter().cloned().find_map(truth) {
        return Ok(Prompt::Mask(mask));
    }
    let starting = |word: &str| scribbles.iter().filter(|file| stem(file).starts_with(word)).cloned().collect();
    let (on, off): (Vec<PathBuf>, Vec<PathBuf>) = (starting("pos"), starting("neg"));
    match references.first() {
        None => Err(format!("reference_image/{scene} contains no photo, so the view of the strokes is unknown")),
        Some(_) if on.is_empty() => Err(format!(
            "scribbles/{scene} contains no pos_*.png; add strokes, or set {} to choose without them",
            Setting("by").to("name")
        )),
        Some(photo) => Ok(Prompt::Scribbles { frame: stem(photo), on, off }),
    }
}
