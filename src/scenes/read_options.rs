//! Settings for reading a run's scene.

use super::pose_convention::PoseConvention;
use labelgs_scene::options::Options;
use labelgs_scene::{Error, Result, Setting};

labelgs_scene::options! {
    /// The settings for the pixels that a run trains on and the views that it holds out.
    pub struct ReadOptions {
        "Scene" {
            /// Longest side of a photo, px. Larger photos are shrunk; 0 keeps all sizes.
            ///
            /// Smaller values train faster and lose fine texture. The reference code shrinks to a height of 1080.
            max_resolution <"PX">: u32 = 0, fixed;

            /// Hold out every N-th view, by name, for scoring.
            ///
            /// 0 trains on all views. If the scene has a split of its own, other values keep that split. LabelGS and
            /// 3DGS use 8.
            test_every <"N">: u32 = 8, fixed;

            /// Pose convention of the scene file, if it differs from its format's convention.
            ///
            /// Comma-separated list of c2w or w2c (camera-to-world or world-to-camera), opencv or opengl (camera axes:
            /// y down, looking along z, or y up, looking along -z), and xyzw (quaternions with the real part last).
            poses <"WORDS">: PoseConvention = PoseConvention::default(), fixed;

            /// Train only the masked objects and ignore their surroundings.
            ///
            /// Use it for an object on a turntable, where the surroundings do not turn with the object. Masks become
            /// the opacity of the photos, with soft edges from which the surrounding colour is removed. Photos are
            /// cropped to their objects, and photos without an object are skipped. Each step uses a random background
            /// colour (random_background).
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
