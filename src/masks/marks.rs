//! Masks of single objects in single photos, from any tool, and the ids assigned to them.

use super::polygon::Polygons;
use super::rle::Rle;
use super::{ObjectPer, shortened};
use labelgs_files::label_table::unique_name;
use labelgs_files::resize::aspect_problem;
use labelgs_scene::{Error, Result, Setting, View};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The pixels of an object in a photo.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    /// A black and white PNG.
    Png(String),
    Rle(Rle),
    Polygons(Polygons),
}

/// A mask of one object in one photo.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mark {
    pub(super) name: Option<String>,
    /// The tool's name of the object in all photos.
    pub(super) track: Option<String>,
    /// The mask covers several objects and yields to all other masks.
    pub(super) is_crowd: bool,
    pub(super) shape: Shape,
    /// Id among all objects, from 1; set by [`number`].
    pub(super) id: u32,
}

impl Mark {
    pub(super) fn new(name: Option<String>, shape: Shape) -> Self {
        Self { name, track: None, is_crowd: false, shape, id: 0 }
    }
}

/// The masks that a reader found.
#[derive(Clone, Debug, Default)]
pub(super) struct FoundMarks {
    /// The masks of each photo in the order of the source.
    pub(super) of_photo: Vec<Vec<Mark>>,
    /// Names in the order of their ids; others follow alphabetically.
    pub(super) names: Vec<String>,
    /// Files and images that do not belong to any photo.
    pub(super) strays: Vec<String>,
    pub(super) notes: Vec<String>,
}

/// An object: its display name, and its name in the source.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Object {
    pub(super) name: Option<String>,
    pub(super) source: Option<String>,
}

/// The objects of all photos, by id from 1, and the rule that formed them.
#[derive(Clone, Debug)]
pub(super) struct Numbering {
    pub(super) objects: Vec<Object>,
    pub(super) per: ObjectPer,
    /// Reason for the rule.
    pub(super) why: String,
}

/// Assigns each mask the id of its object. `source` is the file or folder, for messages.
pub(super) fn number(source: &Path, photos: &[&str], found: &mut FoundMarks, asked: ObjectPer) -> Result<Numbering> {
    let (per, why) = rule(source, photos, found, asked)?;
    let own: BTreeSet<&str> = found.of_photo.iter().flatten().filter_map(|mark| mark.name.as_deref()).collect();
    let known: BTreeSet<&str> = found.names.iter().map(String::as_str).collect();
    let mut names: Vec<String> = found.names.iter().filter(|name| own.contains(name.as_str())).cloned().collect();
    names.extend(own.difference(&known).map(|&name| name.to_owned()));
    let mut tracks: Vec<String> = found.of_photo.iter().flatten().filter_map(|mark| mark.track.clone()).collect();
    tracks.sort_by_key(|track| (track.parse::<u64>().unwrap_or(u64::MAX), track.clone()));
    tracks.dedup();
    let rank = |all: &[String]| all.iter().cloned().zip(0..).collect::<BTreeMap<String, usize>>();
    let (name_ranks, track_ranks) = (rank(&names), rank(&tracks));
    // Masks without a name come last. The second number distinguishes objects with the same name.
    let mut keys: Vec<Vec<(usize, usize)>> = Vec::with_capacity(found.of_photo.len());
    for marks in &found.of_photo {
        let mut seen: BTreeMap<usize, usize> = BTreeMap::new();
        let key = |mark: &Mark| {
            let place = |all: &BTreeMap<String, usize>, one: &Option<String>| all.get(one.as_ref()?).copied();
            let name = place(&name_ranks, &mark.name).unwrap_or(names.len());
            let nth = seen.entry(name).or_default();
            *nth += 1;
            let number = match per {
                ObjectPer::Track => place(&track_ranks, &mark.track).unwrap_or(tracks.len()),
                ObjectPer::Mask => *nth,
                _ => 0,
            };
            (name, number)
        };
        keys.push(marks.iter().map(key).collect());
    }
    let all: BTreeSet<(usize, usize)> = keys.iter().flatten().copied().collect();
    let ids: BTreeMap<(usize, usize), u32> = all.iter().zip(1..).map(|(&key, id)| (key, id)).collect();
    for (marks, keys) in found.of_photo.iter_mut().zip(&keys) {
        marks.iter_mut().zip(keys).for_each(|(mark, key)| mark.id = ids.get(key).copied().unwrap_or(0));
    }
    let mut taken = BTreeSet::new();
    let object = |&(name, number): &(usize, usize)| {
        let name = names.get(name);
        let track =
            (per == ObjectPer::Track).then(|| tracks.get(number).map(|track| format!("track {track}"))).flatten();
        Object { name: name.map(|name| unique_name(name.clone(), &mut taken)), source: track.or_else(|| name.cloned()) }
    };
    Ok(Numbering { objects: all.iter().map(object).collect(), per, why })
}

