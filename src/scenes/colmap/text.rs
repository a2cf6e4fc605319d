//! The text files: one record per line; `#` starts a comment.

use super::model::{CameraRecord, ImageRecord, unknown_model};
use crate::lens;
use glam::{DVec2, DVec3};
use labelgs_files::read;
use labelgs_scene::{Error, Point, Result};
use std::io::{BufRead, Read, Seek, SeekFrom};
use std::path::Path;
use std::str::FromStr;

/// Reads the lines, numbered from 1.
fn lines(path: &Path) -> Result<impl Iterator<Item = Result<(usize, String)>>> {
    let file = read::open(path)?;
    let path = path.to_owned();
    let line = move |(index, line): (usize, std::io::Result<Vec<u8>>)| {
        let place = || format!("line {}", index + 1);
        let mut line = line.map_err(Error::read(&path))?;
        if index == 0 {
            read::strip_byte_order_mark(&path, &mut line)?;
        }
        let text = String::from_utf8(line);
        let text = text.map_err(|_| {
            Error::data(&path, place(), "is not UTF-8 text; save it as UTF-8, or export the model as text again")
        })?;
        Ok((index + 1, text))
    };
    Ok(file.split(b'\n').enumerate().map(line))
}

fn is_record(line: &str) -> bool {
    let line = line.trim();
    !line.is_empty() && !line.starts_with('#')
}

/// The words of a line, read in order.
struct LineWords<'a> {
    path: &'a Path,
    number: usize,
    rest: &'a str,
}

impl<'a> LineWords<'a> {
    fn error(&self, problem: impl Into<String>) -> Error {
        Error::data(self.path, format!("line {}", self.number), problem)
    }

    fn word(&mut self, what: &str) -> Result<&'a str> {
        let rest = self.rest.trim_start();
        if rest.is_empty() {
            return Err(self.error(format!("the line ends where {what} is expected")));
        }
        let (word, rest) = rest.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((rest, ""));
        self.rest = rest;
        Ok(word)
    }

    fn number<T: FromStr>(&mut self, what: &str) -> Result<T> {
        let word = self.word(what)?;
        word.parse().map_err(|_| self.error(format!("`{word}` is not a valid {what}")))
    }

    fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.number(what)?;
        }
        Ok(values)
    }
}

/// Reads a file with one record per line. Each invalid line is a separate error.
fn records<T>(path: &Path, read: impl Fn(LineWords) -> Result<T>) -> Result<Vec<Result<T>>> {
    let mut all = Vec::new();
    for line in lines(path)? {
        let (number, line) = line?;
        if is_record(&line) {
            all.push(read(LineWords { path, number, rest: line.trim() }));
        }
    }
    Ok(all)
}

pub(super) fn cameras(path: &Path) -> Result<Vec<CameraRecord>> {
    let all = records(path, |mut words| {
        let (id, name): (u32, _) = (words.number("camera id")?, words.word("a camera model")?);
        let unknown = || unknown_model(path, format!("line {}, camera {id}", words.number), &name);
        let model = lens::model(name).ok_or_else(unknown)?;
        let (width, height) = (words.number("width")?, words.number("height")?);
        let mut parameters = Vec::new();
        while !words.rest.trim().is_empty() {
            parameters.push(words.number("camera parameter")?);
        }
        Ok(CameraRecord { id, model, width, height, parameters })
    })?;
    all.into_iter().collect()
}

/// Returns true for the second line of an image: triples of numbers, or nothing.
fn is_observations(line: &str) -> bool {
    let mut count = 0;
    let is_number = |word: &str| {
        count += 1;
        word.parse::<f64>().is_ok()
    };
    line.split_ascii_whitespace().all(is_number) && count % 3 == 0
}

/// Returns true if the last line of a file has a line end.
fn is_terminated(path: &Path) -> Result<bool> {
    let mut last = [0];
    let mut file = read::open(path)?;
    file.seek(SeekFrom::End(-1)).and_then(|_| file.read_exact(&mut last)).map_err(Error::read(path))?;
    Ok(last == *b"\n")
}

/// Reads `images.txt`: two lines per image, the second with its observations, possibly empty. Programs that write only
/// poses omit the second line. Each unreadable row is a separate error, except for the last one of a truncated file.
pub(super) fn images(path: &Path, with_observations: bool) -> Result<Vec<Result<ImageRecord>>> {
    let mut all = Vec::new();
    let mut lines = lines(path)?.peekable();
    while let Some(line) = lines.next() {
        let (number, line) = line?;
        if !is_record(&line) {
            continue;
        }
        let second = match lines.peek() {
            Some(Ok((_, second))) if !is_observations(second) => None,
            _ => lines.next().transpose()?,
        };
        all.push(image(path, (number, line), second.filter(|_| with_observations)));
    }
    match all.pop() {
        Some(Err(error)) if !is_terminated(path)? => return Err(error),
        last => all.extend(last),
    }
    Ok(all)
}

/// Reads the image in a line, and its observations from the next one.
fn image(path: &Path, (number, line): (usize, String), observations: Option<(usize, String)>) -> Result<ImageRecord> {
    let mut words = LineWords { path, number, rest: line.trim() };
    let id = words.number("image id")?;
    let (quaternion, translation) = (words.numbers("rotation")?, words.numbers("translation")?);
    let camera = words.number("camera id")?;
    // The name is the rest of the line, because it may contain spaces.
    let name = words.rest.trim().to_owned();
    if name.is_empty() {
        return Err(words.error("the line ends where the image name is expected"));
    }
    let mut observed = Vec::new();
    if let Some((number, line)) = observations {
        let mut words = LineWords { path, number, rest: line.trim() };
        while !words.rest.trim().is_empty() {
            let pixel = DVec2::from_array(words.numbers("position in the photo")?);
            let point: i64 = words.number("point id")?;
            // -1: an image feature without a point.
            observed.extend(u64::try_from(point).ok().map(|point| (pixel, point)));
        }
    }
    Ok(ImageRecord { id, quaternion, translation, camera, name, observed })
}

/// Reads `points3D.txt` with the ids, without the tracks.
pub(super) fn points(path: &Path) -> Result<Vec<Result<(u64, Point)>>> {
    records(path, |mut words| {
        let id = words.number("point id")?;
        let position = DVec3::from_array(words.numbers("coordinate")?);
        let mut colour = [0u8; 3];
        for value in &mut colour {
            *value = words.number("colour from 0 to 255")?;
        }
        Ok((id, Point { position, colour }))
    })
}
