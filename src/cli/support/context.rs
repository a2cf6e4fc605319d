//! The context of every command, and how a command opens a model.

use crate::cli::support::args::GlobalArgs;
use crate::cli::support::stdout;
use crate::gpu::{Gpu, GpuOptions, MessageLog};
use crate::records::PipelineFolder;
use crate::run::models;
use crate::scene::Gaussians;
use crate::{Error, Result};
use serde::Serialize;
use std::cell::RefCell;
use std::path::Path;

/// Input of every command besides its own arguments.
#[derive(Clone, Debug, Default)]
pub(crate) struct Context {
    /// `-q`, `-v` and `--device`.
    pub(crate) global: GlobalArgs,
    /// `--json` before or after the name of the command.
    pub(crate) json: bool,
    /// Messages of the validation layer about every opened device, also after the device is closed.
    messages: RefCell<Vec<MessageLog>>,
}

impl Context {
    /// Returns a context without devices.
    pub(crate) fn new(global: GlobalArgs, json: bool) -> Self {
        Self { global, json, messages: RefCell::default() }
    }

    /// Returns the options of the device that the user chose.
    pub(crate) fn gpu_options(&self) -> Result<GpuOptions> {
        let options = GpuOptions::from_env()?;
        let device = self.global.device.clone().or(options.device);
        Ok(GpuOptions { device, locks: Some(PipelineFolder::locks_folder()), ..options })
    }

    /// Prints the result of a command.
    pub(crate) fn show(&self, json: &impl Serialize, text: &str) -> Result<()> {
        if self.json { stdout::print_json(json) } else { stdout::print(text) }
    }

    /// Collects the messages of the validation layer about a device.
    pub(crate) fn listen(&self, gpu: &Gpu) {
        self.messages.borrow_mut().push(gpu.message_log());
    }

    /// Fails if the validation layer reported an error.
    pub(crate) fn check_rules(&self) -> Result<()> {
        let all: Vec<_> = self.messages.borrow().iter().flat_map(MessageLog::messages).collect();
        let count = all.iter().filter(|message| message.is_error).count();
        match all.into_iter().find(|message| message.is_error) {
            None => Ok(()),
            Some(first) => Err(Error::Bug(format!(
                "the validation layer found {count} broken rules, the first is {}: {}",
                first.id, first.text
            ))),
        }
    }
}

/// Reads a model, or the last model in the folder of a run, and logs the notes of the reader.
pub(crate) fn open_model(path: &Path) -> Result<Gaussians> {
    models::open(path).map(|read| read.gaussians)
}
