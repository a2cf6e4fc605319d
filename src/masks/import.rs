//! Imports masks of any known format.
//!
//! Reads and checks everything before writing the first file.

use super::check::no_object;
use super::decode::{DecodedMask, SharedPixels, decode};
use super::detect::{Content, Reading, detect};
use super::soft_edges::{self, Edges};
use super::{Format, ImportOptions, ObjectPer, Overlap, names, shortened};
use labelgs_files::error_list::all_or_one_error;
use labelgs_files::label_table::{FILE_NAME, LabelEntry, LabelTable, unique_name};
use labelgs_files::{atomic, image};
use labelgs_scene::labels::LABEL_MAX;
use labelgs_scene::stage::Stage;
use labelgs_scene::{Dataset, Error, Result, Setting};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// Pixels shared by several black and white masks.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Overlaps {
    /// Rule that resolves them.
    pub rule: Overlap,
    /// Number over all photos.
    pub pixels: u64,
    /// Number of photos with shared pixels.
    pub photos: usize,
}

/// How masks are grouped into objects.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Objects {
    /// The rule; not `Auto`. With [`ObjectPer::Mask`], each photo has separate ids.
    pub per: ObjectPer,
    /// Reason for it.
    pub why: String,
}

/// The result of an import.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ImportSummary {
    /// Format of the source.
    pub format: Format,
    /// Reason for the format.
    pub why: String,
    /// Folder or file of the source masks, possibly inside the given folder.
    pub source: PathBuf,
    /// Path of the `pred.json`, if one was used.
    pub pred: Option<PathBuf>,
    /// How masks were grouped into objects; `None` for id images.
    pub objects: Option<Objects>,
    /// Number of photos in the scene.
    pub photos: usize,
    /// Number of masks written.
    pub masks: usize,
    /// Bits per pixel of the masks: 8 or 16.
    pub bits: u8,
    /// The labels, as in `labels.json`.
    pub labels: Vec<LabelEntry>,
    /// Pixels shared by several black and white masks.
    pub overlaps: Overlaps,
    /// Photos without a mask.
    pub photos_without_mask: Vec<String>,
    /// Images without a photo.
    pub masks_without_photo: Vec<String>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// What is kept of a mask between the two passes.
struct Survey {
    pixels: BTreeMap<u32, u64>,
    shared: SharedPixels,
    shared_pixels: u64,
    cut: usize,
    /// Areas in an id image.
    edges: Edges,
}

/// Imports the masks of the photos of `dataset` into the folder `output`, which must be new or empty.
pub fn import(dataset: &Dataset, options: &ImportOptions, output: &Path) -> Result<ImportSummary> {
    atomic::require_empty("output", output)?;
    let views = dataset.all();
    let names = names(&views);
    let reading = detect(&views, options)?;
    let decode = |photo: usize| decode(&reading, photo, views[photo]);
    let with_mask: Vec<usize> = (0..views.len()).filter(|&at| reading.has_mask(at)).collect();
    let stage = Stage::new("reading and writing masks", 2 * with_mask.len());
    let look = |&photo: &usize| stage.counted(|| decode(photo).and_then(|decoded| survey(&reading, decoded)));
    let surveys = all_or_one_error(&reading.root, with_mask.par_iter().map(look).collect())?;
    let edges = with_mask.iter().zip(&surveys).map(|(&photo, survey)| (names[photo], &survey.edges));
    let soft = soft_edges::problem(&edges.collect::<Vec<_>>());
    if let (Some(problem), Format::Auto) = (&soft, options.format) {
        let problem = format!(
            "{problem}. To import every value as an object, set {}",
            Setting("format").to(reading.format.name())
        );
        return Err(Error::data(&reading.root, "", problem));
    }
    let overlaps = overlaps(&reading, &surveys, |at| names[with_mask[at]])?;
    let (labels, new_ids) = labels(&reading, &surveys)?;

    let bits = if labels.len() > 255 { 16 } else { 8 };
    let files = output_names(&names);
    let write = |&photo: &usize| {
        let decoded = decode(photo)?;
        // The first pass found every id; any other pixel becomes 0.
        let ids = decoded.ids.iter().map(|id| new_ids.get(id).copied().unwrap_or(0));
        let (path, (width, height)) = (output.join(&files[photo]), decoded.size);
        match bits {
            8 => image::write_png_grey8(path, width, height, &ids.map(|id| id as u8).collect::<Vec<_>>()),
            _ => image::write_png_grey16(path, width, height, &ids.collect::<Vec<_>>()),
        }
    };
    let written = with_mask.par_iter().map(|photo| stage.counted(|| write(photo)));
    written.collect::<Vec<Result<()>>>().into_iter().collect::<Result<()>>()?;
    let table = LabelTable::new(labels);
    table.write(&output.join(FILE_NAME))?;

    let without = (0..views.len()).filter(|&at| !reading.has_mask(at));
    let mut notes = notes(&reading, &surveys, &table);
    notes.extend(soft);
    let objects = match &reading.content {
        Content::Ids { .. } => None,
        Content::Marks { numbering, .. } => Some(Objects { per: numbering.per, why: numbering.why.clone() }),
    };
    let pred = reading.pred().map(|pred| pred.path.clone());
    Ok(ImportSummary {
        photos_without_mask: without.map(|at| names[at].to_owned()).collect(),
        format: reading.format,
        why: reading.why,
        source: reading.root,
        pred,
        objects,
        photos: views.len(),
        masks: with_mask.len(),
        bits,
        labels: table.labels,
        overlaps,
        masks_without_photo: reading.strays,
        notes,
    })
}

