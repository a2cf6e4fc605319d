//! The folder in which a scene is made, and the programs that run there.

use super::Request;
use labelgs_files::atomic;
use labelgs_files::program::{Check, ProgramLog};
use labelgs_scene::stage::Stage;
use labelgs_scene::{Error, Result, Setting};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use tempfile::TempDir;

/// The messages of all programs, in the scene.
const LOG_FILE: &str = "colmap.log";
/// A file of COLMAP with paths of the folder that is gone then.
const PROJECT_FILE: &str = "project.ini";

/// A folder beside the scene. It is removed with all that is in it, however the work ends.
pub(super) struct Workshop<'a> {
    pub(super) request: &'a Request,
    pub(super) colmap: PathBuf,
    check: &'a Check<'a>,
    folder: TempDir,
    log: ProgramLog,
}

/// Turns a line of a program into the number of items that are done.
pub(super) type Hear<'a> = &'a dyn Fn(&str) -> Option<usize>;

impl<'a> Workshop<'a> {
    pub(super) fn new(request: &'a Request, colmap: PathBuf, check: &'a Check<'a>) -> Result<Self> {
        let scene = std::path::absolute(&request.scene).map_err(Error::write(&request.scene))?;
        let (Some(parent), Some(name)) = (scene.parent(), scene.file_name()) else {
            return Err(Error::usage(Setting("output"), format!("{} is no new folder", scene.display())));
        };
        fs::create_dir_all(parent).map_err(Error::write(parent))?;
        let mut prefix = OsStr::new(".").to_owned();
        prefix.push(name);
        prefix.push("-");
        let folder = tempfile::Builder::new().prefix(&prefix).suffix(".tmp").tempdir_in(parent);
        let folder = folder.map_err(Error::write(parent))?;
        let scene = folder.path().join("scene");
        for made in [scene.join("images"), scene.join("sparse")] {
            fs::create_dir_all(&made).map_err(Error::write(&made))?;
        }
        let log = ProgramLog::new(&scene.join(LOG_FILE))?;
        Ok(Self { request, colmap, check, folder, log })
    }

    /// The folder of the photos.
    pub(super) fn images(&self) -> PathBuf {
        self.path("scene/images")
    }

    /// A path in the folder.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Makes a folder in it.
    pub(super) fn make_folder(&self, name: &str) -> Result<PathBuf> {
        let path = self.path(name);
        fs::create_dir(&path).map_err(Error::write(&path))?;
        Ok(path)
    }

    /// Fails if the work was interrupted.
    pub(super) fn check(&self) -> Result<()> {
        (self.check)()
    }

    /// Runs a program and shows its progress over `total` items, 0 for an unknown number. Returns true if it succeeded.
    pub(super) fn run(&mut self, what: &str, total: usize, command: Command, hear: Hear) -> Result<bool> {
        let (start, stage) = (Instant::now(), Stage::new(what, total));
        let hear = &mut |line: &str| hear(line).into_iter().for_each(|done| stage.reach(done.min(total)));
        let status = self.log.run(command, hear, self.check)?;
        drop(stage);
        tracing::info!("{what} took {:.1} s", start.elapsed().as_secs_f64());
        Ok(status.success())
    }

    /// Runs a program that must succeed.
    pub(super) fn must_run(&mut self, what: &str, total: usize, command: Command, hear: Hear) -> Result<()> {
        let program = PathBuf::from(command.get_program());
        let verb = command.get_args().next().unwrap_or_default().to_string_lossy().into_owned();
        if self.run(what, total, command, hear)? {
            return Ok(());
        }
        // Only COLMAP has verbs.
        let verb = if verb.starts_with('-') { String::new() } else { verb };
        let problem = format!("failed; the last lines of {}:{}", program.display(), self.last_lines());
        Err(Error::data(&self.request.source, format!("{what} {verb}").trim_end(), problem))
    }

    /// The last lines of the last program, for the end of a message.
    pub(super) fn last_lines(&self) -> String {
        self.log.last_lines()
    }

    /// A command of COLMAP.
    pub(super) fn command(&self, verb: &str) -> Command {
        let mut command = Command::new(&self.colmap);
        // No display is needed.
        command.arg(verb).env("QT_QPA_PLATFORM", "offscreen");
        command
    }

    /// Puts the model into the scene, and the scene into its place.
    pub(super) fn finish(self, model: &Path) -> Result<()> {
        atomic::remove(&model.join(PROJECT_FILE))?;
        let (made, scene) = (self.path("scene"), &self.request.scene);
        let place = made.join("sparse/0");
        fs::rename(model, &place).map_err(Error::write(&place))?;
        if scene.is_dir() {
            // Empty, as was checked.
            fs::remove_dir(scene).map_err(Error::write(scene))?;
        }
        fs::rename(&made, scene).map_err(Error::write(scene))
    }
}
