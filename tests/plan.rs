//! The planner, without a GPU.
