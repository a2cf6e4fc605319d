//! Compute pipelines.

use super::call::vk_call;
use super::{Gpu, lock, packed, uniform_flow};
use crate::error::{Error, Result};
use crate::shaders::{BindingKind, PUSHED_WORDS, ShaderDesc};
use ash::vk;
use rayon::prelude::*;
use std::sync::{Arc, Mutex};

/// Key that distinguishes pipelines.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct PipelineKey {
    name: &'static str,
    /// Address of the SPIR-V: tests may have two shaders with the same name.
    spirv: usize,
    /// Values of the specialisation constants.
    spec: Vec<u32>,
    subgroup_size: Option<u32>,
    /// Window of each storage buffer, if buffers share bindings.
    windows: Vec<u8>,
}

/// Binding and kind of a descriptor.
pub(super) type Slot = (u32, vk::DescriptorType);

/// A kernel to compile: shader, constants of a pass, and windows of its storage buffers.
pub(crate) type Kernel<'a> = (&'static ShaderDesc, &'a [u32], Vec<u8>);

/// A pipeline; `None` before its first use.
pub(super) type PipelineSlot = Arc<Mutex<Option<Arc<Pipeline>>>>;

/// A compute pipeline with its layouts.
pub(crate) struct Pipeline {
    device: ash::Device,
    slots: Vec<Slot>,
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    handle: vk::Pipeline,
}

impl Gpu {
    /// Returns the pipeline of a shader; creates it on first use. `spec` has the constants of a pass; empty for the
    /// defaults. `windows` has the window of each storage buffer, if buffers share bindings; empty for the first
    /// window.
    pub(crate) fn pipeline(&self, shader: &'static ShaderDesc, spec: &[u32], windows: &[u8]) -> Result<Arc<Pipeline>> {
        let spec = shader.specialised(spec);
        let subgroup_size = self.pinned(shader, self.subgroup_size());
        let spirv = shader.spirv.as_ptr() as usize;
        let windows = self.windows(shader, windows);
        let key = PipelineKey { name: shader.name, spirv, spec, subgroup_size, windows };
        let slot = Arc::clone(lock(&self.pipelines).entry(key.clone()).or_default());
        // Lock only this pipeline, because creating it may take long.
        let mut slot = lock(&slot);
        let pipeline = match slot.take() {
            Some(pipeline) => pipeline,
            None => Arc::new(Pipeline::new(self, shader, (&key.spec, &key.windows), subgroup_size)?),
        };
        *slot = Some(Arc::clone(&pipeline));
        Ok(pipeline)
    }

