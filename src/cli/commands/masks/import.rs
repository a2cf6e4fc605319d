//! `labelgs masks import`.

use super::open_photos;
use crate::Result;
use crate::cli::support::{Context, ReadArgs, quoted};
use crate::files::label_table::LabelEntry;
use crate::masks::{Format, ImportOptions, ImportSummary, ObjectPer, Objects, Overlap, import};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs masks import`.
#[derive(Args, Clone, Debug)]
pub struct ImportArgs {
    /// Folder of masks, the output folder of a tool or data set that contains it, or a COCO JSON file.
    #[arg(value_name = "MASKS")]
    pub folder: PathBuf,
    /// Scene with the photos of the masks.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder to write; must be new or empty.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Format of the masks.
    #[arg(long, value_name = "FORMAT", value_enum, default_value = "auto")]
    pub format: Format,
    /// File pred.json of DEVA. Default: MASKS/pred.json, if it exists.
    #[arg(long, value_name = "FILE")]
    pub pred: Option<PathBuf>,
    /// Which mask gets pixels that several masks cover, in formats with one object per mask.
    #[arg(long, value_name = "RULE", value_enum, default_value = "auto")]
    pub overlap: Overlap,
    /// Which masks belong to the same object, in formats with one object per mask.
    #[arg(long, value_name = "RULE", value_enum, default_value = "auto")]
    pub object_per: ObjectPer,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// Imports the masks.
pub(crate) fn run(args: &ImportArgs, context: &Context) -> Result<()> {
    let dataset = open_photos(&args.scene, &args.read)?;
    let options = ImportOptions {
        folder: args.folder.clone(),
        format: args.format,
        pred: args.pred.clone(),
        overlap: args.overlap,
        object_per: args.object_per,
    };
    let done = import(&dataset, &options, &args.output)?;
    warn(&done);
    let pred = done.pred.as_ref().map_or(String::new(), |pred| format!(", {}", pred.display()));
    let mut text = format!("{}{pred}: {} ({})\n", done.source.display(), done.format.name(), done.why);
    let (output, labels) = (args.output.display().to_string(), done.labels.len());
    let (masks, photos, bits) = (done.masks, done.photos, done.bits);
    text += &format!("{output}: {masks} masks for {photos} photos, {labels} labels, {bits} bits\n");
    text += &format!("{:>6} {:>12} {:>6}  {:<24} source\n", "label", "pixels", "views", "name");
    done.labels.iter().for_each(|entry| text += &line(entry));
    text += &done.objects.as_ref().map_or(String::new(), |objects| meaning(objects, args));
    context.show(&json!({ "schema_version": 1, "output": output, "import": done }), &text)
}

fn line(entry: &LabelEntry) -> String {
    let text = |value: &Option<String>| value.clone().unwrap_or_else(|| "-".to_owned());
    let (name, source) = (text(&entry.name), text(&entry.source));
    format!("{:>6} {:>12} {:>6}  {name:<24} {source}\n", entry.id, entry.pixels, entry.views)
}

fn warn(done: &ImportSummary) {
    let listed = |names: &[String]| names.join(", ");
    if !done.masks_without_photo.is_empty() {
        let names = &done.masks_without_photo;
        tracing::warn!("{} masks belong to no photo and were skipped: {}", names.len(), listed(names));
    }
    if !done.photos_without_mask.is_empty() {
        let names = &done.photos_without_mask;
        tracing::warn!("{} of {} photos have no mask: {}", names.len(), done.photos, listed(names));
    }
    if done.overlaps.pixels > 0 {
        let (pixels, photos) = (done.overlaps.pixels, done.overlaps.photos);
        let rule = match done.overlaps.rule {
            Overlap::Smaller => "smaller",
            _ => "later",
        };
        tracing::warn!(
            "{pixels} pixels in {photos} photos belong to several masks and went to the {rule} one, see --overlap"
        );
    }
    done.notes.iter().for_each(|note| tracing::warn!("{note}"));
}

/// Explains the ids and, if they differ from photo to photo, how to match them.
fn meaning(objects: &Objects, args: &ImportArgs) -> String {
    let why = &objects.why;
    match objects.per {
        ObjectPer::Mask => {
            let [scene, masks] = [&args.scene, &args.output].map(|path| quoted(&path.to_string_lossy()));
            format!(
                "ids differ from photo to photo ({why}; see --object-per). To match them, run:\n  \
                 labelgs train {scene} -o plain\n  \
                 labelgs masks repair {masks} --per-view --model plain --scene {scene} -o repaired\n"
            )
        }
        ObjectPer::Track => format!("masks with the same track id are one object ({why})\n"),
        _ => format!("masks with the same name are one object ({why})\n"),
    }
}
