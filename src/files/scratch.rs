//! A temporary file for pixels that do not fit into memory.
//!
//! The file has no name where the system can do without: it is gone with the process, however that ends.

use super::atomic::Fallible;
use super::read::Source;
use labelgs_scene::lab::fault;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Where bytes begin in the file.
#[derive(Clone, Copy, Debug)]
pub struct Place(u64);

/// The file; none before the first bytes, and none after a failed write.
#[derive(Debug)]
pub struct Scratch {
    folder: PathBuf,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    file: Option<File>,
    end: u64,
    is_given_up: bool,
}

impl Scratch {
    /// Makes one whose file will be in `folder`.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), state: Mutex::default() }
    }

    /// Writes bytes at the end. `None` if the disk does not take them: then the file gives all of its space back, which the
    /// results of a run need more, and nothing is written any more. `otherwise` tells the user what happens then.
    pub fn put(&self, bytes: &[u8], otherwise: &str) -> Option<Place> {
        let mut state = self.lock();
        if state.is_given_up {
            return None;
        }
        match state.append(&self.folder, bytes) {
            Ok(place) => Some(place),
            Err(error) => {
                let folder = self.folder.display();
                tracing::warn!("{folder}: no space for what does not fit into memory ({error}); {otherwise}");
                *state = State { is_given_up: true, ..State::default() };
                None
            }
        }
    }

    /// Reads what was put at a place.
    pub fn read(&self, place: Place, into: &mut [u8]) -> io::Result<()> {
        // Reads take turns, because the file has one position.
        let state = self.lock();
        let file = state.file.as_ref().ok_or_else(|| io::Error::other("there is no file"))?;
        let mut source = Source::of(file.try_clone()?);
        source.seek(SeekFrom::Start(place.0))?;
        source.read_exact(into)
    }

    /// Returns true after a failed write.
    pub fn is_given_up(&self) -> bool {
        self.lock().is_given_up
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns the folder of the system for large temporary files: that of the environment, else the one on a disk.
pub fn system_folder() -> PathBuf {
    let on_disk = Path::new("/var/tmp");
    if std::env::var_os("TMPDIR").is_none() && on_disk.is_dir() { on_disk.to_owned() } else { std::env::temp_dir() }
}

impl State {
    fn append(&mut self, folder: &Path, bytes: &[u8]) -> io::Result<Place> {
        let mut file = match self.file.take() {
            Some(file) => file,
            None => {
                fault::of_file("write")?;
                std::fs::create_dir_all(folder)?;
                tempfile::tempfile_in(folder)?
            }
        };
        file.seek(SeekFrom::Start(self.end))?;
        Fallible(&file).write_all(bytes)?;
        self.file = Some(file);
        self.end += bytes.len() as u64;
        Ok(Place(self.end - bytes.len() as u64))
    }
}
