//! Builds pass lists; all pass families use it.

use super::{KernelShape, Supervision};
use crate::pass::buffers::{Capacity, TABLE};
use crate::scheduler::plan::{Buf, Grid, PassDecl, PassList, Stage};
use crate::shaders::{ShaderDesc, constants};

/// A pass list under construction.
pub struct Builder<'a> {
    /// Shape of the kernels.
    pub shape: &'a KernelShape,
    /// Capacities, which determine recorded grids and limits.
    pub capacity: &'a Capacity,
    /// What the step compares with the view.
    pub supervision: Supervision,
    /// Active degree of the spherical harmonics.
    pub sh_degree: u32,
    /// True if the blend passes count the pairs with a weight.
    pub counts: bool,
    /// The step's row with the photo's exposure, if any.
    pub exposure: Option<u32>,
    /// First of the step's rows with the pose of its photo, if any.
    pub pose: Option<u32>,
    /// What a strategy adds to the update: bits `UPDATE_` of glsl/include/constants.glsl.
    pub update_modes: u32,
    /// Partial sums that the photo loss writes.
    pub loss_partials: u32,
    /// True if Gaussians may have missed updates, which readers must apply.
    pub late: bool,
    /// True if the projection also marks Gaussians that fog the camera (glsl/include/near.glsl); only where they may be
    /// late.
    pub marks_near: bool,
    /// Lists with more splats are processed forward with a workgroup per chunk; `None` if blends do not use chunks.
    pub long_list: Option<u32>,
    /// True if both moments of a parameter are packed into one word.
    pub half: bool,
    /// Passes of look-back sorts so far in this list.
    pub sort_passes: u32,
    /// Words of `Buf::LOOK_BACK` that passes of this list have so far; those of sorts come first.
    pub look_words: u64,
    /// The list so far.
    pub list: PassList,
}

/// The counter that gives the number of items of a scan or sort (glsl/include/count.glsl).
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

impl Count {
    /// Grid over the partitions of a look-back sort of keys.
    pub(super) fn partitions(self) -> Grid {
        args(if self == Self::Splats { constants::ARGS_SWEEP_SPLATS } else { constants::ARGS_SWEEP_INSTANCES })
    }
}

impl<'a> Builder<'a> {
    /// Makes an empty list with spherical harmonics of degree 0.
    pub fn new(name: &str, shape: &'a KernelShape, capacity: &'a Capacity) -> Self {
        let list = PassList { stage: Stage::PROJECT, ..PassList::new(name) };
        Self {
            shape,
            capacity,
            supervision: Supervision::Photo,
            sh_degree: 0,
            counts: false,
            exposure: None,
            pose: None,
            update_modes: 0,
            loss_partials: 0,
            late: false,
            marks_near: false,
            long_list: None,
            half: capacity.packs_moments(),
            sort_passes: 0,
            look_words: capacity.sweep_cells,
            list,
        }
    }

    /// Returns the number of dispatches for the longest tile list, at least 1.
    pub fn segments(&self) -> u32 {
        self.capacity.segments.max(1) as u32
    }

    /// Returns the first word of `Buf::LOOK_BACK` for the next pass, over partitions of 64 items or more.
    pub(super) fn next_look(&mut self, items: u64) -> u32 {
        let first = self.look_words;
        self.look_words += KernelShape::look_cells(items);
        assert!(self.look_words <= self.capacity.look_cells, "too many passes look back");
        first as u32
    }

