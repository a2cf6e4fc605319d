//! What every verb is given, and how it opens a model.

use super::args::GlobalArgs;
use crate::gpu::{Gpu, MessageLog};
use crate::scene::Gaussians;
use crate::{Error, Result};
use std::cell::RefCell;
use std::path::Path;

/// What every verb gets besides its own arguments.
#[derive(Clone, Debug, Default)]
pub struct Context {
    /// `-q`, `-v` and `--device`.
    pub global: GlobalArgs,
    /// `--json` before the verb.
    pub json: bool,
    /// What the validation layer says of the devices that were opened; they may be gone.
    messages: RefCell<Vec<MessageLog>>,
}

impl Context {
    /// For a command.
    pub fn new(global: GlobalArgs, json: bool) -> Self {
        Self { global, json, messages: RefCell::default() }
    }

    /// Listens to what the validation layer, if it was asked for, says of a device.
    pub fn listen(&self, gpu: &Gpu) {
        self.messages.borrow_mut().push(gpu.message_log());
    }

    /// An error if the layer has found a broken rule.
    pub fn check_rules(&self) -> Result<()> {
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

/// Reads a model, or the last one in the folder of a run, and logs what a person should know about the file.
pub fn open_model(path: &Path) -> Result<Gaussians> {
    let path = &if path.is_dir() { crate::run::models::latest_model(path)? } else { path.to_owned() };
    let read = crate::io::model::read_model(path)?;
    read.notes.iter().for_each(|note| tracing::warn!("{}: {note}", path.display()));
    Ok(read.gaussians)
}