    /// Creates pipelines on several threads, so that [`Self::pipeline`] finds them.
    pub(crate) fn compile(&self, kernels: &[Kernel<'_>]) -> Result<()> {
        kernels.par_iter().try_for_each(|(shader, spec, windows)| self.pipeline(shader, spec, windows).map(drop))
    }

    /// Returns the window of each storage buffer of a shader: the first window if none are given; empty if buffers have
    /// their own bindings.
    pub(super) fn windows(&self, shader: &ShaderDesc, given: &[u8]) -> Vec<u8> {
        match (self.limits().plan.is_packed(), given) {
            (false, _) => Vec::new(),
            (true, []) => vec![0; shader.storage_buffers() as usize],
            (true, given) => given.to_vec(),
        }
    }

    /// Returns the subgroup size to pin, if the shader uses subgroups.
    pub(super) fn pinned(&self, shader: &ShaderDesc, size: u32) -> Option<u32> {
        (shader.uses_subgroups && self.capabilities.subgroup.is_pinned).then_some(size)
    }

    /// Width of a shader's workgroup. Fails if the workgroup is too large, because drivers react differently.
    fn check_workgroup(&self, shader: &ShaderDesc, spec: &[u32], subgroup_size: Option<u32>) -> Result<u32> {
        let (size, limits) = (shader.workgroup(spec), self.limits());
        let invocations = size.iter().map(|&count| u64::from(count)).product::<u64>();
        let subgroups = u64::from(subgroup_size.unwrap_or(1)) * u64::from(self.capabilities.subgroup.max_per_group);
        let most = u64::from(limits.max_invocations).min(if subgroup_size.is_some() { subgroups } else { u64::MAX });
        let fits = size.iter().zip(&limits.max_group_size).all(|(count, limit)| (1..=*limit).contains(count));
        if fits && invocations <= most {
            return Ok(size[0]);
        }
        let name = shader.name;
        Err(Error::NoDevice(format!(
            "shader {name} has workgroups of {size:?}; the device supports at most {most} invocations"
        )))
    }
}

/// The error for a shader that the driver refuses; memory errors and a lost device are passed through.
fn refused(gpu: &Gpu, shader: &ShaderDesc, error: Error) -> Error {
    if error.is_out_of_memory() || error.is_device_lost() {
        return error;
    }
    let device = gpu.capabilities();
    Error::NoDevice(format!(
        "{} ({} {}) does not compile the shader {}: {error}; try another driver version or another device",
        device.name, device.driver_name, device.driver_info, shader.name
    ))
}

/// Descriptors of a shader in binding order; with shared bindings: windows, the offsets buffer, and texel buffers.
fn slots(shader: &ShaderDesc, windows: packed::Windows<'_>) -> Vec<Slot> {
    let own = |kind| match kind {
        BindingKind::Storage => vk::DescriptorType::STORAGE_BUFFER,
        BindingKind::Texel => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
    };
    let bindings = shader.bindings.iter().map(|binding| (binding.binding, own(binding.kind)));
    if windows.is_empty() {
        return bindings.collect();
    }
    let (first, count) = (packed::first_binding(shader.bindings), packed::count(windows));
    let shared = (first..first + count).map(|number| (number, vk::DescriptorType::STORAGE_BUFFER));
    let places = (first + count, vk::DescriptorType::UNIFORM_BUFFER);
    let texels = bindings.filter(|(_, kind)| *kind == vk::DescriptorType::UNIFORM_TEXEL_BUFFER);
    shared.chain([places]).chain(texels).collect()
}

impl Pipeline {
    pub(super) fn new(
        gpu: &Gpu,
        shader: &'static ShaderDesc,
        (spec, windows): (&[u32], packed::Windows<'_>),
        subgroup_size: Option<u32>,
    ) -> Result<Self> {
        let width = gpu.check_workgroup(shader, spec, subgroup_size)?;
        let device = gpu.raw().clone();
        // From here on, dropping `pipeline` destroys its handles; destroying a null handle does nothing.
        let mut pipeline = Self {
            device,
            slots: slots(shader, windows),
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            handle: vk::Pipeline::null(),
        };
        pipeline.make_layouts()?;
        let (words, rest) = shader.spirv.as_chunks::<4>();
        if !rest.is_empty() || words.is_empty() {
            let name = shader.name;
            return Err(Error::Bug(format!("the SPIR-V of {name} has {} bytes", shader.spirv.len())));
        }
        let mut words = words.iter().map(|word| u32::from_le_bytes(*word)).collect::<Vec<_>>();
        if !windows.is_empty() {
            let shared = packed::repack(&words, shader.bindings, windows);
            words = shared.map_err(|what| Error::Bug(format!("{} cannot share bindings: {what}", shader.name)))?;
        }
        if shader.uses_subgroups && gpu.capabilities.features.uniform_flow {
            uniform_flow::declare(&mut words);
        }
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the SPIR-V comes from the shader compiler of the build.
        let module = vk_call("vkCreateShaderModule", || unsafe { gpu.raw().create_shader_module(&info, None) })?;
        let full =
            gpu.capabilities.features.full_subgroups && subgroup_size.is_some_and(|size| width.is_multiple_of(size));
        let flags = gpu.pipeline_flags();
        let made = pipeline.make((gpu.pipeline_cache(), shader), module, spec, (subgroup_size, full), flags);
        // SAFETY: pipelines do not need their modules after creation.
        unsafe { gpu.raw().destroy_shader_module(module, None) };
        made.map_err(|error| refused(gpu, shader, error))?;
        gpu.name_object(pipeline.handle, shader.name);
        Ok(pipeline)
    }

    fn make_layouts(&mut self) -> Result<()> {
        let bindings = self.slots.iter().map(|&(number, kind)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(number)
                .descriptor_type(kind)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        });
        let bindings = bindings.collect::<Vec<_>>();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the device is alive; here and below all pointers live until the call returns.
        self.set_layout = vk_call("vkCreateDescriptorSetLayout", || unsafe {
            self.device.create_descriptor_set_layout(&info, None)
        })?;
        let (layouts, pushed) = (
            [self.set_layout],
            [vk::PushConstantRange {
                stage_flags: vk::ShaderStageFlags::COMPUTE,
                offset: 0,
                size: 4 * PUSHED_WORDS as u32,
            }],
        );
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(&pushed);
        // SAFETY: same as above.
        self.layout = vk_call("vkCreatePipelineLayout", || unsafe { self.device.create_pipeline_layout(&info, None) })?;
        Ok(())
    }

    fn make(
        &mut self,
        (cache, shader): (vk::PipelineCache, &ShaderDesc),
        module: vk::ShaderModule,
        spec: &[u32],
        (size, full): (Option<u32>, bool),
        flags: vk::PipelineCreateFlags,
    ) -> Result<()> {
        let constants = shader.spec.iter().filter(|constant| !constant.is_pushed);
        let entries = constants.enumerate().map(|(index, constant)| vk::SpecializationMapEntry {
            constant_id: constant.id,
            offset: index as u32 * 4,
            size: 4,
        });
        let entries = entries.collect::<Vec<_>>();
        let spec = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(spec));
        let mut required = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
            .required_subgroup_size(size.unwrap_or_default());
        let mut stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&spec);
        if size.is_some() {
            stage = stage.push_next(&mut required);
        }
        if full {
            stage = stage.flags(vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS);
        }
        let infos = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(self.layout).flags(flags)];
        // SAFETY: module and layout are alive and belong to the same shader; caches synchronise themselves.
        let made = vk_call("vkCreateComputePipelines", || {
            unsafe { self.device.create_compute_pipelines(cache, &infos, None) }.map_err(|(_, result)| result)
        })?;
        self.handle = made.first().copied().unwrap_or_default();
        Ok(())
    }

    pub(crate) fn raw(&self) -> vk::Pipeline {
        self.handle
    }

    pub(crate) fn layout(&self) -> vk::PipelineLayout {
        self.layout
    }

    pub(super) fn set_layout(&self) -> vk::DescriptorSetLayout {
        self.set_layout
    }

    pub(super) fn slots(&self) -> &[Slot] {
        &self.slots
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: the cache in `Gpu` keeps every pipeline until the device is idle and about to be destroyed; null
        // handles are ignored.
        unsafe {
            self.device.destroy_pipeline(self.handle, None);
            self.device.destroy_pipeline_layout(self.layout, None);
            self.device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
