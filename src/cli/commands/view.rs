//! `labelgs view`, and the flags of `labelgs train --view`.

use crate::cli::support::model_edit::open;
use crate::cli::support::parsers::{near, share};
use crate::cli::support::scene::open_photos;
use crate::cli::support::{
    Context, SceneArgs, TableArg, near_plane, open_gpu, open_scene, quoted_path, signals, warn_of_misfit,
};
use crate::render::{Parts, RenderOptions};
use crate::run::models::first_view;
use crate::scene::Dataset;
use crate::scenes::camera_json::views_of_model;
use crate::viewer::{FinishedModel, ProgramCommands, Token, Viewer, ViewerOptions, show};
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Variable with the token to ask for instead of a new one.
const TOKEN_VARIABLE: &str = "LABELGS_VIEW_TOKEN";

/// `labelgs view`.
#[derive(Args, Clone, Debug)]
pub struct ViewArgs {
    /// Model: a PLY, SPZ, GLB, SOG, USD or .splat file, or the output folder of `labelgs train`.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene with views and photos for comparison.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Folder of id masks, to score label maps.
    #[arg(long, value_name = "DIR", requires = "scene")]
    pub masks: Option<PathBuf>,
    /// Folder of the segmentation network, as for `masks make`, to find objects by a click in the page.
    #[arg(long, value_name = "DIR", requires = "scene")]
    pub network: Option<PathBuf>,
    #[command(flatten)]
    pub table: TableArg,
    /// Near plane, world units; closer Gaussians are not drawn. Default: the value of the model's run, else 0.2.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
    #[command(flatten)]
    pub reading: SceneArgs,
    #[command(flatten)]
    pub server: ServerArgs,
}

/// Where the page of a viewer is.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Viewer")]
pub struct ServerArgs {
    /// Open the page in the default browser.
    #[arg(long)]
    pub open: bool,
    /// Address or name to listen on. On any address but loopback, everyone on the network who has the token can see the
    /// scene.
    #[arg(long, value_name = "HOST", default_value = "127.0.0.1")]
    pub view_host: String,
    /// Port to listen on; 0 takes a free port. If you set the port here and a token in LABELGS_VIEW_TOKEN, an open page
    /// reconnects when you restart the program.
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    pub view_port: u16,
    /// Do not require a token; loopback only. Other users of this machine can then see the scene.
    #[arg(long)]
    pub view_no_token: bool,
}

/// A viewer of a training.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Viewer")]
pub struct WatchArgs {
    /// Show the run in a browser and print the address. You can pause, save and stop the run there.
    #[arg(long)]
    pub view: bool,
    /// Maximum share of time that viewing may take while a page is open, 0 to 1.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.2)]
    pub view_share: f32,
    #[command(flatten)]
    pub server: ServerArgs,
}

impl ServerArgs {
    /// Starts the server, and the browser if that was asked for.
    pub(crate) fn start(&self, share: f32) -> Result<Viewer> {
        let given = std::env::var(TOKEN_VARIABLE).ok().filter(|token| !token.is_empty());
        let token = match given {
            _ if self.view_no_token => Token::Off,
            Some(token) => Token::Given(token),
            None => Token::New,
        };
        let options = ViewerOptions { host: self.view_host.clone(), port: self.view_port, token, share };
        let viewer = Viewer::start(&options)?;
        if self.view_host.parse::<IpAddr>().is_ok_and(|ip| ip.is_unspecified()) {
            tracing::info!(
                "on other machines, open this address with the name of this machine instead of the loopback address"
            );
        }
        if self.open {
            open_browser(&viewer.address());
        }
        Ok(viewer)
    }
}

