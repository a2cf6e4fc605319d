//! Kernel shape of a device: subgroups, tile size, texel or storage reads, digit width of the sort.

use crate::error::{Error, Result};
use crate::gpu::{Capabilities, SUBGROUP_MAX, SUBGROUP_MIN};
use crate::lab;
use crate::shaders::constants::{
    LABEL_BORDER, ORDERED_LANES, SWEEP_LANES, SWEEP_STRIDE, SWEEP_WORDS, VISIBLE_ITEMS_MIN, VISIBLE_ITEMS_MOST,
};
use crate::shaders::{self, ShaderDesc, emit_ordered, group_backward, group_forward, project_visible, update};
use std::borrow::Cow;

/// Shape of the kernels: fixed for a device, except for fields that depend on the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KernelShape {
    /// Invocations per subgroup: 4, 8, 16, 32 or 64.
    pub subgroup: u32,
    /// Subgroup operations are emulated in shared memory, for any subgroup size.
    pub emulated: bool,
    /// Tile width, px.
    pub tile_width: u32,
    /// Tile height, px.
    pub tile_height: u32,
    /// Frequent reads use texel buffers.
    pub texel: bool,
    /// Bits per digit of the radix sort.
    pub digit_bits: u32,
    /// Items per invocation in look-back sorts (one dispatch per pass); 0 with several dispatches per pass.
    pub sweep_items: u32,
    /// Look-back sorts use 16-bit tile keys if all tiles of all layers fit.
    pub narrow_keys: bool,
    /// Tile side of the single-dispatch photo loss, px; 0 with a dispatch per filter.
    pub loss_tile: u32,
    /// Mask pixels on the device have 16 bits.
    pub narrow_labels: bool,
    /// Splats are listed, projected and numbered by look-back passes (glsl/include/look_back.glsl). Workgroups
    /// distribute the tiles of their splats, and the records of splats with many tiles, among their invocations;
    /// otherwise one invocation processes all tiles of a splat.
    pub group_walks: bool,
    /// Workgroup blends, as on GPUs; `None` for one subgroup per tile.
    pub group_blend: Option<GroupBlend>,
    /// How a step updates the parameters.
    pub update: Update,
    /// Looks of a workgroup at counts that are not there yet; then it counts for the workgroups that are late.
    pub looks: u32,
    /// Minimum number of workgroups of the sort and scan passes.
    pub lane_groups: u32,
    /// Splats per tile that one blend dispatch processes; a multiple of the subgroup size.
    pub segment_length: u32,
    /// Most loop iterations per invocation, with a small reserve; `None` without a limit.
    pub loop_rounds: Option<u32>,
    /// Blur reduces the opacity of splats, if the model on the device needs it
    /// ([`Gaussians::antialiased`](crate::scene::Gaussians::antialiased)).
    pub antialiased: bool,
}

/// Blends with a workgroup per tile, and backward with a workgroup per list chunk (glsl/include/group_tile.glsl).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroupBlend {
    /// Pixels per invocation of the forward pass.
    pub forward_rows: u32,
    /// Pixels per invocation of the backward pass.
    pub backward_rows: u32,
    /// Splats per chunk, a power of 2.
    pub chunk_length: u32,
    /// Longest list of a training step that a single workgroup always processes forward; longer lists may get a
    /// workgroup per chunk (glsl/include/long_lists.glsl).
    pub long_list: u32,
    /// Subgroups skip splats that none of their pixels sees; `false` for tests.
    pub culls: bool,
    /// Workgroups process their work in reverse order, for tests.
    pub turned: bool,
}

impl GroupBlend {
    /// The values for GPUs.
    pub const DEFAULT: Self =
        Self { forward_rows: 2, backward_rows: 4, chunk_length: 256, long_list: 1024, culls: true, turned: false };
}

