//! Atomic file writes: after a crash a file is the old one or the complete new one.

#![expect(clippy::disallowed_methods, reason = "the place that opens files for writing")]

use labelgs_scene::lab::fault;
use labelgs_scene::{Error, Result};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

const TEMPORARY_PREFIX: &str = ".labelgs-";
const TEMPORARY_SUFFIX: &str = ".tmp";

/// Writes `path` through `body`, atomically: fills, flushes and syncs a temporary file in the same folder, renames it,
/// and syncs the folder. Creates missing folders. Follows a symbolic link; writes to a device or pipe directly. On an
/// error, the previous file is untouched.
pub fn write(path: impl AsRef<Path>, body: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let path = path.as_ref();
    write_inner(path, body).map_err(Error::write(path))
}

/// Writes `path` as [`write()`] does, but `body` gets the name of the file to fill, for example for another program. A
/// pipe or device is an error.
pub fn write_by_name(path: impl AsRef<Path>, body: impl FnOnce(&Path) -> io::Result<()>) -> Result<()> {
    let path = path.as_ref();
    let place = || {
        let target = follow(path)?;
        if fs::metadata(&target).is_ok_and(|found| !found.is_file()) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"));
        }
        replace(&target, |temporary| body(temporary.path()))
    };
    place().map_err(Error::write(path))
}

/// Writes a value as indented JSON, atomically.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(|error| Error::Bug(format!("JSON: {error}")))?;
    write(path, |out| out.write_all(text.as_bytes()))
}

/// Removes a file if it exists.
pub fn remove(path: &Path) -> Result<()> {
    if path.is_file() { fs::remove_file(path).map_err(Error::write(path)) } else { Ok(()) }
}

/// Refuses a folder that is not empty, because readers would mix old and new files. A missing folder is fine.
/// `argument` is the flag that named it.
pub fn require_empty(argument: &str, folder: &Path) -> Result<()> {
    match fs::read_dir(folder) {
        Ok(mut entries) => match entries.next() {
            Some(_) => Err(Error::usage(argument, format!("{} is not empty; name a new folder", folder.display()))),
            None => Ok(()),
        },
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(Error::write(folder)(error)),
    }
}

fn write_inner(path: &Path, body: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let target = follow(path)?;
    match fs::metadata(&target) {
        Ok(found) if found.is_dir() => return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")),
        Ok(found) if !found.is_file() => return fill(&File::options().write(true).open(&target)?, body),
        _ => {}
    }
    replace(&target, |temporary| fill(temporary.as_file(), body))
}

/// Fills a temporary file with `fill` and renames it to `target`.
fn replace(target: &Path, fill: impl FnOnce(&tempfile::NamedTempFile) -> io::Result<()>) -> io::Result<()> {
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fault::inject_file("write")?;
    fs::create_dir_all(folder)?;
    clean_once(folder);
    fault::inject_file("write")?;
    let temporary = temporary_in(folder)?;
    fill(&temporary)?;
    fault::inject_file("write")?;
    temporary.as_file().sync_all()?;
    fault::inject_file("write")?;
    temporary.persist(target).map_err(|failed| failed.error)?;
    fault::inject_file("write")?;
    sync_folder(folder)
}

/// Resolves a chain of symbolic links, so that a rename replaces the file and not the link. The file may be missing.
/// The system's links to pipes (`/dev/stdout`) have no path to follow and stay as they are.
fn follow(path: &Path) -> io::Result<PathBuf> {
    let mut at = path.to_owned();
    // Linux follows at most as many.
    for _ in 0..40 {
        match (fs::symlink_metadata(&at), fs::metadata(&at)) {
            (Ok(found), target) if found.is_symlink() && target.as_ref().map_or(true, fs::Metadata::is_file) => {
                let link = fs::read_link(&at)?;
                at = at.parent().unwrap_or(Path::new("")).join(link);
            }
            _ => return Ok(at),
        }
    }
    Err(io::Error::other("it is a symbolic link that leads in a circle"))
}

fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let prefix = format!("{TEMPORARY_PREFIX}{}-", std::process::id());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(TEMPORARY_SUFFIX);
    #[cfg(unix)]
    {
        // The crate creates private files. Outputs are ordinary files, so the umask decides.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

fn fill(file: &File, body: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut buffered = BufWriter::with_capacity(1 << 18, FaultyFile(file));
    body(&mut buffered)?;
    // Dropping a BufWriter hides the error of its last write, so flush here.
    buffered.flush()
}

/// A file whose writes tests can make fail.
pub struct FaultyFile<'a>(pub &'a File);

impl Write for FaultyFile<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match fault::inject_transfer("write") {
            Ok(false) => self.0.write(bytes),
            Ok(true) => self.0.write(&bytes[..bytes.len().min(1)]),
            Err(error) => {
                if error.kind() == io::ErrorKind::StorageFull {
                    // A full disk accepts only a part of a write.
                    let _ = self.0.write(&bytes[..bytes.len() / 2]);
                }
                Err(error)
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Syncs a folder if possible. Some network and user file systems cannot sync folders, and some folders are writable
/// but not readable. The system then decides when the new name reaches the disk.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported | io::ErrorKind::PermissionDenied
            ) =>
        {
            Ok(())
        }
        other => other,
    }
}

#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> io::Result<()> {
    Ok(())
}

/// Minimum age of a temporary file before a command without a lock on the folder removes it. On a shared disk, its
/// process may run on another computer.
const STALE_AGE: Duration = Duration::from_secs(3600);

/// Removes temporary files of killed commands from a folder, at this process's first write there.
fn clean_once(folder: &Path) {
    static CLEANED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let is_new = CLEANED.lock().is_ok_and(|mut cleaned| cleaned.insert(folder.to_owned()));
    if is_new {
        remove_stale(folder, STALE_AGE);
    }
}

/// Removes temporary files that killed labelgs processes left in `folder` and that are at least `unchanged` old.
/// Returns their number. Keeps files of running processes, and all files on systems without `/proc`.
pub fn remove_stale(folder: impl AsRef<Path>, unchanged: Duration) -> usize {
    let processes = Path::new("/proc");
    if !processes.join("self").exists() {
        return 0;
    }
    let Ok(entries) = fs::read_dir(folder) else { return 0 };
    let stale = entries.flatten().filter(|entry| {
        let name = entry.file_name();
        let process = name
            .to_str()
            .and_then(|name| name.strip_prefix(TEMPORARY_PREFIX)?.strip_suffix(TEMPORARY_SUFFIX)?.split_once('-'))
            .and_then(|(process, _)| process.parse::<u32>().ok());
        let is_dead = process.is_some_and(|process| !processes.join(process.to_string()).exists());
        let age = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
        is_dead && (unchanged.is_zero() || age().is_some_and(|age| age >= unchanged))
    });
    stale.filter(|entry| fs::remove_file(entry.path()).is_ok()).count()
}
