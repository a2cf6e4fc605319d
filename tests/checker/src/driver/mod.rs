//! The functions of Vulkan that labelgs, its allocator, the loader and the validation layer need.
//!
//! Objects are boxes, and handles their addresses. Those of instances, devices, queues and command buffers begin with a
//! word for the loader. Submits run at once, in the caller's thread.
//!
//! Every function here is called by the loader with the arguments of the program, which the validation layer checks:
//! handles are alive, pointers are valid.
#![allow(clippy::missing_safety_doc, reason = "said above")]

mod command;
mod descriptor;
mod device;
mod instance;
mod log;
mod memory;
mod pipeline;
mod properties;
mod queue;
mod sync;

use ash::vk;
use std::ffi::{CStr, c_char};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What the loader replaces by its dispatch table.
const LOADER_MAGIC: usize = 0x01cd_c0de;

/// A function without its type.
type Function = unsafe extern "system" fn();

/// Looks up a function by name.
macro_rules! table {
    ($name:expr; $($vulkan:literal => $function:path,)*) => {
        match $name {
            $($vulkan => {
                let function: *const () = $function as *const ();
                // SAFETY: only the type of the pointer changes; the caller knows the function's type by its name.
                Some(unsafe { std::mem::transmute::<*const (), Function>(function) })
            })*
            _ => None,
        }
    };
}

#[allow(clippy::too_many_lines, reason = "a table")]
fn function(name: &str) -> Option<Function> {
    table!(name;
        "vkCreateInstance" => instance::create,
        "vkDestroyInstance" => instance::destroy,
        "vkEnumerateInstanceVersion" => instance::version,
        "vkEnumerateInstanceExtensionProperties" => instance::extensions,
        "vkEnumerateInstanceLayerProperties" => instance::layers,
        "vkEnumeratePhysicalDevices" => instance::devices,
        "vkEnumeratePhysicalDeviceGroups" => instance::groups,
        "vkGetInstanceProcAddr" => vk_icdGetInstanceProcAddr,
        "vkGetPhysicalDeviceFeatures" => properties::features,
        "vkGetPhysicalDeviceFeatures2" => properties::features2,
        "vkGetPhysicalDeviceProperties" => properties::properties,
        "vkGetPhysicalDeviceProperties2" => properties::properties2,
        "vkGetPhysicalDeviceMemoryProperties" => properties::memory,
        "vkGetPhysicalDeviceMemoryProperties2" => properties::memory2,
        "vkGetPhysicalDeviceQueueFamilyProperties" => properties::families,
        "vkGetPhysicalDeviceQueueFamilyProperties2" => properties::families2,
        "vkGetPhysicalDeviceFormatProperties" => properties::format,
        "vkGetPhysicalDeviceFormatProperties2" => properties::format2,
        "vkGetPhysicalDeviceImageFormatProperties" => properties::image_format,
        "vkGetPhysicalDeviceImageFormatProperties2" => properties::image_format2,
        "vkGetPhysicalDeviceSparseImageFormatProperties" => properties::sparse_format,
        "vkGetPhysicalDeviceSparseImageFormatProperties2" => properties::sparse_format2,
        "vkGetPhysicalDeviceToolProperties" => properties::tools,
        "vkEnumerateDeviceExtensionProperties" => properties::extensions,
        "vkEnumerateDeviceLayerProperties" => properties::layers,
        "vkCreateDevice" => device::create,
        "vkDestroyDevice" => device::destroy,
        "vkGetDeviceProcAddr" => device::function,
        "vkGetDeviceQueue" => device::queue,
        "vkGetDeviceQueue2" => device::queue2,
        "vkDeviceWaitIdle" => device::wait_idle,
        "vkQueueWaitIdle" => queue::wait_idle,
        "vkQueueSubmit" => queue::submit,
        "vkAllocateMemory" => memory::allocate,
        "vkFreeMemory" => memory::free,
        "vkMapMemory" => memory::map,
        "vkUnmapMemory" => memory::unmap,
        "vkFlushMappedMemoryRanges" => memory::flush,
        "vkInvalidateMappedMemoryRanges" => memory::flush,
        "vkCreateBuffer" => memory::create_buffer,
        "vkDestroyBuffer" => memory::destroy_buffer,
        "vkGetBufferMemoryRequirements" => memory::requirements,
        "vkGetBufferMemoryRequirements2" => memory::requirements2,
        "vkBindBufferMemory" => memory::bind,
        "vkCreateBufferView" => memory::create_view,
        "vkDestroyBufferView" => memory::destroy_view,
        "vkCreateDescriptorSetLayout" => descriptor::create_layout,
        "vkDestroyDescriptorSetLayout" => descriptor::destroy_layout,
        "vkCreateDescriptorPool" => descriptor::create_pool,
        "vkDestroyDescriptorPool" => descriptor::destroy_pool,
        "vkAllocateDescriptorSets" => descriptor::allocate,
        "vkUpdateDescriptorSets" => descriptor::update,
        "vkCreateShaderModule" => pipeline::create_module,
        "vkDestroyShaderModule" => pipeline::destroy_module,
        "vkCreatePipelineLayout" => pipeline::create_layout,
        "vkDestroyPipelineLayout" => pipeline::destroy_layout,
        "vkCreatePipelineCache" => pipeline::create_cache,
        "vkDestroyPipelineCache" => pipeline::destroy_cache,
        "vkGetPipelineCacheData" => pipeline::cache_data,
        "vkCreateComputePipelines" => pipeline::create,
        "vkDestroyPipeline" => pipeline::destroy,
        "vkCreateCommandPool" => command::create_pool,
        "vkDestroyCommandPool" => command::destroy_pool,
        "vkAllocateCommandBuffers" => command::allocate,
        "vkFreeCommandBuffers" => command::free,
        "vkBeginCommandBuffer" => command::begin,
        "vkEndCommandBuffer" => command::end,
        "vkResetCommandBuffer" => command::reset,
        "vkCmdBindPipeline" => command::bind_pipeline,
        "vkCmdBindDescriptorSets" => command::bind_sets,
        "vkCmdPushConstants" => command::push,
        "vkCmdDispatch" => command::dispatch,
        "vkCmdDispatchIndirect" => command::dispatch_indirect,
        "vkCmdCopyBuffer" => command::copy,
        "vkCmdFillBuffer" => command::fill,
        "vkCmdPipelineBarrier" => command::barrier,
        "vkCmdResetQueryPool" => command::reset_queries,
        "vkCmdWriteTimestamp" => command::timestamp,
        "vkCreateSemaphore" => sync::create_semaphore,
        "vkDestroySemaphore" => sync::destroy_semaphore,
        "vkGetSemaphoreCounterValue" => sync::counter,
        "vkWaitSemaphores" => sync::wait,
        "vkSignalSemaphore" => sync::signal,
        "vkCreateQueryPool" => sync::create_queries,
        "vkDestroyQueryPool" => sync::destroy_queries,
        "vkGetQueryPoolResults" => sync::results,
    )
}

