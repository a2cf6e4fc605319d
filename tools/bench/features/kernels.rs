//! The feature kernels, compiled when the benchmark runs, and the buffers and passes that they add to a plain step.

use crate::compiler::spirv;
use labelgs::pass::{KernelShape, Variant, training_step};
use labelgs::scheduler::plan::{
    Buf, BufferDecl, Capacity, Class, Domain, Grid, PassDecl, PassList, TABLE, TexelFormat, Work,
};
use labelgs::shaders::{Access, BindingDesc, BindingKind, LocalSize, ShaderDesc, SpecDesc, constants};
use labelgs::{Error, Result};

/// How a kernel sees a buffer.
#[derive(Clone, Copy)]
enum Seen {
    /// Storage that is read; bytes of an element.
    Read(u32),
    /// Fetched: a texel buffer where that is fast; bytes of an element as storage.
    Fetch(u32),
    /// Storage that is written.
    Write(u32),
}

/// The three kernels for a shape.
pub struct Kernels {
    forward: &'static ShaderDesc,
    backward: &'static ShaderDesc,
    gather: &'static ShaderDesc,
}

impl Kernels {
    /// Compiles them; descriptions live as long as the program, as those of the engine's shaders do.
    pub fn compile(shape: &KernelShape) -> Result<Self> {
        use Seen::{Fetch, Read, Write};
        let step = ("step", Read(size_of::<labelgs::shaders::structs::StepUniforms>() as u32));
        let counters = ("counters", Read(size_of::<labelgs::shaders::structs::Counters>() as u32));
        let tile =
            [step, ("tile_starts", Fetch(4)), ("instance_from_sorted", Fetch(4)), ("splat_from_instance", Fetch(4))];
        let seen = [("splats", Fetch(16)), ("last", Fetch(4))];
        let tile = [&tile[..], &seen].concat();
        let forward =
            [&tile[..], &[("gaussian_from_splat", Fetch(4)), ("features", Fetch(16)), ("v_features_image", Write(16))]]
                .concat();
        let backward = [&tile[..], &[("v_features_image", Fetch(16)), ("v_feature_instances", Write(16))]].concat();
        let gather = [
            step,
            counters,
            ("tiles_touched", Fetch(4)),
            ("instance_offsets", Fetch(4)),
            ("v_instances_c", Fetch(16)),
            ("v_feature_instances", Fetch(16)),
            ("v_features", Write(16)),
        ];
        let source = |name| match name {
            "feature_forward" => include_str!("feature_forward.comp"),
            "feature_backward" => include_str!("feature_backward.comp"),
            _ => include_str!("feature_gather.comp"),
        };
        let shader = |name, bindings: &[(&'static str, Seen)], uses_subgroups| {
            compile(name, source(name), bindings, uses_subgroups, shape.texel)
        };
        Ok(Self {
            forward: shader("feature_forward", &forward, true)?,
            backward: shader("feature_backward", &backward, true)?,
            gather: shader("feature_gather", &gather, false)?,
        })
    }
}

fn compile(
    name: &'static str,
    source: &str,
    bindings: &[(&'static str, Seen)],
    uses_subgroups: bool,
    texel: bool,
) -> Result<&'static ShaderDesc> {
    let spirv = spirv(name, source, texel)?;
    let describe = |(binding, &(name, seen)): (usize, &(&'static str, Seen))| {
        let (kind, access, element_bytes) = match seen {
            Seen::Read(bytes) => (BindingKind::Storage, Access::Read, bytes),
            Seen::Fetch(_) if texel => (BindingKind::Texel, Access::Read, 0),
            Seen::Fetch(bytes) => (BindingKind::Storage, Access::Read, bytes),
            Seen::Write(bytes) => (BindingKind::Storage, Access::Write, bytes),
        };
        BindingDesc { name, binding: binding as u32, kind, access, element_bytes }
    };
    let bindings: Vec<BindingDesc> = bindings.iter().enumerate().map(describe).collect();
    let spec = |name, id, default| SpecDesc { name, id, default };
    let channels = [spec("VECS", 10, 1), spec("CHUNK", 20, 0), spec("STRIDE", 21, 1)];
    let tile = [spec("SUBGROUP_SIZE", 0, 8), spec("TILE_WIDTH", 1, 8), spec("TILE_HEIGHT", 2, 8)];
    let specs = if uses_subgroups { [&tile[..], &channels].concat() } else { channels.to_vec() };
    let width = if uses_subgroups { LocalSize::Constant(0) } else { LocalSize::Fixed(64) };
    Ok(Box::leak(Box::new(ShaderDesc {
        stem: name,
        name,
        spirv,
        bindings: Box::leak(bindings.into_boxed_slice()),
        spec: Box::leak(specs.into_boxed_slice()),
        local_size: [width, LocalSize::Fixed(1), LocalSize::Fixed(1)],
        uses_subgroups,
    })))
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
