//! File reading. Every reader opens and reads files through this module, so that [faults](labelgs_scene::lab::fault)
//! can be injected into all of them.

#![expect(clippy::disallowed_methods, reason = "the place that opens files for reading")]

use labelgs_scene::lab::fault;
use labelgs_scene::{Error, Result};
use serde::de::DeserializeOwned;
use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// An open file whose reads tests can make fail.
#[derive(Debug)]
pub struct Source(File);

impl Source {
    /// Wraps a file that is already open.
    pub fn from_file(file: File) -> Self {
        Self(file)
    }

    /// Returns the size of the file, bytes.
    pub fn length(&self) -> io::Result<u64> {
        Ok(self.0.metadata()?.len())
    }
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut once = || {
            let is_short = fault::inject_transfer("read")?;
            let most = if is_short { buffer.len().min(1) } else { buffer.len() };
            self.0.read(&mut buffer[..most])
        };
        loop {
            // Some decoders do not retry after a signal interrupts a read.
            match once() {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => return other,
            }
        }
    }
}

impl Seek for Source {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

fn source(path: &Path) -> io::Result<Source> {
    fault::inject_file("read")?;
    Ok(Source(File::open(path)?))
}

/// Opens a file for buffered reading.
pub fn open(path: &Path) -> Result<BufReader<Source>> {
    let file = source(path).map_err(Error::read(path))?;
    Ok(BufReader::with_capacity(1 << 16, file))
}

/// Reads a whole file.
pub fn bytes(path: &Path) -> Result<Vec<u8>> {
    let all = || {
        let mut file = source(path)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    all().map_err(Error::read(path))
}

/// Removes a UTF-8 byte order mark, which Windows editors write. Refuses UTF-16.
pub fn strip_byte_order_mark(path: &Path, text: &mut Vec<u8>) -> Result<()> {
    const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
    if text.starts_with(b"\xFF\xFE") || text.starts_with(b"\xFE\xFF") {
        return Err(Error::data(path, "", "is UTF-16 text; save it as UTF-8"));
    }
    if text.starts_with(BYTE_ORDER_MARK) {
        text.drain(..BYTE_ORDER_MARK.len());
    }
    Ok(())
}

/// Reads a UTF-8 text file without its byte order mark.
pub fn text(path: &Path) -> Result<String> {
    let mut bytes = bytes(path)?;
    strip_byte_order_mark(path, &mut bytes)?;
    String::from_utf8(bytes).map_err(|error| {
        Error::data(path, format!("byte {}", error.utf8_error().valid_up_to()), "is not UTF-8 text; save it as UTF-8")
    })
}

/// Reads a JSON file. `expected` describes the content in errors.
pub fn json<T: DeserializeOwned>(path: &Path, expected: &str) -> Result<T> {
    parse_json(path, text(path)?.as_bytes(), expected)
}

/// Like [`json`], from the bytes of a file.
pub fn parse_json<T: DeserializeOwned>(path: &Path, text: &[u8], expected: &str) -> Result<T> {
    serde_json::from_slice(text).map_err(|error| {
        let text = error.to_string();
        let (problem, _) = text.rsplit_once(" at line ").unwrap_or((&text, ""));
        // The parser quotes keys of the file, not settings.
        let problem = format!("{}; {expected}", problem.replace('`', "\""));
        Error::data(path, format!("line {}", error.line()), problem)
    })
}

/// Refuses a file with another layout version than the known one.
pub fn require_version(path: &Path, found: u32, known: u32) -> Result<()> {
    if found == known {
        return Ok(());
    }
    Err(Error::data(path, "schema_version", format!("has version {found}; labelgs reads {known}")))
}

/// Lists the paths in a folder, in no particular order.
pub fn folder(path: &Path) -> Result<Vec<PathBuf>> {
    let all = || {
        fault::inject_file("read")?;
        fs::read_dir(path)?.map(|entry| Ok(entry?.path())).collect::<io::Result<_>>()
    };
    all().map_err(Error::read(path))
}

/// Returns the memory that programs can still get without swapping, bytes, or `None` if the system does not report it.
pub fn free_memory() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib << 10)
}
