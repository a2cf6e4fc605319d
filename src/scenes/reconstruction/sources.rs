//! The photos of a scene to be: those of a folder, or frames of a video.

use super::PHOTOS_MIN;
use super::progress::frame;
use super::workshop::Workshop;
use crate::photo_finder::{count_photos, is_readable, is_unreadable};
use labelgs_files::program::{FFMPEG, FFPROBE, Program};
use labelgs_files::{atomic, content, image, names, read};
use labelgs_scene::stage::Stage;
use labelgs_scene::words::counted;
use labelgs_scene::{Error, Result};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The photos in the folder of a workshop.
#[derive(Debug, Default)]
pub(super) struct Photos {
    /// Their names by width and height, px.
    pub(super) by_size: BTreeMap<(u32, u32), Vec<String>>,
    /// Names of photos that cannot be decoded, which are not in that folder.
    pub(super) damaged: Vec<String>,
    /// True if photos that follow each other by name overlap.
    pub(super) is_ordered: bool,
}

impl Photos {
    /// The names of those that can be decoded.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.by_size.values().flatten().map(String::as_str)
    }

    /// The number of all of them.
    pub(super) fn count(&self) -> usize {
        self.names().count() + self.damaged.len()
    }
}

/// Brings the photos into the folder of the workshop.
pub(super) fn gather(workshop: &mut Workshop) -> Result<Photos> {
    let source = workshop.request.source.as_path();
    let photos = if source.is_dir() { link_all(workshop, source)? } else { take_frames(workshop, source)? };
    let usable = photos.names().count();
    if usable < PHOTOS_MIN {
        let problem =
            format!("found {}{}; COLMAP needs {PHOTOS_MIN} or more", counted(usable, "photo"), others(source)?);
        return Err(Error::data(source, "", problem));
    }
    Ok(photos)
}

