//! Other programs: where they are, how they are installed, and runs of them whose messages go to a file.

use super::append::LineFile;
use labelgs_scene::{Error, Result};
use std::collections::VecDeque;
use std::env;
use std::io::{self, BufRead, BufReader, PipeReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// A program that labelgs calls and that is not a part of it.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    /// Its name on the search path, without the extension of Windows.
    pub name: &'static str,
    /// The package that holds it, on Debian, Ubuntu and macOS.
    package: &'static str,
    /// What to do on Windows.
    windows: &'static str,
}

/// Encodes and decodes videos.
pub const FFMPEG: Program = Program { name: "ffmpeg", package: "ffmpeg", windows: "winget install ffmpeg" };
/// Tells length and kind of videos.
pub const FFPROBE: Program = Program { name: "ffprobe", ..FFMPEG };
/// Finds poses of photos.
pub const COLMAP: Program = Program {
    name: "colmap",
    package: "colmap",
    windows: "unpack the Windows package of https://github.com/colmap/colmap/releases and add its folder bin to PATH",
};

impl Program {
    /// Returns the program on the search path.
    pub fn find(&self) -> Option<PathBuf> {
        let extensions = if cfg!(windows) { &["exe", "bat"][..] } else { &[""] };
        let folders = env::var_os("PATH").unwrap_or_default();
        env::split_paths(&folders)
            .flat_map(|folder| extensions.iter().map(move |extension| folder.join(self.name).with_extension(extension)))
            .find(|file| file.is_file())
    }

    /// Returns how it is installed, on each system.
    pub fn how_to_install(&self) -> String {
        let Self { package, windows, .. } = self;
        format!("Debian and Ubuntu: apt-get install {package}; macOS: brew install {package}; Windows: {windows}")
    }
}

/// Last lines of a program that an error quotes.
const LAST_MAX: usize = 15;
/// Time between two looks at a silent program.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Returns whether to go on, or the error that ends the work.
pub type Check<'a> = dyn Fn() -> Result<()> + 'a;

/// A file with the messages of programs.
#[derive(Debug)]
pub struct ProgramLog {
    lines: LineFile,
    /// The last of them.
    last: VecDeque<String>,
}

impl ProgramLog {
    /// Makes the file.
    pub fn new(path: &Path) -> Result<Self> {
        Ok(Self { lines: LineFile::open(path, 0)?, last: VecDeque::new() })
    }

    /// Runs a program to its end. `hear` gets each line of its two outputs. Where `check` fails, the program is ended.
    pub fn run(&mut self, mut command: Command, hear: &mut dyn FnMut(&str), check: &Check) -> Result<ExitStatus> {
        self.last.clear();
        self.lines.add(&format!("$ {command:?}"))?;
        let name = PathBuf::from(command.get_program());
        let failed = |error: io::Error| Error::data(&name, "", format!("cannot be run: {error}"));
        let (reader, writer) = io::pipe().map_err(failed)?;
        command.stdin(Stdio::null()).stdout(writer.try_clone().map_err(failed)?).stderr(writer);
        let mut running = Running(command.spawn().map_err(failed)?);
        // The ends of the pipe that this process holds.
        drop(command);
        let lines = lines_of(reader);
        loop {
            match lines.recv_timeout(LOOK_EVERY) {
                Ok(line) => {
                    hear(&line);
                    self.keep(line)?;
                }
                Err(RecvTimeoutError::Disconnected) => break,
                // A program that this one started may hold the pipe for longer.
                Err(RecvTimeoutError::Timeout) if running.0.try_wait().map_err(failed)?.is_some() => break,
                Err(RecvTimeoutError::Timeout) => {}
            }
            check()?;
        }
        let status = running.0.wait().map_err(failed)?;
        if !status.success() {
            // Ctrl-C ends the program too, perhaps before this process has noted the signal.
            thread::sleep(LOOK_EVERY);
            check()?;
        }
        Ok(status)
    }

    fn keep(&mut self, line: String) -> Result<()> {
        self.lines.add(&line)?;
        self.last.truncate(LAST_MAX - 1);
        self.last.push_front(line);
        Ok(())
    }

    /// Returns the last lines of the last program, for the end of a message.
    pub fn last_lines(&self) -> String {
        let told = self.last.iter().rev().filter(|line| !line.trim().is_empty());
        told.map(|line| format!("\n  {}", line.trim_end())).collect()
    }
}

/// Reads lines on a thread of their own, so that a silent program can be ended.
fn lines_of(reader: PipeReader) -> Receiver<String> {
    let (sender, lines) = mpsc::channel();
    thread::spawn(move || {
        let mut reader = BufReader::new(reader);
        let mut line = Vec::new();
        while reader.read_until(b'\n', &mut line).is_ok_and(|count| count > 0) {
            let text = String::from_utf8_lossy(&line).trim_end().to_owned();
            if sender.send(text).is_err() {
                break;
            }
            line.clear();
        }
    });
    lines
}

/// A running program, which is ended if it is dropped before its end.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Of a child that has ended already, both do nothing.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
