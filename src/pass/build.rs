//! What the pass families share while a list is put together.

use super::KernelShape;
use crate::scheduler::plan::{Buf, Capacity, Grid, PassDecl, PassList};
use crate::shaders::constants;

/// A list in the making.
pub struct Builder<'a> {
    /// Shape of the kernels.
    pub shape: &'a KernelShape,
    /// Capacities, for grids and limits that are recorded.
    pub capacity: &'a Capacity,
    /// The scene knows labels: object layers exist.
    pub labels: bool,
    /// Active degree of the spherical harmonics.
    pub sh_degree: u32,
    /// Blending counts the pairs that have a weight.
    pub counts: bool,
    /// The list.
    pub list: PassList,
}

/// Which number of items a scan or sort works on (glsl/include/count.glsl).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// All Gaussians.
    Gaussians = 0,
    /// Visible splats.
    Splats = 1,
    /// (splat, tile) pairs.
    Instances = 2,
    /// Tiles of all layers.
    VirtualTiles = 3,
}

impl Builder<'_> {
    /// Appends a pass.
    pub fn pass(&mut self, pass: PassDecl) {
        self.list.pass(pass);
    }
}

/// An indirect grid at one of the `ARGS_` words of `dispatch_args`.
pub fn args(word: u32) -> Grid {
    Grid::Indirect(Buf::DISPATCH_ARGS, word * 4)
}

/// Grid over the Gaussians, 64 a workgroup.
pub fn over_gaussians() -> Grid {
    args(constants::ARGS_GAUSSIANS)
}

/// Grid over the visible splats, 64 a workgroup.
pub fn over_splats() -> Grid {
    args(constants::ARGS_SPLATS)
}

/// Grid of one workgroup.
pub const ONE: Grid = Grid::Groups(1, 1, 1);

/// `pass!(builder, stem { binding: BUF, .. } [Spec fields], grid)`: declares a pass of the variant for the device.
#[macro_export]
macro_rules! pass {
    ($b:expr, texel $stem:ident { $($name:ident: $buf:expr),* $(,)? } [$($spec:ident: $value:expr),* $(,)?], $grid:expr) => {{
        use $crate::shaders::$stem as shader;
        let declared = $crate::scheduler::plan::PassDecl::new($b.shape.pick(&shader::BASE, &shader::TEXEL),
            shader::Bindings { $($name: $buf),* }.list(), $grid);
        $crate::pass!(@spec $b, declared, shader, [$($spec: $value),*])
    }};
    ($b:expr, $stem:ident { $($name:ident: $buf:expr),* $(,)? } [$($spec:ident: $value:expr),* $(,)?], $grid:expr) => {{
        use $crate::shaders::$stem as shader;
        let declared = $crate::scheduler::plan::PassDecl::new(&shader::BASE, shader::Bindings { $($name: $buf),* }.list(), $grid);
        $crate::pass!(@spec $b, declared, shader, [$($spec: $value),*])
    }};
    (@spec $b:expr, $declared:expr, $shader:ident, []) => { $b.pass($declared) };
    (@spec $b:expr, $declared:expr, $shader:ident, [$($spec:ident: $value:expr),+]) => {
        $b.pass($declared.spec(#[allow(clippy::needless_update)] $shader::Spec { $($spec: $value,)+ ..Default::default() }.words()))
    };
}
