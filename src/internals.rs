//! What the program, its tests and its benchmarks reach into, and no user of the library needs. Anything here may change
//! from one version to the next.

#[cfg(feature = "cli")]
pub mod cli {
    pub use crate::cli::main;
    pub mod command {
        pub use crate::cli::command::{Cli, Command, command};
    }
    pub mod context {
        pub use crate::cli::support::context::open_model;
    }
    pub mod profile_compare {
        pub use crate::cli::commands::profile::compare::{Profile, compare};
    }
    pub mod scene {
        pub use crate::cli::support::scene::near_plane;
    }
    pub mod status {
        pub use crate::cli::support::exit_status::exit_status;
    }
    pub mod wording {
        pub use crate::cli::support::setting_names::flag;
    }
}
pub mod engine {
    pub use crate::engine::growth::capacity;
    pub use crate::engine::run::{ListKey, Report};
}
pub mod eval {
    pub mod boundary {
        pub use crate::eval::boundary::{boundary_iou, rim, rim_width};
    }
    pub mod crop {
        pub use crate::eval::crop::Crop;
    }
    pub mod specks {
        pub use crate::eval::specks::specks;
    }
    pub mod lpips {
        pub use crate::eval::lpips::{CHANNELS, STAGES, Weights};
        pub mod convolution {
            pub use crate::eval::lpips::convolution::{Layer, Planes, convolve, halve};
        }
        pub mod weights {
            pub use crate::eval::lpips::weights::read_tensors;
        }
    }
    pub mod metrics {
        pub use crate::eval::metrics::{Overlap, paper_score};
    }
    pub mod page {
        pub use crate::eval::page::Page;
    }
    pub mod protocol {
        pub mod score {
            pub use crate::eval::protocol::score::{Distance, Drawn};
        }
    }
    pub mod scores {
        pub use crate::eval::scores::{ObjectRender, ObjectTruth};
    }
    pub mod ssim {
        pub use crate::eval::ssim::{ssim_map, window};
    }
    pub mod ssim8 {
        pub use crate::eval::ssim8::{ssim8, to_bytes};
    }
}
pub mod records {
    pub mod block_file {
        pub use crate::records::block_file::{BlockFile, BlocksFile};
    }
    pub mod checkpoint {
        pub use crate::records::checkpoint::{Checkpoint, Plane, VERSION};
    }
    pub mod checkpoint_folder {
        pub use crate::records::checkpoint_folder::{Found, keep, list, next};
    }
}
pub mod label {
    pub mod masks {
        pub mod associate {
            pub use crate::label::masks::associate::{Owners, Segment, associate};
        }
        pub mod repair {
            pub use crate::label::masks::repair::{adopt, mend, name_groups, rename};
        }
    }
    pub mod occlusion {
        pub use crate::label::occlusion::draw::picture;
        pub use crate::label::occlusion::mean::distances;
    }
    pub mod vote {
        pub mod ballot {
            pub use crate::label::vote::ballot::{Ballot, Sweep, Voter, sweep};
        }
        pub mod decide {
            pub use crate::label::vote::decide::{Agreement, agreement, decide, trust};
        }
    }
}
pub mod pass {
    pub use crate::pass::{
        Builder, Extension, Hook, KernelShape, Stage, Supervision, Variant, densify_apply, densify_count,
        extended_step, label_view, opacity_reset, relocate_apply, relocate_count, render_view, training_step,
        vote_view, weigh_view,
    };
    pub mod build {
        pub use crate::pass::build::Count;
    }
    pub mod scan {
        pub use crate::pass::scan::{Total, scan, scan_visible};
    }
    pub mod sort {
        pub use crate::pass::sort::{SortBuffers, sort};
    }
    pub mod stage {
        pub use crate::pass::stage::stages;
    }
}
pub mod render {
    pub mod large {
        pub use crate::render::large::{Index, Painter, fits};
    }
}
pub mod run {
    pub use crate::run::train;
}
pub mod scheduler {
    pub use crate::scheduler::{ListId, Scheduler, SchedulerOptions};
    pub mod plan {
        pub use crate::scheduler::plan::{
            Buf, BufferDecl, Capacity, Class, Domain, Grid, Limits, MemoryReport, Page, PassDecl, PassList, Plan,
            PlanOptions, TABLE, TexelFormat, Use, Work,
        };
    }
}
pub mod shaders {
    pub use crate::shaders::{ALL, Access, BindingDesc, BindingKind, LocalSize, ShaderDesc, SpecDesc};
    pub mod constants {
        pub use crate::shaders::constants::{
            ALPHA_MAX, ALPHA_MIN, KEY_INVISIBLE, LOG2_ALPHA_MIN, NO_SPLAT, TRANSMITTANCE_MIN,
        };
    }
    pub mod structs {
        pub use crate::shaders::structs::{Counters, StepUniforms};
    }
}
pub mod train {
    pub use crate::train::alignment::aligned;
    pub use crate::train::refit::{REFIT_STEPS, refitted};
    pub use crate::train::setup::{TrainerOptions, engine_size};
    pub use crate::train::state::TrainState;
    pub use crate::train::{StepReport, Trainer, first_model};
    pub mod region {
        pub use crate::train::setup::region::Region;
    }
    pub mod poses {
        pub use crate::train::shared::poses::Poses;
    }
    pub mod exposure {
        pub use crate::train::shared::exposure::{Exposure, decided};
    }
    pub mod shared {
        pub use crate::train::shared::{Place, SharedLayout, SharedParameters};
    }
    pub mod step_input {
        pub use crate::train::input::step_input::{SceneScale, label_loss};
    }
    pub mod strategy {
        pub use crate::train::strategy::population::Population;
        pub use crate::train::strategy::weights::weights;
        pub use crate::train::strategy::{At, Strategy, of};
        pub mod adc {
            pub use crate::train::strategy::adc::resets_opacity_at;
        }
    }
}
pub mod verify {
    pub use crate::verify::{reference, selftest};
}