/// How a step updates the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Update {
    /// Separate passes: one sums gradients, one propagates them to the parameters, and one per attribute updates all
    /// Gaussians.
    Split,
    /// One pass, for Gaussians that the view touched; the others miss updates until something touches or changes them.
    Lazy,
}

/// Largest id of a 16-bit mask pixel, whose highest bit is a flag.
const NARROW_MAX: u32 = 0x7fff;

/// Most tiles of all layers whose indices fit 16 bits.
const NARROW_TILES: u64 = 1 << 16;

/// Lavapipe ends all loops of an invocation after 65,535 rounds.
const LOOP_ROUNDS: u32 = 65_000;

/// Longest segment, for [`LOOP_ROUNDS`] on all devices. Processing n splats takes n rounds, and one more per load of a
/// subgroup.
const SEGMENT_LENGTH: u32 = 40_960;

/// Most shared memory of a workgroup blend, bytes: the forward pass stores 128 splats of 52 bytes.
const GROUP_BLEND_SHARED: u32 = 8192;

/// Minimum elements of texel buffers: 1 GiB of vec4. A smaller limit would restrict the model before memory does.
const TEXELS_MIN: u64 = 1 << 26;

/// A choice between two forms of kernels, the first for CPUs, the second for GPUs: the variable that makes it in a build
/// with the feature `lab`, with its values; whether a GPU of this shape gets the second form otherwise; and the shape
/// with the second form, or `None` if the device cannot run it.
type Form =
    (&'static str, [&'static str; 2], fn(&KernelShape) -> bool, fn(KernelShape, &Capabilities) -> Option<KernelShape>);

/// All choices. Later ones see what earlier ones chose.
const KERNEL_FORMS: [Form; 7] = [
    ("LABELGS_LOSS", ["columns", "shared"], |_| true, KernelShape::with_loss_tiles),
    ("LABELGS_PHOTOS", ["upload", "resident"], |_| true, |shape, _| Some(KernelShape { narrow_labels: true, ..shape })),
    ("LABELGS_WALK", ["lane", "group"], |_| true, KernelShape::with_group_walks),
    (
        "LABELGS_KEYS",
        ["wide", "narrow"],
        |_| true,
        |shape, device| device.has_narrow_storage().then_some(KernelShape { narrow_keys: true, ..shape }),
    ),
    ("LABELGS_BLEND", ["lane", "group"], |shape| !shape.emulated, KernelShape::with_group_blend),
    ("LABELGS_UPDATE", ["split", "lazy"], |shape| shape.group_walks, KernelShape::with_lazy_updates),
    ("LABELGS_SORT", ["lanes", "sweep"], |shape| !shape.emulated && shape.group_walks, KernelShape::with_sweeps),
];

impl KernelShape {
    /// Most items per invocation of a look-back sort. With 16, an invocation needs 103 registers instead of 64 (ptxas
    /// for sm_89), and half a million items are too few workgroups.
    pub const SWEEP_ITEMS: u32 = 8;

    /// Returns the shape for a device.
    pub fn for_device(device: &Capabilities) -> Self {
        let shape = Self::new(device.subgroup.size, device.is_cpu());
        let limits = &device.limits.plan;
        let most_texels = shaders::ALL.iter().map(|shader| shader.texel_buffers()).max().unwrap_or(0);
        let has_texels = limits.max_texel_elements >= TEXELS_MIN && limits.max_texel_buffers >= most_texels;
        let texel = shape.texel && has_texels;
        let shape = Self { texel, emulated: device.subgroup.is_emulated, ..shape };
        KERNEL_FORMS.into_iter().fold(shape, |shape, (variable, names, suits, apply)| {
            let has_it = chosen(variable, names).unwrap_or_else(|| !device.is_cpu() && suits(&shape));
            if has_it { apply(shape, device).unwrap_or(shape) } else { shape }
        })
    }

