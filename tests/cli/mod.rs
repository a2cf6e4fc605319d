//! The program, as it is typed.

mod commands; // commands with a device, from a made scene to pictures
mod devices; // a missing or poorer device is refused by name
pub mod edits; // labels are chosen and edited from the command line
mod faults; // failing calls, disks and memory lose no data
mod frames; // the video for a tracker, and its masks on the photos
mod kills; // killed exports leave whole files
mod labels; // labels of a model from masks, and masks from labels
mod long_training; // bit-identical results over 1,000 steps
mod masks; // import, check and spoil masks from the command line
mod motion; // cameras along a path and around an object, the sheet of labels
mod objects; // an object on a turntable, trained alone
#[cfg(unix)]
mod photos; // photos without poses and videos become scenes, or a message
mod resume; // killed, stopped and damaged runs resume to the same bits
mod segmenter; // from photos to an object, with a segmenter in Python
mod surroundings; // odd names, locales, closed streams, links, little memory
mod trained_models; // a trained model begins another training, or becomes simpler
mod usage; // flags, defaults, streams and exit statuses
mod words; // flags as they are typed, messages with flags of the command
