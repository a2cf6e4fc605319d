//! Writes several models into one file, with only one in memory at a time.

use super::write::{write_header, write_rows};
use crate::format::{Export, WriteOptions};
use labelgs_files::atomic;
use labelgs_scene::{Error, Gaussians, Result, Setting};
use std::io;
use std::path::Path;

/// Writes the models in `parts` as a single one, atomically; together they have `count` rows. All use the columns and
/// world origin of `like`, whose rows are ignored.
///
/// # Errors
///
/// Another number of rows, a part with other columns, or a part that cannot be read.
pub fn write_joined(
    path: &Path,
    like: &Gaussians,
    count: usize,
    parts: impl Iterator<Item = Result<Gaussians>>,
) -> Result<()> {
    let mut failed = None;
    let done = atomic::write(path, |out| {
        write_header(&export(like, &[], like), count, out)?;
        let mut written = 0;
        for part in parts {
            let part = match part.and_then(|part| fitting(part, like)) {
                Ok(part) => part,
                Err(error) => {
                    failed = Some(error);
                    return Err(io::Error::other("a part cannot be read"));
                }
            };
            let rows: Vec<usize> = (0..part.len()).collect();
            write_rows(&export(&part, &rows, like), out)?;
            written += rows.len();
        }
        if written != count {
            failed = Some(Error::Bug(format!("{written} rows were written, but {count} were announced")));
            return Err(io::Error::other("a wrong number of rows"));
        }
        Ok(())
    });
    // The error of a part says more than that the file is incomplete.
    failed.map_or(done, Err)
}

fn export<'a>(model: &'a Gaussians, rows: &'a [usize], like: &Gaussians) -> Export<'a> {
    Export { model, rows, names: None, origin: like.origin, options: WriteOptions::default(), title: "" }
}

/// Returns a part with the columns and the origin of `like`.
fn fitting(mut part: Gaussians, like: &Gaussians) -> Result<Gaussians> {
    if part.antialiased != like.antialiased {
        let problem = "is on for some of the models and off for others; train all alike, the coarse one too";
        return Err(Error::usage(Setting("antialias"), problem));
    }
    part.raise_degree(like.sh_degree);
    if part.origin != like.origin {
        let moved = |row: usize| (part.world(row) - like.origin).as_vec3().to_array();
        part.means = (0..part.len()).map(moved).collect();
        part.origin = like.origin;
    }
    let count = part.len();
    part.labels = like.labels.as_ref().map(|_| part.labels.take().unwrap_or_else(|| vec![0; count]));
    part.label_confidence =
        like.label_confidence.as_ref().map(|_| part.label_confidence.take().unwrap_or_else(|| vec![0.0; count]));
    Ok(part)
}

/// Joins all parts into one model.
pub fn joined(mut parts: Vec<Gaussians>) -> Result<Gaussians> {
    if parts.len() == 1 {
        return Ok(parts.remove(0));
    }
    let mut all = Gaussians {
        sh_degree: parts.iter().map(|part| part.sh_degree).max().unwrap_or_default(),
        origin: parts.first().map(|part| part.origin).unwrap_or_default(),
        antialiased: parts.iter().any(|part| part.antialiased),
        labels: parts.iter().any(|part| part.labels.is_some()).then(Vec::new),
        label_confidence: parts.iter().any(|part| part.label_confidence.is_some()).then(Vec::new),
        ..Gaussians::default()
    };
    for part in parts {
        all.append(fitting(part, &all)?);
    }
    Ok(all)
}
