//! A training from a folder to a folder.

mod observer; // watching, pausing and stopping a run change no bit
mod report; // pages of runs, made anew and compared
