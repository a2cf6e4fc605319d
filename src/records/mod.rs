//! Files for later runs: checkpoints, blocks, occluders, compiled pipelines.

pub mod block_file;
pub mod checkpoint;
pub mod checkpoint_folder;
pub(crate) mod occlusion_table;
pub(crate) mod pipeline_file;

pub use occlusion_table::OcclusionTable;
pub use pipeline_file::PipelineFolder;
