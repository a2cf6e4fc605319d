//! Labels from masks.

mod associate; // masks of one object in different views get one id
mod occlusion; // which object hides which
mod rules; // label rules of the paper, on the mirrors
mod track; // ids from frame to frame
mod votes; // labels from votes