/// Says what else a folder holds that its user may have meant.
fn others(source: &Path) -> Result<String> {
    if !source.is_dir() {
        return Ok(String::new());
    }
    let entries = read::folder(source)?;
    let mut text = " that is a PNG or JPEG".to_owned();
    let mut unreadable: Vec<String> =
        entries.iter().filter(|path| is_unreadable(path)).map(|path| name(path)).collect();
    if !unreadable.is_empty() {
        unreadable.sort();
        text += &format!(
            ". {} must be converted to JPEG first: {}",
            counted(unreadable.len(), "file"),
            names::shortened(&unreadable)
        );
    }
    let counts = entries.iter().filter(|path| path.is_dir()).map(|folder| (count_photos(folder), folder));
    if let Some((count, folder)) = counts.max().filter(|&(count, _)| count > 0) {
        text += &format!(". {} holds {count}, and folders below are not read: name that folder", folder.display());
    }
    Ok(text)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Links the photos of a folder, or copies them to another disk.
fn link_all(workshop: &Workshop, source: &Path) -> Result<Photos> {
    let mut paths = read::folder(source)?;
    // macOS puts side files of this name on disks of other systems.
    paths.retain(|path| is_readable(path) && path.is_file() && !name(path).starts_with('.'));
    paths.sort();
    let stage = Stage::new("reading photos", paths.len());
    let (mut photos, images, mut first) = (Photos::default(), workshop.images(), None);
    for path in &paths {
        workshop.check()?;
        match image::photo_size(path) {
            Ok(size) => {
                place(path, &images.join(name(path)))?;
                photos.by_size.entry(size).or_default().push(name(path));
            }
            Err(error) => {
                photos.damaged.push(name(path));
                first.get_or_insert(error);
            }
        }
        stage.count();
    }
    if let Some(first) = first {
        tracing::warn!("{} left out, the first: {first}", counted(photos.damaged.len(), "photo"));
    }
    Ok(photos)
}

fn place(from: &Path, to: &Path) -> Result<()> {
    // A link to a symbolic link would lead elsewhere.
    let file = fs::canonicalize(from).map_err(Error::read(from))?;
    if fs::hard_link(&file, to).is_ok() {
        return Ok(());
    }
    let mut bytes = read::open(&file)?;
    atomic::write(to, |out| io::copy(&mut bytes, out).map(drop))
}

/// Takes frames of a video at equal distances.
fn take_frames(workshop: &mut Workshop, video: &Path) -> Result<Photos> {
    let content = content::identify_file(video)?.filter(|found| !found.what.starts_with("a video"));
    if let Some(content) = content {
        let problem = format!("is {}; expected a folder of photos or a video", content.what);
        return Err(Error::data(video, "", problem));
    }
    let (ffmpeg, ffprobe) = (installed(FFMPEG)?, installed(FFPROBE)?);
    let wanted = workshop.request.frames;
    let Motion { seconds, per_second } = probe(&ffprobe, video)?;
    // More than the video has would be copies.
    let rate = per_second.map_or(f64::INFINITY, |most| most).min(f64::from(wanted) / seconds);
    let mut command = Command::new(ffmpeg);
    command.args(["-hide_banner", "-loglevel", "error", "-nostdin", "-progress", "pipe:1", "-i"]).arg(video);
    command.args(["-vf", &format!("fps={rate}"), "-frames:v", &wanted.to_string(), "-qscale:v", "2"]);
    let images = workshop.images();
    command.arg(images.join("%05d.jpg"));
    workshop.must_run("taking frames", wanted as usize, command, &frame)?;
    let mut photos = Photos { is_ordered: true, ..Photos::default() };
    let mut frames = read::folder(&images)?;
    frames.sort();
    for path in &frames {
        photos.by_size.entry(image::photo_size(path)?).or_default().push(name(path));
    }
    Ok(photos)
}

fn installed(program: Program) -> Result<PathBuf> {
    program.find().ok_or_else(|| {
        let (name, how) = (program.name, program.how_to_install());
        let problem = format!(
            "no folder of it holds {name}, which reads videos. Install it ({how}), or name a folder of frames that \
             another program took"
        );
        Error::usage("PATH", problem)
    })
}

/// Length of a video, and its frames per second, if they are known.
struct Motion {
    seconds: f64,
    per_second: Option<f64>,
}

/// Asks for the length and rate of a video.
fn probe(ffprobe: &Path, video: &Path) -> Result<Motion> {
    let mut command = Command::new(ffprobe);
    command.args(["-v", "error", "-select_streams", "v:0", "-of", "json"]);
    command.args(["-show_entries", "stream=duration,avg_frame_rate:format=duration"]).arg(video);
    let output = command.stdin(Stdio::null()).output();
    let output = output.map_err(|error| Error::data(ffprobe, "", format!("cannot be run: {error}")))?;
    let told: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let stream = &told["streams"][0];
    let number = |value: &Value| value.as_str()?.parse().ok().filter(|&value: &f64| value.is_finite() && value > 0.0);
    // Matroska knows the length of the whole file only.
    let seconds = number(&stream["duration"]).or_else(|| number(&told["format"]["duration"]));
    let Some(seconds) = seconds.filter(|_| stream.is_object()) else {
        let said = String::from_utf8_lossy(&output.stderr);
        let said = said.lines().last().map_or(String::new(), |line| format!(" ({line})"));
        let problem = format!(
            "{} finds no video of a known length in it{said}; expected a folder of photos or a video",
            FFPROBE.name
        );
        return Err(Error::data(video, "", problem));
    };
    let ratio = |text: &str| {
        let (frames, seconds) = text.split_once('/')?;
        Some(frames.parse::<f64>().ok()? / seconds.parse::<f64>().ok()?).filter(|&rate| rate.is_finite() && rate > 0.0)
    };
    Ok(Motion { seconds, per_second: stream["avg_frame_rate"].as_str().and_then(ratio) })
}
