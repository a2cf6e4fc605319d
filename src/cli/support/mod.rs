//! What commands share: arguments, how scenes and models are opened and written, messages, exit statuses.

pub(crate) mod args;
pub(crate) mod context;
pub mod exit_status;
pub(crate) mod label_choice;
pub(crate) mod log;
pub(crate) mod model_drawer;
pub(crate) mod model_edit;
pub(crate) mod model_fit;
pub(crate) mod model_format;
pub(crate) mod number_errors;
pub(crate) mod parsers;
pub mod scene;
pub(crate) mod scoring;
pub mod setting_names;
pub(crate) mod settings;
pub(crate) mod shell_words;
pub(crate) mod signals;
pub(crate) mod stage_progress;
pub(crate) mod stdout;
