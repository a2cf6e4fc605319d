//! Scenes that are made to break arithmetic, each with the bound that it is held to and why.

mod adversaries;
mod places;
