//! Archives of uncompressed files, as in SOG and USDZ.

use labelgs_scene::{Error, Result};
use std::io::{self, Cursor, Read, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

pub(super) struct Archive<'a> {
    path: &'a Path,
    zip: ZipArchive<Cursor<&'a [u8]>>,
    length: u64,
}

impl<'a> Archive<'a> {
    /// Opens the archive in `bytes`; `format` is its name in errors.
    pub(super) fn open(path: &'a Path, bytes: &'a [u8], format: &str) -> Result<Self> {
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
            Error::data(
                path,
                "end of the archive",
                format!("{error}; this is not a {format} file, or it was cut short"),
            )
        })?;
        Ok(Self { path, zip, length: bytes.len() as u64 })
    }

    /// The archive's path.
    pub(super) fn path(&self) -> &'a Path {
        self.path
    }

    /// Returns the names of all entries in order.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        (0..self.zip.len()).filter_map(|index| self.zip.name_for_index(index))
    }

    /// Returns the bytes of an entry.
    pub(super) fn file(&mut self, name: &str) -> Result<Vec<u8>> {
        let bad = |problem: String| Error::data(self.path, name, format!("{problem}; export the file again"));
        let entry = self.zip.by_name(name).map_err(|error| bad(format!("cannot be found in the archive: {error}")))?;
        let mut bytes = Vec::new();
        // Entries are stored uncompressed.
        entry.take(self.length).read_to_end(&mut bytes).map_err(|error| bad(format!("cannot be unpacked: {error}")))?;
        Ok(bytes)
    }
}

/// Packs uncompressed files into an archive with a fixed date. Each starts at a multiple of `alignment` bytes.
pub(super) fn pack(files: Vec<(String, Vec<u8>)>, alignment: u16) -> io::Result<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default())
        .with_alignment(alignment);
    for (name, bytes) in files {
        zip.start_file(name, stored)?;
        zip.write_all(&bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}
