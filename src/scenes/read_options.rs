//! Settings for reading the scene of a run.

use super::pose_convention::PoseConvention;
use labelgs_scene::options::Options;
use labelgs_scene::{Error, Result, Setting};

labelgs_scene::options! {
    /// The settings for the pixels that a run trains on and the views that it holds out.
    pub struct ReadOptions {
        "Scene" {
            /// Longest side of a photo, px; larger photos are shrunk, 0 keeps all sizes.
            ///
            /// 0 (the reference shrinks to a height of 1080). Smaller values are faster and lose fine texture.
            max_resolution <"PX">: u32 = 0, fixed;

            /// Every N-th view by name is held out.
            ///
            /// 8 (LabelGS, 3DGS); 0 trains on all views. A scene with its own split keeps it, but for 0.
            test_every <"N">: u32 = 8, fixed;

            /// What the scene's file means by its poses, where it is not the convention of its format.
            ///
            /// Words of c2w or w2c (camera-to-world, world-to-camera), opencv or opengl (axes of the camera: y down and looking
            /// along z, or y up and looking along -z), and xyzw (quaternions whose real part is last), with commas between.
            poses <"WORDS">: PoseConvention = PoseConvention::default(), fixed;

            /// Train the objects of the masks alone, and nothing of their surroundings.
            ///
            /// For an object on a turntable, whose surroundings do not turn with it. The masks become the opacity of the photos,
            /// soft at the edges and without the colour of the surroundings there; photos are cut to their objects, those
            /// without an object are left out, and each step has a random colour behind them (random_background).
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
