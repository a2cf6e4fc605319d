//! Shared by commands: arguments, opening and writing of scenes and models, messages, exit statuses.

pub(crate) mod args;
pub(crate) mod context;
pub mod exit_status;
pub(crate) mod json_file;
pub(crate) mod label_choice;
pub(crate) mod label_sheet;
pub(crate) mod log;
pub(crate) mod model_drawer;
pub(crate) mod model_edit;
pub(crate) mod model_fit;
pub(crate) mod model_format;
pub(crate) mod nested_masks;
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
pub(crate) mod tables;

pub(crate) use args::{FileArgs, GlobalArgs, ReadArgs, SceneArgs};
pub(crate) use context::{Context, open_model};
pub(crate) use json_file::JsonFileArg;
pub(crate) use label_choice::{ChooseArgs, LabelQuery, PromptArgs};
pub(crate) use label_sheet::SheetArgs;
pub(crate) use log::Progress;
pub(crate) use model_drawer::{Drawer, MemoryArg, largest};
pub(crate) use model_edit::{EditArgs, EditResult, LabelledModel, MinConfidenceArg, TableArg, or_list, require_labels};
pub(crate) use model_fit::{warn_of_misfit, warn_of_misfit_with};
pub(crate) use model_format::WriteArgs;
pub(crate) use scene::{near_plane, open_gpu, open_gpu_for_long, open_scene, pick_views};
pub(crate) use scoring::{ScoreArgs, Watcher};
pub(crate) use shell_words::{quoted, quoted_path};
