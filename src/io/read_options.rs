//! How a run reads its scene.

use crate::error::{Error, Result};
use crate::options::Options;

crate::options::options! {
    /// What decides which pixels of a scene a run trains on, and which views are held out.
    pub struct ReadOptions {
        "Scene" {
            /// Longest side of a photo, px; 0 keeps its size.
            ///
            /// 0 (the reference shrinks to a height of 1080). Smaller is faster and loses fine texture.
            max_resolution <"PX">: u32 = 0, fixed;

            /// Every N-th view by name is held out.
            ///
            /// 8 (LabelGS, 3DGS); 0 trains on all. A scene with a split of its own keeps it.
            test_every <"N">: u32 = 8, fixed;
        }
    }
}

impl ReadOptions {
    /// Refuses values that make no sense; messages name the option.
    pub fn check(&self) -> Result<()> {
        if self.test_every == 1 {
            let problem = "is 1, which leaves no view to train on; expected 2 or more, or 0 to hold out none";
            return Err(Error::usage("test_every", problem));
        }
        self.check_ranges()
    }
}
