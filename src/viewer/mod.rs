//! A page that shows a model, or a training that runs, in a browser of this machine.
//!
//! [`Viewer::start`] opens a port on loopback. [`show`] serves a finished model, whose labels the page may
//! change; [`Watched`] is an observer that serves a training. The engine draws every picture; the page only places
//! them. Page, scripts and styles are in the program (`page/`), and nothing is fetched from elsewhere.
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

pub use finished::{Finished, show};
pub use training::Watched;

use crate::error::Result;
use guard::Guard;
use hub::Hub;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Time for pages to hear that the server ends.
const FAREWELL: Duration = Duration::from_millis(500);

/// Where the server listens, and what viewing may cost.
#[derive(Clone, Debug)]
pub struct ViewerOptions {
    /// Name or address of the network interface.
    pub host: String,
    /// Port; 0 takes a free one.
    pub port: u16,
    /// What a page has to know.
    pub token: Token,
    /// Share of the time of a training that viewing may take, 0 to 1.
    pub share: f32,
}

/// The token of the printed address, without which nobody sees anything.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Token {
    /// A new one.
    New,
    /// This one, so that a page comes back when its server does: letters, digits, `-` and `_`, at least
    /// [`TOKEN_MIN`] of them.
    Given(String),
    /// None is needed; only on loopback.
    Off,
}

/// Fewest characters of a token that is given.
pub const TOKEN_MIN: usize = 16;

/// The commands of the program, for the page to show.
pub trait Words: Sync {
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
        self.hub.close(FAREWELL);
    }
}
