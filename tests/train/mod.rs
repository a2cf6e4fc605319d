//! Trainings.

mod antialias; // least sizes of Gaussians, resumed trainings
mod backdrop; // transparent photos, random colours behind the scene
mod bands; // photos with more tiles than the device can walk
mod config; // schedules and ranges of the settings
pub mod exposure; // exposures of photos are trained, found and resumed
mod first_model; // how many Gaussians a training starts with, and where
mod free_space; // rules against fog spare things that are near
mod half; // packed moments: resumed trainings, memory, states
mod known_depths; // depths of points and maps in the loss, resumed trainings
mod late; // Gaussians that miss updates are where every step moves them
mod overflow; // a buffer that is too small costs a step and no bit
mod photo_memory; // photos and masks within a budget of memory give the same bits
mod poses; // poses of photos are refined, found and resumed
mod refit; // an object outside of its scene has opacities of its own
mod sentinel; // NaN and overflow are counted, dropped or end a run
mod shared; // parameters of the scene and of photos, trained beside the Gaussians
mod start_size; // steps on small photos equal those of a smaller scene
mod strategy; // strategies of densification other than the default
