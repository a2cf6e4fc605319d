//! What a training leaves for later ones.

mod checkpoint; // damage is found; old ones are removed
mod pipeline_file; // compiled pipelines are kept by device
