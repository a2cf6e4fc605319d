//! A file of lines that grows during a run. Unlike all other outputs, it is written in place: a kill may leave an
//! incomplete last line, which readers drop.

use super::atomic::FaultyFile;
use labelgs_scene::lab::fault;
use labelgs_scene::{Error, Result};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The open file. A failed write leaves the file as it was.
#[derive(Debug)]
pub struct LineFile {
    path: PathBuf,
    file: File,
    bytes: u64,
}

impl LineFile {
    /// Opens or creates a file and keeps its first `bytes`.
    pub fn open(path: &Path, bytes: u64) -> Result<Self> {
        let open = || {
            fault::inject_file("write")?;
            let file = File::options().create(true).truncate(false).read(true).write(true).open(path)?;
            file.set_len(bytes)?;
            Ok(file)
        };
        let file = open().map_err(Error::write(path))?;
        Ok(Self { path: path.to_owned(), file, bytes })
    }

    /// Cuts the file to its first `bytes`.
    pub fn cut(&mut self, bytes: u64) -> Result<()> {
        self.file.set_len(bytes).map_err(Error::write(&self.path))?;
        self.bytes = bytes;
        Ok(())
    }

    /// Appends a line in a single write, so that other programs see it at once.
    pub fn add(&mut self, line: &str) -> Result<()> {
        let text = format!("{line}\n");
        let written = self.at_end().and_then(|()| FaultyFile(&self.file).write_all(text.as_bytes()));
        if let Err(error) = written {
            // Remove the partial line, which would corrupt the next one.
            let _ = self.file.set_len(self.bytes);
            return Err(Error::write(&self.path)(error));
        }
        self.bytes += text.len() as u64;
        Ok(())
    }

    /// Waits until all lines are on the disk. Recreates the file if it was deleted in the meantime.
    pub fn sync(&mut self) -> Result<()> {
        let mut all = || {
            if !self.path.exists() {
                self.file.seek(SeekFrom::Start(0))?;
                let mut bytes = Vec::new();
                self.file.read_to_end(&mut bytes)?;
                let again = File::options().create(true).truncate(true).read(true).write(true).open(&self.path);
                self.file = again?;
                self.file.write_all(&bytes)?;
            }
            self.file.sync_data()
        };
        all().map_err(Error::write(&self.path))
    }

    fn at_end(&mut self) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.bytes)).map(drop)
    }
}
