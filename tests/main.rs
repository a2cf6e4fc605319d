//! Integration tests in one binary, built with the feature `lab`; `shipped.rs` tests the program as it ships.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

use labelgs::verify::reference;

#[allow(dead_code, reason = "not every helper is always in use")]
mod support;

#[global_allocator]
static MEMORY: support::memory::Counting = support::memory::Counting;

mod alone; // an object outside of its scene has opacities of its own
mod antialias; // least sizes of Gaussians, resumed trainings
mod architecture; // layers of the crate, file lengths, places of unsafe code
mod associate; // masks of one object in different views get one id
mod backdrop; // transparent photos, random colours behind the scene
mod bands; // photos with more tiles than the device can walk
mod blocks; // a scene in blocks: frozen Gaussians, split, trained, merged
mod capture; // faults of photos and poses are found before training
mod cards; // kernels compile for cards that are not there
mod city; // the made city is seen by several photos everywhere
mod cli; // flags, defaults, streams and exit statuses
mod cli_devices; // a missing or poorer device is refused by name
mod cli_edit; // labels are chosen and edited from the command line
mod cli_faults; // failing calls, disks and memory lose no data
mod cli_labels; // labels of a model from masks, and masks from labels
mod cli_long; // bit-identical results over 1,000 steps
mod cli_masks; // import, check and spoil masks from the command line
mod cli_surroundings; // odd names, locales, closed streams, links, little memory
mod cli_words; // flags as they are typed, messages with flags of the command
mod coarse; // steps on small photos equal those of a smaller scene
mod compare_self; // the comparisons of all other tests do fail
mod config; // schedules and ranges of the settings
mod decide; // labels from votes
mod densify; // the video for a tracker, and its masks on the photos
mod drivers; // every subgroup size, and drivers other than the usual one
mod edits; // labels by name, pixel and box; parts, specks and colours of a model
mod exposure; // exposures of photos are trained, found and resumed
mod fill; // the place of a removed object is closed
mod gradient; // gradients of the f64 mirrors, which the kernels are compared with
mod guide; // every command of README.md and of the guide runs
mod hostile; // damaged and hostile files are refused in bounded memory
mod invariants; // results do not depend on kernel shape, threads or a resume
mod io; // formats of scenes, masks, models and checkpoints
mod known; // failures that users of other trainers reported
mod known_depths; // depths of points and maps in the loss, resumed trainings
mod labels; // label rules of the paper, on the mirrors
mod large; // models larger than the memory of the device, ids beyond those of masks
mod lenses; // formulas of lenses, and a scene through each of them
mod metrics; // PSNR, SSIM, IoU and boundary scores
mod mirror_mutants; // a wrong constant in a mirror fails its checks
mod mirrors; // mirrors against closed forms and brute force
mod near_things; // rules against fog spare things that are near
mod observer; // watching, pausing and stopping a run change no bit
mod occlusion; // which object hides which
mod output; // files of rendered pictures
mod overflow; // a buffer that is too small costs a step and no bit
mod pass; // each kernel against its mirror
mod photo_memory; // photos and masks within a budget of memory give the same bits
mod photos; // what tools/photos refuses
mod poses; // poses of photos are refined, found and resumed
mod protocol; // scores of the published benchmarks
mod registry; // every shader has a header, a mirror and a pass
mod removal; // scores of removals, and filling from the command line
mod report; // pages of runs, made anew and compared
mod scheduler; // barriers, memory, faults and recorded lists of GPU work
mod segments; // long splat lists are cut to bounded dispatches
mod selftest; // `labelgs selftest` passes, and detects each fault
mod sentinel; // NaN and overflow are counted, dropped or end a run
mod shadergen; // the generator reports each fault of a shader
mod shared; // parameters of the scene and of photos, trained beside the Gaussians
mod strategy; // strategies of densification other than the default
mod stress; // error bounds on adversarial scenes
mod synth; // the made scene is consistent ground truth
mod tools; // help of scripts, arguments that they have not
mod track; // ids from frame to frame
mod viewer; // the server of the viewer, and its page in a browser