    /// Returns this shape with the largest loss tiles that fit in shared memory; `None` if the device can run none.
    fn with_loss_tiles(self, device: &Capabilities) -> Option<Self> {
        let limits = &device.limits;
        let fits = |&tile: &u32| {
            let (lanes, middle, outer) = (tile * tile, tile + 10, tile + 20);
            lanes <= limits.max_invocations
                && tile <= limits.max_group_size[1]
                && 4 * (2 * outer * (outer + 1) + 4 * outer * (middle + 1) + 1) <= limits.max_shared
        };
        [16, 8].into_iter().find(fits).map(|loss_tile| Self { loss_tile, ..self })
    }

    /// Returns this shape with workgroup blends; `None` if the device cannot run them.
    pub fn with_group_blend(self, device: &Capabilities) -> Option<Self> {
        let (limits, subgroup) = (&device.limits, &device.subgroup);
        let blend = GroupBlend::DEFAULT;
        // Parts of a list hand plain data to each other, which only the memory model with device scope promises to work.
        let long_list = if device.has_memory_model() { blend.long_list } else { u32::MAX };
        let shape = self.with_group_blend_of(GroupBlend { long_list, ..blend });
        let lanes = shape.tile_pixels() / GroupBlend::DEFAULT.forward_rows;
        let fits = lanes <= limits.max_invocations.min(limits.max_group_size[0])
            && lanes / self.subgroup <= subgroup.max_per_group
            && GROUP_BLEND_SHARED <= limits.max_shared
            && self.binds([&group_forward::VARIANTS, &group_backward::VARIANTS], false, device)
            && (self.emulated || subgroup.has_ballots());
        fits.then_some(shape)
    }

    /// Returns this shape with these workgroup blends.
    pub fn with_group_blend_of(self, blend: GroupBlend) -> Self {
        // Tiles do not wait for each other, and fewer tiles mean fewer pairs to sort.
        let (tile_width, tile_height) =
            if self.subgroup >= 32 { (16, 16) } else { (self.tile_width, self.tile_height) };
        Self { group_blend: Some(blend), tile_width, tile_height, ..self }
    }

    /// Returns the most chunks for this many pairs in the lists of this many tiles; 0 if the backward blend processes
    /// whole tiles.
    pub fn chunks(&self, instances: u64, jobs: u64) -> u64 {
        self.group_blend.map_or(0, |blend| instances / u64::from(blend.chunk_length) + jobs)
    }

    /// Returns this shape with the update in one kernel; `None` if the device cannot bind the buffers of the update, or
    /// of a projection that applies missed updates.
    pub fn with_lazy_updates(self, device: &Capabilities) -> Option<Self> {
        let fits = self.binds([&update::VARIANTS, &project_visible::VARIANTS, &emit_ordered::VARIANTS], true, device);
        fits.then_some(Self { update: Update::Lazy, group_walks: true, ..self })
    }

    /// Returns this shape with look-back passes that list splats; `None` if the device cannot run them.
    fn with_group_walks(self, device: &Capabilities) -> Option<Self> {
        self.can_look_back(device).then_some(Self { group_walks: true, ..self })
    }

    /// Returns true if the device can run the look-back passes that list splats.
    fn can_look_back(&self, device: &Capabilities) -> bool {
        self.binds([&project_visible::VARIANTS, &emit_ordered::VARIANTS], false, device)
    }

    /// Returns true if the device can bind all storage buffers of these kernels with this shape's reads; with `late`,
    /// also of variants for missed updates.
    fn binds<const N: usize>(&self, kernels: [&[ShaderDesc]; N], late: bool, device: &Capabilities) -> bool {
        let own = |shader: &&ShaderDesc| {
            shader.macros.contains(&"TEXEL") == self.texel && (late || !shader.macros.contains(&"LAZY"))
        };
        let most = kernels.into_iter().flatten().filter(own).map(ShaderDesc::storage_buffers).max();
        most.unwrap_or(0) <= device.limits.plan.max_storage_buffers
    }

