//! The viewer: what the server answers, and the page in a browser.

mod browser; // the page, driven by mouse and keys
mod choose; // Gaussians chosen by hand, without a browser and in one
mod chromium; // a browser and its DevTools protocol
mod events; // random events in the page
mod object; // an object from clicks, without a browser and in one
mod page_file; // the page with a model inside, in a browser
mod protocol; // the server, without a browser
mod server; // a viewer of a small model, and a page that only speaks the protocol
