//! Shader modules and pipelines.

use super::{destroy as drop_object, handle, log, object, slice};
use crate::lower::lower;
use crate::program::Program;
use ash::vk;
use std::collections::HashMap;
use std::ffi::c_void;
use std::sync::Arc;

type Module = Vec<u32>;

/// A compute pipeline.
pub(super) type Pipeline = Arc<Program>;

pub(super) unsafe extern "system" fn create_module(
    _: vk::Device,
    info: *const vk::ShaderModuleCreateInfo<'_>,
    _: *const c_void,
    to: *mut vk::ShaderModule,
) -> vk::Result {
    let words = unsafe { slice((*info).p_code, (*info).code_size as u32 / 4) };
    unsafe { *to = handle(words.to_vec()) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_module(_: vk::Device, module: vk::ShaderModule, _: *const c_void) {
    unsafe { drop_object::<Module>(module) };
}

pub(super) unsafe extern "system" fn create_layout(
    _: vk::Device,
    _: *const c_void,
    _: *const c_void,
    to: *mut vk::PipelineLayout,
) -> vk::Result {
    unsafe { *to = handle(0_u8) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_layout(_: vk::Device, layout: vk::PipelineLayout, _: *const c_void) {
    unsafe { drop_object::<u8>(layout) };
}

pub(super) unsafe extern "system" fn create_cache(
    _: vk::Device,
    _: *const c_void,
    _: *const c_void,
    to: *mut vk::PipelineCache,
) -> vk::Result {
    unsafe { *to = handle(0_u8) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_cache(_: vk::Device, cache: vk::PipelineCache, _: *const c_void) {
    unsafe { drop_object::<u8>(cache) };
}

/// Nothing is kept between runs.
pub(super) unsafe extern "system" fn cache_data(
    _: vk::Device,
    _: vk::PipelineCache,
    bytes: *mut usize,
    _: *mut c_void,
) -> vk::Result {
    unsafe { *bytes = 0 };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn create(
    _: vk::Device,
    _: vk::PipelineCache,
    count: u32,
    infos: *const vk::ComputePipelineCreateInfo<'_>,
    _: *const c_void,
    to: *mut vk::Pipeline,
) -> vk::Result {
    let mut result = vk::Result::SUCCESS;
    for (place, info) in unsafe { slice(infos, count) }.iter().enumerate() {
        let words = unsafe { object::<Module>(info.stage.module) };
        let made = match lower(words, &unsafe { specialised(&info.stage) }) {
            Ok(program) => handle(Pipeline::new(program)),
            Err(what) => {
                log::say(crate::program::module_hash(words), &what);
                result = vk::Result::ERROR_INVALID_SHADER_NV;
                vk::Pipeline::null()
            }
        };
        unsafe { *to.add(place) = made };
    }
    result
}

unsafe fn specialised(stage: &vk::PipelineShaderStageCreateInfo<'_>) -> HashMap<u32, u32> {
    if stage.p_specialization_info.is_null() {
        return HashMap::new();
    }
    let info = unsafe { &*stage.p_specialization_info };
    let value = |entry: &vk::SpecializationMapEntry| {
        let from = unsafe { info.p_data.cast::<u8>().add(entry.offset as usize) };
        (entry.constant_id, unsafe { from.cast::<u32>().read_unaligned() })
    };
    unsafe { slice(info.p_map_entries, info.map_entry_count) }.iter().map(value).collect()
}

pub(super) unsafe extern "system" fn destroy(_: vk::Device, pipeline: vk::Pipeline, _: *const c_void) {
    unsafe { drop_object::<Pipeline>(pipeline) };
}
