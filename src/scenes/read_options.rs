//! Settings for reading a run's scene.

use super::pose_convention::PoseConvention;
use labelgs_scene::options::Options;
use labelgs_scene::{Error, Result, Setting};

labelgs_scene::options! {
    /// The settings for the pixels that a run trains on and the views that it holds out.
    pub struct ReadOptions {
        "Scene" {
            /// Longest side of a photo, px; larger photos are shrunk, and 0 keeps all sizes.
            ///
            /// Smaller values are faster and lose fine texture. [default 0; the reference shrinks to a height of 1080]
            max_resolution <"PX">: u32 = 0, fixed;

            /// Every N-th view by name is held out.
            ///
            /// 0 trains on all views. A scene's own split takes precedence, except over 0. [default 8, as LabelGS and
            /// 3DGS]
            test_every <"N">: u32 = 8, fixed;

            /// Pose convention of the scene's file, if it deviates from its format.
            ///
            /// Comma-separated words: c2w or w2c (camera-to-world, world-to-camera), opencv or opengl (camera axes: y
            /// down and looking along z, or y up and looking along -z), and xyzw (quaternions with the real part last).
            poses <"WORDS">: PoseConvention = PoseConvention::default(), fixed;

            /// Train only the objects of the masks, without their surroundings.
            ///
            /// Use this for an object on a turntable, whose surroundings do not turn with it. The masks become the
            /// opacity of the photos, with soft edges free of background colour. Photos are cropped to their objects,
            /// and those without an object are omitted. Each step uses a random background colour (random_background).
            masked_only <"SWITCH">: bool = false, fixed;
        }
    }
}

impl ReadOptions {
    /// Refuses invalid values; messages name the option.
    pub fn check(&self) -> Result<()> {
        if self.test_every == 1 {
            let problem = "is 1, which leaves no view to train on; expected 2 or more, or 0 to hold out none";
            return Err(Error::usage(Setting("test_every"), problem));
        }
        self.check_ranges()
    }
}