    /// Returns this shape with look-back sorts and scans; `None` if the device cannot run them.
    pub fn with_sweeps(self, device: &Capabilities) -> Option<Self> {
        let (limits, subgroup) = (&device.limits, &device.subgroup);
        let fits = limits.max_invocations.min(limits.max_group_size[0]) >= SWEEP_LANES
            && SWEEP_LANES / self.subgroup <= subgroup.max_per_group
            && self.can_look_back(device)
            && (self.emulated || subgroup.has_ballots());
        let shape = self.with_sweeps_of(Self::SWEEP_ITEMS);
        let most = limits.max_shared.checked_sub(shape.sweep_bytes(0))? / (4 * SWEEP_LANES);
        let items = [Self::SWEEP_ITEMS, 4].into_iter().find(|&items| items <= most)?;
        fits.then(|| self.with_sweeps_of(items))
    }

    /// Returns this shape with look-back sorts and scans, with this many items per invocation.
    pub fn with_sweeps_of(self, items: u32) -> Self {
        let digit_bits = if self.subgroup >= 16 { 8 } else { 4 };
        Self { sweep_items: items, digit_bits, group_walks: true, ..self }
    }

    /// Returns the shared memory of a look-back sort pass, bytes.
    fn sweep_bytes(&self, items: u32) -> u32 {
        let (digits, subgroups) = (1 << self.digit_bits, SWEEP_LANES / self.subgroup);
        let exchange = if self.emulated { 2 * 12 * SWEEP_LANES } else { 0 };
        4 * (subgroups * digits + 2 * digits + SWEEP_LANES + 2 * subgroups + 8 + SWEEP_LANES * items) + exchange
    }

    /// Returns true if sorts and scans look back, with one dispatch per pass.
    pub fn sweeps(&self) -> bool {
        self.sweep_items > 0
    }

    /// Returns true if this many tiles of all layers get 16-bit keys.
    pub fn has_narrow_keys(&self, virtual_tiles: u64) -> bool {
        self.narrow_keys && self.sweeps() && virtual_tiles <= NARROW_TILES
    }

    /// Returns the words of `Buf::LOOK_BACK` for sorts of this many items.
    pub fn sweep_cells(&self, items: u64) -> u64 {
        if !self.sweeps() {
            return 0;
        }
        let partitions = items.div_ceil(u64::from(SWEEP_LANES * self.sweep_items));
        u64::from(SWEEP_WORDS) + partitions * u64::from(SWEEP_STRIDE)
    }

    /// Returns the words of `Buf::LOOK_BACK` for another pass: its ticket, and a word a partition.
    pub fn look_cells(items: u64) -> u64 {
        1 + items.div_ceil(u64::from(ORDERED_LANES))
    }

    /// Returns the Gaussians per invocation of project_visible: few if there would not be enough workgroups.
    pub fn visible_items(gaussians: u64) -> u32 {
        ((gaussians >> 19) as u32).clamp(VISIBLE_ITEMS_MIN, VISIBLE_ITEMS_MOST)
    }

    /// Returns the shape for a subgroup size; `cpu` is true if the device is a CPU.
    pub fn new(subgroup: u32, cpu: bool) -> Self {
        let (tile_width, tile_height) = match subgroup {
            ..=4 => (4, 8),
            8 => (8, 8),
            16 => (16, 8),
            // A GPU waits for the subgroup with the fullest tile, so tiles are small; a CPU saves splat loads with
            // larger tiles.
            32 if !cpu => (16, 8),
            _ => (16, 16),
        };
        Self {
            subgroup,
            emulated: false,
            tile_width,
            tile_height,
            texel: cpu,
            digit_bits: if subgroup <= 16 { 8 } else { 4 },
            sweep_items: 0,
            narrow_keys: false,
            loss_tile: 0,
            narrow_labels: false,
            group_walks: false,
            group_blend: None,
            update: Update::Split,
            // 2^14 looks take some 15 ms on a GPU, where all workgroups of a pass may share the memory until then.
            looks: if cpu { 16 } else { 1 << 14 },
            lane_groups: if cpu { 4 } else { 128 },
            segment_length: SEGMENT_LENGTH,
            loop_rounds: cpu.then_some(LOOP_ROUNDS),
            antialiased: false,
        }
    }