/// Decides how masks are grouped into objects.
fn rule(source: &Path, photos: &[&str], found: &FoundMarks, asked: ObjectPer) -> Result<(ObjectPer, String)> {
    let all = || found.of_photo.iter().flatten();
    let (nameless, trackless) =
        (all().filter(|mark| mark.name.is_none()).count(), all().filter(|mark| mark.track.is_none()).count());
    let twice = found.of_photo.iter().enumerate().find_map(|(photo, marks)| {
        let mut seen = BTreeSet::new();
        let name = marks.iter().filter_map(|mark| mark.name.as_ref()).find(|name| !seen.insert(*name))?;
        Some(format!("{} has more than one {name}", photos.get(photo).copied().unwrap_or_default()))
    });
    let without = |count: usize, what: &str, others: &[&str]| {
        let others = others.iter().map(|other| Setting("object_per").to(other)).collect::<Vec<_>>().join(" or ");
        let problem = format!("{count} of {} masks have no {what}; set {others}", all().count());
        Err(Error::data(source, "", problem))
    };
    match asked {
        ObjectPer::Track if trackless > 0 => without(trackless, "track", &["name", "mask"]),
        ObjectPer::Name if nameless > 0 => without(nameless, "name", &["mask"]),
        ObjectPer::Auto if trackless == 0 => Ok((ObjectPer::Track, "every mask has a track".to_owned())),
        ObjectPer::Auto if nameless > 0 => {
            Ok((ObjectPer::Mask, format!("{nameless} of {} masks have no name", all().count())))
        }
        ObjectPer::Auto => Ok(match twice {
            Some(twice) => (ObjectPer::Mask, twice),
            None => (ObjectPer::Name, "no photo has two masks with the same name".to_owned()),
        }),
        asked => Ok((asked, "as requested".to_owned())),
    }
}

/// Refuses a source without masks for any photo; `named` lists the photos that it names.
pub(super) fn require_photo(source: &Path, photos: &[&str], found: &FoundMarks, named: &[String]) -> Result<()> {
    if found.of_photo.iter().any(|marks| !marks.is_empty()) {
        return Ok(());
    }
    let problem = format!(
        "no mask belongs to a photo of the scene: the scene has {}, but the masks are for {}. Use the names of the \
         scene's photos, or import with the scene of these masks",
        shortened(photos),
        if named.is_empty() { "no photo".to_owned() } else { shortened(named) }
    );
    Err(Error::data(source, "", problem))
}

/// Fails with a description if no scale brings a mask to the photo's size. `what` has the given size.
pub(super) fn require_aspect(what: &str, size: (u32, u32), view: &View) -> Result<(), String> {
    let problem = aspect_problem((what, size), (&format!("its photo {}", view.name), view.camera.size()));
    problem.map_or(Ok(()), |problem| Err(problem + "; use masks of the same photos"))
}