    /// Appends a pass; [`pass!`](crate::pass) expands to this call. Skips buffers and constants that the variant lacks.
    /// A binding without a buffer gets the buffer of its name.
    ///
    /// # Panics
    ///
    /// If the kernel has no variant with these macros, or a binding neither a buffer nor a buffer's name.
    pub fn pass(
        &mut self,
        kernel: &'static [ShaderDesc],
        macros: &[(&'static str, u32)],
        buffers: &[(&str, Option<Buf>)],
        constants: &[(&str, u32)],
        grid: Grid,
    ) {
        let macros = macros.iter().filter(|(_, on)| *on != 0).map(|(name, _)| *name).collect();
        let shader = variant(kernel, macros, self.shape);
        let bound = |name| value(buffers, name).flatten().unwrap_or_else(|| own_buffer(shader, name));
        let buffers = shader.bindings.iter().map(|binding| bound(binding.name)).collect();
        let words = shader.spec.iter().filter_map(|constant| value(constants, constant.name)).collect();
        self.list.pass(PassDecl::new(shader, buffers, grid).spec(words));
    }
}

/// Finds the variant with these macros and those of the shape. Kernels without texel reads or subgroup operations
/// ignore these macros.
fn variant(kernel: &'static [ShaderDesc], mut macros: Vec<&str>, shape: &KernelShape) -> &'static ShaderDesc {
    let of_shape = [("ANTIALIASED", shape.antialiased), ("EMULATED", shape.emulated), ("TEXEL", shape.texel)];
    let known = |name| kernel.iter().any(|variant| variant.macros.contains(&name));
    macros.extend(of_shape.into_iter().filter(|&(name, on)| on && known(name)).map(|(name, _)| name));
    macros.sort_unstable();
    let found = kernel.iter().find(|variant| variant.macros == macros);
    found.unwrap_or_else(|| panic!("{} is not compiled with {macros:?}", kernel[0].name))
}

fn value<T: Copy>(named: &[(&str, T)], wanted: &str) -> Option<T> {
    named.iter().find(|(name, _)| *name == wanted).map(|(_, value)| *value)
}

/// The buffer of the engine with a binding's name.
fn own_buffer(shader: &ShaderDesc, name: &str) -> Buf {
    let row = TABLE.iter().position(|buffer| buffer.name == name);
    Buf(row.unwrap_or_else(|| panic!("{} binds {name}, and no buffer has this name", shader.name)) as u16)
}

/// An indirect grid, read from one of the `ARGS_` words of `dispatch_args`.
pub(crate) fn args(word: u32) -> Grid {
    Grid::Indirect(Buf::DISPATCH_ARGS, word * 4)
}

/// Grid over the Gaussians, 64 per workgroup.
pub(crate) fn over_gaussians() -> Grid {
    args(constants::ARGS_GAUSSIANS)
}

/// Grid over the visible splats, 64 per workgroup.
pub(crate) fn over_splats() -> Grid {
    args(constants::ARGS_SPLATS)
}

/// Grid of one workgroup.
pub(crate) const ONE_GROUP: Grid = Grid::Groups(1, 1, 1);

/// `pass!(builder, file(macro: bool, ..) { binding: BUF, .. } [constant: value, ..], grid)`: declares a kernel's pass.
///
/// Unnamed bindings get the buffers of their names. Constants without a value come from the shape or from the defaults
/// in GLSL; unnamed macros are off.
macro_rules! pass {
    ($b:expr, $file:ident $(($($macro:ident: $on:expr),*))? { $($name:ident: $buf:expr),* $(,)? }
        [$($constant:ident: $value:expr),* $(,)?], $grid:expr) => {{
        use $crate::shaders::$file as kernel;
        let shape = $b.shape;
        #[allow(clippy::needless_update)]
        let macros = kernel::Macros { $($($macro: $on,)*)? ..Default::default() };
        #[allow(clippy::needless_update)]
        let spec = kernel::Spec { $($constant: $value,)* ..kernel::Spec::with(|name| shape.constant(name)) };
        #[allow(clippy::needless_update)]
        let buffers = kernel::Bindings { $($name: Some($buf),)* ..Default::default() };
        $b.pass(&kernel::VARIANTS, &macros.named(), &buffers.named(), &spec.named(), $grid)
    }};
}
pub(crate) use pass;

#[cfg(test)]
mod tests {
    use super::{KernelShape, variant};
    use crate::shaders::blend_forward::VARIANTS;

    #[test]
    fn the_variant_has_the_macros_that_are_on() {
        let card = KernelShape::new(32, false);
        let cpu = KernelShape { texel: true, ..card };
        let emulated = KernelShape { emulated: true, ..cpu };
        let name = |macros: &[&'static str], shape| variant(&VARIANTS, macros.to_vec(), shape).name;
        assert_eq!(name(&[], &card), "blend_forward");
        assert_eq!(name(&["SEGMENTED", "LABELS"], &card), "blend_forward_labels_segmented");
        assert_eq!(name(&["MAIN"], &cpu), "blend_forward_main_texel");
        assert_eq!(name(&["MAIN"], &emulated), "blend_forward_main_emulated_texel");
        // No texel reads here, and no subgroup operations there.
        assert_eq!(variant(&crate::shaders::radix_scan::VARIANTS, Vec::new(), &emulated).name, "radix_scan_emulated");
        assert_eq!(variant(&crate::shaders::radix_count::VARIANTS, Vec::new(), &emulated).name, "radix_count_texel");
    }

    #[test]
    #[should_panic(expected = "blend_forward is not compiled with [\"LABELS\", \"MAIN\"]")]
    fn macros_that_no_variant_has_end_the_program() {
        variant(&VARIANTS, vec!["MAIN", "LABELS"], &KernelShape::new(32, false));
    }
}