    /// Returns the shape for masks with ids up to `max_label`.
    pub(crate) fn for_labels(self, max_label: u32) -> Self {
        Self { narrow_labels: self.narrow_labels && max_label <= NARROW_MAX, ..self }
    }

    /// Returns the pixels of a mask in the layout of the kernels (glsl/include/view_label.glsl).
    pub(crate) fn view_labels<'a>(&self, labels: &'a [u32]) -> Cow<'a, [u32]> {
        if !self.narrow_labels {
            return Cow::Borrowed(labels);
        }
        let narrow = |word: u32| word & NARROW_MAX | (word & LABEL_BORDER) >> 1;
        Cow::Owned(
            labels.chunks(2).map(|two| narrow(two[0]) | two.get(1).map_or(0, |&word| narrow(word) << 16)).collect(),
        )
    }

    /// Checks that the blend kernels can use this shape: each lane owns whole pixels in one column of a tile.
    pub fn check(&self) -> Result<()> {
        let (width, pixels) = (self.tile_width, self.tile_pixels());
        if (SUBGROUP_MIN..=SUBGROUP_MAX).contains(&self.subgroup)
            && pixels > 0
            && self.subgroup.is_multiple_of(width)
            && pixels.is_multiple_of(self.subgroup)
        {
            return Ok(());
        }
        Err(Error::Bug(format!(
            "tiles of {width} x {} px do not fit subgroups of {} lanes",
            self.tile_height, self.subgroup
        )))
    }

    /// Tiles per row and per column of an image.
    pub fn tiles(&self, width: u32, height: u32) -> (u32, u32) {
        (width.div_ceil(self.tile_width), height.div_ceil(self.tile_height))
    }

    /// Pixels per tile.
    pub fn tile_pixels(&self) -> u32 {
        self.tile_width * self.tile_height
    }

    /// Returns the number of lanes of a sort or scan over at most `items` items; each lane processes at most 30,000
    /// items.
    pub fn lanes(&self, items: u64) -> u32 {
        let groups = items.div_ceil(u64::from(self.subgroup) * 30_000) as u32;
        groups.next_multiple_of(2).max(self.lane_groups) * self.subgroup
    }

    /// Looks up a specialisation constant that follows from the shape, by its GLSL name.
    pub fn constant(&self, name: &str) -> Option<u32> {
        match name {
            "SUBGROUP_SIZE" => Some(self.subgroup),
            "TILE_WIDTH" => Some(self.tile_width),
            "TILE_HEIGHT" => Some(self.tile_height),
            "DIGIT_BITS" => Some(self.digit_bits),
            "SWEEP_ITEMS" => Some(self.sweep_items.max(1)),
            "LOOKS" => Some(self.looks),
            "LABELS_PER_WORD" => Some(if self.narrow_labels { 2 } else { 1 }),
            "LOSS_TILE" => (self.loss_tile > 0).then_some(self.loss_tile),
            "CHUNK_LENGTH" => self.group_blend.map(|blend| blend.chunk_length),
            "CULLS" => self.group_blend.map(|blend| blend.culls.into()),
            "TURNED" => self.group_blend.map(|blend| blend.turned.into()),
            "SEGMENT_LENGTH" => Some(self.segment_length),
            _ => None,
        }
    }
}

/// Returns whether a developer's environment variable names the second of two forms; `None` if it names neither.
fn chosen(variable: &str, [first, second]: [&str; 2]) -> Option<bool> {
    let name = lab::var(variable)?;
    (name == first || name == second).then_some(name == second)
}
