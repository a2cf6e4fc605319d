//! A page that shows a model or a running training in a browser.
//!
//! [`Viewer::start`] opens a port on loopback. [`show`] serves a finished model and lets the page edit its labels.
//! [`ViewerObserver`] serves a training. The engine renders all images; the page only places them. Page, scripts and
//! styles are part of the program (`page/`), and nothing is loaded from the network.
//!
//! One thread owns the engine. `server` has a thread per connection, `hub` passes requests and frames between them:
//! the newest camera wins, one frame is in work and one on the wire. `guard` decides who may ask.

mod chosen;
mod drawing;
mod edits;
mod exports;
mod finder;
mod finished;
mod guard;
mod http;
mod hub;
mod message;
mod object;
mod pace;
mod page;
mod painter;
mod pictures;
mod portraits;
mod rows;
mod server;
mod session;
mod socket;
mod training;
mod views;

pub use finished::{FinishedModel, show};
pub use training::ViewerObserver;

use crate::error::Result;
use guard::Guard;
use hub::Hub;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Time for pages to receive the message that the server ends.
const FAREWELL_TIME_MAX: Duration = Duration::from_millis(500);

/// Where the server listens, and what viewing may cost.
#[derive(Clone, Debug)]
pub struct ViewerOptions {
    /// Name or address of the network interface.
    pub host: String,
    /// Port; 0 takes a free one.
    pub port: u16,
    /// The token that requests need.
    pub token: Token,
    /// Share of the time of a training that viewing may take, 0 to 1.
    pub share: f32,
}

/// The token of the printed address, which every request needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Token {
    /// A new one.
    New,
    /// This token, so that a page can reconnect to a restarted server: at least [`TOKEN_MIN`] letters, digits, `-` and
    /// `_`.
    Given(String),
    /// No token; only on loopback.
    Off,
}

/// Minimum length of a given token.
pub const TOKEN_MIN: usize = 16;

/// Commands of the program that pages show.
pub trait ProgramCommands: Sync {
    /// Returns the command that makes `output` of `model` by a list of edits.
    fn replay(&self, model: &Path, edits: &Path, output: &Path) -> String;
    /// Returns the command that shows a model.
    fn view(&self, model: &Path) -> String;
}

/// A server for pages.
pub struct Viewer {
    hub: Arc<Hub>,
    guard: Guard,
    options: ViewerOptions,
}

impl Viewer {
    /// Opens the port.
    ///
    /// # Errors
    ///
    /// A host that cannot be listened on; no token on a host that is not loopback; a token that is too short.
    pub fn start(options: &ViewerOptions) -> Result<Self> {
        let hub = Arc::new(Hub::default());
        let guard = server::start(&options.host, options.port, &options.token, &hub)?;
        Ok(Self { hub, guard, options: options.clone() })
    }

    /// The address to open, with the token.
    pub fn address(&self) -> String {
        self.guard.address()
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.hub.close(FAREWELL_TIME_MAX);
    }
}