/// Agrees on the version of the interface with the loader.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vk_icdNegotiateLoaderICDInterfaceVersion(version: *mut u32) -> vk::Result {
    // SAFETY: see the head of the module, here and in all functions of the driver.
    unsafe { *version = (*version).min(5) };
    vk::Result::SUCCESS
}

/// Looks up any function.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vk_icdGetInstanceProcAddr(_: vk::Instance, name: *const c_char) -> Option<Function> {
    let name = unsafe { CStr::from_ptr(name) };
    function(name.to_str().ok()?)
}

/// Boxes an object and returns its handle.
fn handle<T, H: vk::Handle>(object: T) -> H {
    H::from_raw(Box::into_raw(Box::new(object)) as u64)
}

/// The object of a handle.
unsafe fn object<'a, T>(handle: impl vk::Handle) -> &'a T {
    unsafe { &*(handle.as_raw() as *const T) }
}

/// Destroys the object of a handle, which may be null.
unsafe fn destroy<T>(handle: impl vk::Handle + Copy) {
    if handle.as_raw() != 0 {
        drop(unsafe { Box::from_raw(handle.as_raw() as *mut T) });
    }
}

/// A slice of the program.
unsafe fn slice<'a, T>(first: *const T, count: u32) -> &'a [T] {
    match count {
        0 => &[],
        _ => unsafe { std::slice::from_raw_parts(first, count as usize) },
    }
}

/// Answers a question for a list: the count, or as many elements as there is room for.
unsafe fn list<T: Copy>(all: &[T], count: *mut u32, to: *mut T) -> vk::Result {
    let room = unsafe { *count } as usize;
    if to.is_null() {
        unsafe { *count = all.len() as u32 };
        return vk::Result::SUCCESS;
    }
    let given = all.len().min(room);
    unsafe {
        std::ptr::copy_nonoverlapping(all.as_ptr(), to, given);
        *count = given as u32;
    }
    if given < all.len() { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
}

/// Structs of a chain of extensions.
unsafe fn chain(first: *const std::ffi::c_void) -> impl Iterator<Item = *mut vk::BaseOutStructure<'static>> {
    let mut next = first.cast_mut().cast::<vk::BaseOutStructure<'static>>();
    std::iter::from_fn(move || {
        let here = next;
        if here.is_null() {
            return None;
        }
        next = unsafe { (*here).p_next };
        Some(here)
    })
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