fn survey(reading: &Reading, decoded: DecodedMask) -> Result<Survey> {
    let mut pixels = BTreeMap::new();
    // Count whole runs, because neighbours mostly have the same id.
    for run in decoded.ids.chunk_by(|a, b| a == b).filter(|run| run[0] != 0) {
        *pixels.entry(run[0]).or_default() += run.len() as u64;
    }
    if pixels.len() > LABEL_MAX as usize {
        return Err(too_many(&reading.root, pixels.len()));
    }
    let DecodedMask { size: (width, height), ids, shared, shared_pixels, cut } = decoded;
    let edges = match reading.content {
        Content::Ids { .. } => Edges::measure(&ids, width, height),
        Content::Marks { .. } => Edges::default(),
    };
    Ok(Survey { pixels, shared, shared_pixels, cut, edges })
}

fn too_many(root: &Path, count: usize) -> Error {
    let problem = format!(
        "{count} different ids, but a label is at most {LABEL_MAX}; if these are colours and not ids, \
         import the id pictures, otherwise remove small tracks first"
    );
    Error::data(root, "", problem)
}

fn overlaps<'a>(reading: &Reading, surveys: &[Survey], name: impl Fn(usize) -> &'a str) -> Result<Overlaps> {
    let rule = reading.overlap;
    let pixels = surveys.iter().map(|survey| survey.shared_pixels).sum();
    let photos = surveys.iter().filter(|survey| !survey.shared.is_empty()).count();
    let all = surveys.iter().enumerate();
    let pairs = all.flat_map(|(at, survey)| survey.shared.iter().map(move |(&pair, &count)| (count, at, pair)));
    let worst = pairs.max_by_key(|&(count, at, pair)| (count, std::cmp::Reverse((at, pair))));
    if let (Overlap::Error, Some((count, at, (a, b)))) = (rule, worst) {
        let object = |id: u32| {
            let object = reading.objects().and_then(|objects| objects.get(id as usize - 1));
            object.and_then(|object| object.name.clone()).unwrap_or_else(|| format!("mask {id}"))
        };
        let problem = format!(
            "{pixels} pixels in {photos} photos belong to more than one object, most of them in {}: {count} of {} and \
             {}. Set {} if the object with fewer pixels in the photo has them, or {} if the \
             later one has",
            name(at),
            object(a),
            object(b),
            Setting("overlap").to("smaller"),
            Setting("overlap").to("later")
        );
        return Err(Error::data(&reading.root, "", problem));
    }
    Ok(Overlaps { rule, pixels, photos })
}

/// Returns the new labels, and a map from source ids to label ids.
fn labels(reading: &Reading, surveys: &[Survey]) -> Result<(Vec<LabelEntry>, HashMap<u32, u16>)> {
    let mut found: BTreeMap<u32, (u64, u32)> = BTreeMap::new();
    if let Some(objects) = reading.objects() {
        // An object without pixels keeps its id, so that ids depend only on names.
        found.extend((1..=objects.len() as u32).map(|id| (id, (0, 0))));
    }
    for (id, pixels) in surveys.iter().flat_map(|survey| &survey.pixels) {
        let (sum, views) = found.entry(*id).or_default();
        (*sum, *views) = (*sum + pixels, *views + 1);
    }
    if found.len() > LABEL_MAX as usize {
        return Err(too_many(&reading.root, found.len()));
    }
    if found.values().all(|&(pixels, _)| pixels == 0) {
        return Err(Error::data(&reading.root, "", no_object(surveys.len())));
    }
    if let Some(pred) = reading.pred() {
        pred.check(&reading.root, &found.keys().copied().collect())?;
    }
    let mut taken = BTreeSet::new();
    let mut entries = Vec::with_capacity(found.len());
    for (at, (&source, &(pixels, views))) in found.iter().enumerate() {
        let (name, text) = match (reading.objects(), reading.pred()) {
            (Some(objects), _) => {
                let object = objects.get(source as usize - 1).cloned().unwrap_or_default();
                (object.name, object.source)
            }
            (None, Some(pred)) => (pred.ids.get(&source).cloned().flatten(), Some(source.to_string())),
            (None, None) => (None, Some(source.to_string())),
        };
        let name = name.map(|name| unique_name(name, &mut taken));
        entries.push(LabelEntry { name, source: text, pixels, views, ..LabelEntry::new(at as u32 + 1) });
    }
    let new_ids = found.keys().zip(1..=u16::MAX).map(|(&source, id)| (source, id)).collect();
    Ok((entries, new_ids))
}

/// Returns the names of the masks: the photo's name with `.png` instead of its extension, or appended if two photos
/// differ only in their extensions.
fn output_names(photos: &[&str]) -> Vec<String> {
    let bare = |name: &str| Path::new(name).with_extension("").to_string_lossy().into_owned();
    let mut count: HashMap<String, usize> = HashMap::new();
    photos.iter().for_each(|name| *count.entry(bare(name)).or_default() += 1);
    let own =
        |name: &&str| format!("{}.png", if count.get(&bare(name)) == Some(&1) { bare(name) } else { (*name).into() });
    photos.iter().map(own).collect()
}

fn notes(reading: &Reading, surveys: &[Survey], table: &LabelTable) -> Vec<String> {
    let mut notes = reading.notes.clone();
    let cut: usize = surveys.iter().map(|survey| survey.cut).sum();
    if cut > 0 {
        notes.push(format!(
            "{cut} masks have more values than black and one other; the upper half of the range counts as the object"
        ));
    }
    let empty = table.labels.iter().filter(|entry| entry.pixels == 0).filter_map(|entry| entry.name.clone());
    let empty: Vec<String> = empty.collect();
    if !empty.is_empty() {
        notes.push(format!("{} objects have no pixel in any mask: {}", empty.len(), shortened(&empty)));
    }
    notes
}