/// Shows a model until a signal comes. Changes that are in no file are saved then.
pub(crate) fn run(args: &ViewArgs, context: &Context) -> Result<()> {
    let (model, known) = open(&args.model, &args.table)?;
    let dataset = match &args.scene {
        Some(scene) => {
            let mut reading = args.reading.of_run(&args.model)?;
            // Without masks, photos are shown as they are.
            reading.masked_only &= args.masks.is_some();
            open_scene(scene, &reading, args.masks.clone(), [0.0; 3], true)?
        }
        // Without their photos.
        None => Dataset { train: views_of_model(&args.model)?, ..Dataset::default() },
    };
    let photos = match (&args.scene, &args.network) {
        // Places are in pixels of whole photos, as in the commands that are shown.
        (Some(scene), Some(network)) => {
            let reading = SceneArgs { max_resolution: None, ..args.reading.clone() };
            Some(open_photos((&args.model, &model), (scene, &reading), network)?.0)
        }
        (Some(_), None) => {
            warn_of_misfit(&args.model, &model, &dataset)?;
            None
        }
        (None, _) => None,
    };
    // Where objects were trained alone, nothing else has a place in label maps: what is faint belongs to none.
    let clear_labels = args.reading.of_run(&args.model)?.masked_only;
    let options =
        RenderOptions { clear_labels, ..RenderOptions::new(near_plane(&args.model, args.near)?, Parts::COLOUR) };
    let gpu = open_gpu(context)?;
    let viewer = args.server.start(1.0)?;
    let address = viewer.address();
    context.show(&json!({ "schema_version": 1, "address": address }), &format!("{address}\n"))?;
    let near = args.near.map_or(String::new(), |near| format!(" --near {near}"));
    let words = TypedOptions {
        scene: args.scene.clone(),
        masks: args.masks.clone(),
        network: args.network.clone(),
        reading: args.reading.to_flags() + &near,
    };
    let (path, table, dataset) = (&args.model, known.table, &dataset);
    let first_view = first_view(path)?;
    let finished = FinishedModel { path, model, table, dataset, options, words: &words, photos, first_view };
    signals::note_only();
    let saved = show(&viewer, finished, gpu, &|| !signals::is_noted())?;
    if let Some(saved) = saved {
        tracing::warn!("unsaved edits are saved in {}; to continue, run: {}", saved.display(), words.view(&saved));
    }
    Err(Error::Interrupted)
}

/// Opens an address in the browser of the desktop. Without one the printed address is left.
fn open_browser(address: &str) {
    let (opener, before): (_, &[&str]) = if cfg!(windows) {
        ("rundll32", &["url.dll,FileProtocolHandler"])
    } else {
        (if cfg!(target_os = "macos") { "open" } else { "xdg-open" }, &[])
    };
    let mut command = Command::new(opener);
    command.args(before).arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    match command.spawn() {
        // The opener ends by itself; waiting for it leaves no dead process behind.
        Ok(mut child) => drop(std::thread::spawn(move || child.wait())),
        Err(error) => tracing::warn!("could not open a browser ({opener}: {error}); open the printed address yourself"),
    }
}

/// Commands as a user would type them.
pub(crate) struct TypedOptions {
    pub(crate) scene: Option<PathBuf>,
    pub(crate) masks: Option<PathBuf>,
    pub(crate) network: Option<PathBuf>,
    /// How the scene is read and drawn, as flags, each after a space.
    pub(crate) reading: String,
}

impl ProgramCommands for TypedOptions {
    fn replay(&self, model: &Path, edits: &Path, output: &Path) -> String {
        let scene = self.scene.as_ref().map_or(String::new(), |scene| format!(" --scene {}", quoted_path(scene)));
        let reading = &self.reading;
        format!(
            "labelgs edit {} --replay {}{scene}{reading} -o {}",
            quoted_path(model),
            quoted_path(edits),
            quoted_path(output)
        )
    }

    fn view(&self, model: &Path) -> String {
        let flag = |name: &str, value: &Option<PathBuf>| {
            value.as_ref().map_or(String::new(), |value| format!(" --{name} {}", quoted_path(value)))
        };
        let [scene, masks, network] = [("scene", &self.scene), ("masks", &self.masks), ("network", &self.network)]
            .map(|(name, value)| flag(name, value));
        format!("labelgs view {}{scene}{masks}{network}{}", quoted_path(model), self.reading)
    }
}
