//! A temporary file for pixels that do not fit into memory.
//!
//! Where the system allows it, the file has no name and disappears with the process, however that ends.

use super::atomic::FaultyFile;
use super::read::Source;
use labelgs_scene::lab::fault;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Where an item starts in the file.
#[derive(Clone, Copy, Debug)]
pub struct ScratchOffset(u64);

/// The file. It does not exist before the first write or after a failed write.
#[derive(Debug)]
pub struct Scratch {
    folder: PathBuf,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    file: Option<File>,
    end: u64,
    has_failed: bool,
}

impl Scratch {
    /// Creates an empty scratch file in `folder`.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), state: Mutex::default() }
    }

    /// Appends bytes and returns their offset, or `None` if the disk is full. After such a failure the file is deleted,
    /// because the run needs the space for its results, and no more is written. `otherwise` tells the user what happens
    /// instead.
    pub fn put(&self, bytes: &[u8], otherwise: &str) -> Option<ScratchOffset> {
        let mut state = self.lock();
        if state.has_failed {
            return None;
        }
        match state.append(&self.folder, bytes) {
            Ok(place) => Some(place),
            Err(error) => {
                let folder = self.folder.display();
                tracing::warn!("{folder}: no space for data that does not fit into memory ({error}); {otherwise}");
                *state = State { has_failed: true, ..State::default() };
                None
            }
        }
    }

    /// Reads the bytes at an offset.
    pub fn read(&self, place: ScratchOffset, into: &mut [u8]) -> io::Result<()> {
        // Reads take turns, because the file has a single position.
        let state = self.lock();
        let file = state.file.as_ref().ok_or_else(|| io::Error::other("there is no file"))?;
        let mut source = Source::from_file(file.try_clone()?);
        source.seek(SeekFrom::Start(place.0))?;
        source.read_exact(into)
    }

    /// Returns true after a failed write.
    pub fn has_failed(&self) -> bool {
        self.lock().has_failed
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns the system's folder for large temporary files: the one from the environment, or else one on a disk.
pub fn system_folder() -> PathBuf {
    let on_disk = Path::new("/var/tmp");
    if std::env::var_os("TMPDIR").is_none() && on_disk.is_dir() { on_disk.to_owned() } else { std::env::temp_dir() }
}

impl State {
    fn append(&mut self, folder: &Path, bytes: &[u8]) -> io::Result<ScratchOffset> {
        let mut file = match self.file.take() {
            Some(file) => file,
            None => {
                fault::inject_file("write")?;
                std::fs::create_dir_all(folder)?;
                tempfile::tempfile_in(folder)?
            }
        };
        file.seek(SeekFrom::Start(self.end))?;
        FaultyFile(&file).write_all(bytes)?;
        self.file = Some(file);
        self.end += bytes.len() as u64;
        Ok(ScratchOffset(self.end - bytes.len() as u64))
    }
}
