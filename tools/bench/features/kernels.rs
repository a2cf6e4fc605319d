//! The feature kernels, compiled when the benchmark runs, and the buffers and passes that they add to a plain step.

use crate::compiler::shader;
use labelgs::pass::{KernelShape, Variant, training_step};
use labelgs::scheduler::plan::{
    Buf, BufferDecl, Capacity, Class, Domain, Grid, PassDecl, PassList, TABLE, TexelFormat, Work,
};
use labelgs::shaders::{ShaderDesc, constants};
use labelgs::{Error, Result};

/// The three kernels for a shape.
pub struct Kernels {
    forward: &'static ShaderDesc,
    backward: &'static ShaderDesc,
    gather: &'static ShaderDesc,
}

impl Kernels {
    /// Compiles them.
    pub fn compile(shape: &KernelShape) -> Result<Self> {
        Ok(Self {
            forward: shader("feature_forward", include_str!("feature_forward.comp"), shape.texel)?,
            backward: shader("feature_backward", include_str!("feature_backward.comp"), shape.texel)?,
            gather: shader("feature_gather", include_str!("feature_gather.comp"), shape.texel)?,
        })
    }
}

/// How many channels there are, and how many are walked at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channels {
    /// Channels of the feature.
    pub count: u32,
    /// vec4 of them in one walk of the tiles.
    pub vecs: u32,
}

impl Channels {
    /// vec4 of a Gaussian's feature, a whole number of walks.
    pub fn stride(self) -> u32 {
        self.count.div_ceil(4 * self.vecs) * self.vecs
    }

    /// First vec4 of each walk.
    pub fn chunks(self) -> impl Iterator<Item = u32> {
        (0..self.stride()).step_by(self.vecs as usize)
    }
}

/// The engine's buffers and those of the features.
pub struct Buffers {
    /// All rows.
    pub table: &'static [BufferDecl],
    /// [N,stride] vec4.
    pub features: Buf,
    /// Gradients of the last walk's channels by the picture [P,VECS] vec4.
    pub v_image: Buf,
    /// Records of the last walk's channels [I,VECS] vec4.
    pub v_instances: Buf,
    /// Gradients of the features by splat [V,stride] vec4.
    pub v_features: Buf,
}

impl Buffers {
    /// For so many channels in an engine of some capacity. The table lives as long as the program.
    pub fn new(channels: Channels, capacity: &Capacity) -> Result<Self> {
        let mut table = TABLE.to_vec();
        let mut row = |name, count: u64, class| -> Result<Buf> {
            let count = u32::try_from(count).map_err(|_| Error::Bug(format!("{name} has {count} elements")))?;
            let (domain, texel) = (Domain::Fixed(count), Some(TexelFormat::Rgba32Sfloat));
            table.push(BufferDecl { name, element_bytes: 16, domain, class, texel, doc: "A benchmark's." });
            Ok(Buf(table.len() as u16 - 1))
        };
        let (stride, vecs) = (u64::from(channels.stride()), u64::from(channels.vecs));
        let features = row("features", capacity.gaussians * stride, Class::Model)?;
        let v_image = row("v_features_image", capacity.pixels * vecs, Class::Step)?;
        let v_instances = row("v_feature_instances", capacity.instances * vecs, Class::Persistent)?;
        let v_features = row("v_features", capacity.gaussians * stride, Class::Persistent)?;
        Ok(Self { table: Box::leak(table.into_boxed_slice()), features, v_image, v_instances, v_features })
    }
}

/// A plain step with the walks of all channels after its own.
pub fn step_with_features(
    (shape, capacity): (&KernelShape, &Capacity),
    variant: Variant,
    kernels: &Kernels,
    buffers: &Buffers,
    channels: Channels,
) -> Result<PassList> {
    let mut list = training_step(shape, capacity, variant);
    let missing = || Error::Bug("the step has no pass blend_backward".to_owned());
    let is = |work: &Work, wanted: &str| matches!(work, Work::Pass(pass) if pass.shader.stem.starts_with(wanted));
    let at = list.work.iter().rposition(|work| is(work, "blend_backward")).ok_or_else(missing)?;
    let Work::Pass(backward) = &list.work[at] else { return Err(missing()) };
    let bound = backward
        .shader
        .bindings
        .iter()
        .position(|binding| binding.name == "instance_from_sorted")
        .ok_or_else(missing)?;
    let instance_from_sorted = backward.buffers[bound];
    let grid = |word: u32| Grid::Indirect(Buf::DISPATCH_ARGS, word * 4);
    let mut walks = Vec::new();
    for chunk in channels.chunks() {
        let walk = vec![channels.vecs, chunk, channels.stride()];
        let tile = [&[shape.subgroup, shape.tile_width, shape.tile_height], &walk[..]].concat();
        let lists =
            [Buf::STEP, Buf::TILE_STARTS, instance_from_sorted, Buf::SPLAT_FROM_INSTANCE, Buf::SPLATS, Buf::LAST];
        let forward = [&lists[..], &[Buf::DEPTH_VALUES_A, buffers.features, buffers.v_image]].concat();
        let backward = [&lists[..], &[buffers.v_image, buffers.v_instances]].concat();
        let gather = vec![
            Buf::STEP,
            Buf::COUNTERS,
            Buf::TILES_TOUCHED,
            Buf::INSTANCE_OFFSETS,
            Buf::V_INSTANCES_C,
            buffers.v_instances,
            buffers.v_features,
        ];
        let blend = grid(constants::ARGS_BLEND);
        walks.push(PassDecl::new(kernels.forward, forward, blend).spec(tile.clone()).into());
        walks.push(PassDecl::new(kernels.backward, backward, blend).spec(tile).into());
        let gather = PassDecl::new(kernels.gather, gather, grid(constants::ARGS_SPLATS));
        walks.push(gather.spec(walk).into());
    }
    list.work.splice(at + 1..at + 1, walks);
    Ok(list)
}
