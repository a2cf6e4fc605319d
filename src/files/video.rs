//! Encodes videos with ffmpeg, a separate program, so that no encoder is linked.

use super::atomic;
use super::program::FFMPEG;
use labelgs_scene::{Error, Result};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::{self, JoinHandle};

/// Name of the encoder program.
const ENCODER_NAME: &str = FFMPEG.name;
/// Most bytes kept of the encoder's messages.
const MESSAGE_BYTES_MAX: u64 = 4096;

/// Receives the pixels of the next frame, row-major.
pub type FrameSink<'a> = dyn FnMut(&[[u8; 3]]) -> Result<()> + 'a;

/// Finds the encoder on the search path. Call this before any expensive work.
pub fn find_encoder(path: &Path) -> Result<PathBuf> {
    FFMPEG.find().ok_or_else(|| {
        let problem = format!(
            "{ENCODER_NAME} makes videos, but is in no folder of PATH; install it ({}), or name a folder, which gets a PNG for \
             each frame",
            FFMPEG.how_to_install()
        );
        Error::write(path)(io::Error::new(ErrorKind::NotFound, problem))
    })
}

/// Writes an MP4 atomically. `draw` supplies the frames in order. The size, px, has even sides. Colours are stored at
/// half the width and height (yuv420p), which every player supports.
pub fn write(
    path: &Path,
    size: (u32, u32),
    per_second: f64,
    draw: impl FnOnce(&mut FrameSink) -> Result<()>,
) -> Result<()> {
    let program = find_encoder(path)?;
    if !(size.0.is_multiple_of(2) && size.1.is_multiple_of(2)) {
        return Err(Error::Bug(format!("a video of {} x {} px; sides must be even", size.0, size.1)));
    }
    let mut failed = None;
    let done = atomic::write_by_name(path, |file| {
        let mut encoding = Encoding::start(&program, file, size, per_second)?;
        let mut is_broken = false;
        let drawn = draw(&mut |pixels| {
            let pushed = encoding.push(pixels);
            is_broken = pushed.is_err();
            pushed.map_err(Error::write(path))
        });
        // An encoder that accepts no more frames has reported why.
        match drawn {
            Err(error) if !is_broken => {
                failed = Some(error);
                Err(io::Error::other("a frame was not drawn"))
            }
            _ => encoding.finish(),
        }
    });
    failed.map_or(done, Err)
}

/// A running encoder, which is stopped if it is dropped early.
struct Encoding {
    child: Child,
    frames: Option<ChildStdin>,
    said: Option<JoinHandle<Vec<u8>>>,
}

impl Encoding {
    fn start(program: &Path, file: &Path, (width, height): (u32, u32), per_second: f64) -> io::Result<Self> {
        let mut command = Command::new(program);
        command.args(["-hide_banner", "-loglevel", "error", "-nostdin", "-y"]);
        command.args(["-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", &format!("{width}x{height}")]);
        command.args(["-framerate", &per_second.to_string(), "-i", "pipe:0"]);
        command.args(["-an", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"]).arg(file);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| {
            io::Error::new(error.kind(), format!("{} cannot be started: {error}", program.display()))
        })?;
        let frames = child.stdin.take();
        // Read the messages at once, so that the encoder never blocks on them.
        let said = child.stderr.take().map(|mut from| {
            thread::spawn(move || {
                let mut text = Vec::new();
                let _ = (&mut from).take(MESSAGE_BYTES_MAX).read_to_end(&mut text);
                let _ = io::copy(&mut from, &mut io::sink());
                text
            })
        });
        Ok(Self { child, frames, said })
    }

    fn push(&mut self, pixels: &[[u8; 3]]) -> io::Result<()> {
        self.frames.as_mut().map_or(Ok(()), |to| to.write_all(pixels.as_flattened()))
    }

    /// Waits for the encoder to finish.
    fn finish(&mut self) -> io::Result<()> {
        // Close the input: no more frames follow.
        self.frames = None;
        let status = self.child.wait()?;
        let said = self.said.take().and_then(|said| said.join().ok()).unwrap_or_default();
        if status.success() {
            return Ok(());
        }
        let said = String::from_utf8_lossy(&said).split_whitespace().collect::<Vec<_>>().join(" ");
        Err(io::Error::other(format!("{ENCODER_NAME} failed ({status}): {said}")))
    }
}

impl Drop for Encoding {
    fn drop(&mut self) {
        self.frames = None;
        // If the child has already ended, both calls have no effect.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
