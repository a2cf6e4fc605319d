//! Compiled pipelines that outlive the process, where the driver hands them out (VkPipelineCache).

use super::call::vk_call;
use super::capabilities::Capabilities;
use ash::vk;
use std::fmt::Debug;
use std::sync::Arc;

/// Where compiled pipelines are kept between runs. Failing at it costs time at the next start and nothing else, so that
/// neither way returns an error.
pub trait PipelineStore: Debug + Send + Sync {
    /// What was saved for a device, empty if nothing was.
    fn load(&self, device: &str) -> Vec<u8>;
    /// Keeps `data` for the next run.
    fn save(&self, device: &str, data: &[u8]);
}

/// The cache of a device; without a store it lasts as long as the process.
pub(super) struct PipelineCache {
    handle: vk::PipelineCache,
    store: Option<Arc<dyn PipelineStore>>,
    /// Bytes that came from the store.
    loaded: usize,
    device: String,
}

impl PipelineCache {
    /// A driver that refuses a cache, or what was in it, does without one.
    pub(super) fn new(
        device: &ash::Device,
        capabilities: &Capabilities,
        store: Option<&Arc<dyn PipelineStore>>,
    ) -> Self {
        let name = capabilities.uuid_text();
        let data = store.map_or_else(Vec::new, |store| store.load(&name));
        let make = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the device is alive. The driver checks the header of the data, the store all of it.
            vk_call("vkCreatePipelineCache", || unsafe { device.create_pipeline_cache(&info, None) })
        };
        let handle = make(&data).or_else(|_| make(&[])).unwrap_or_default();
        Self { handle, store: store.cloned(), loaded: data.len(), device: name }
    }

    pub(super) fn raw(&self) -> vk::PipelineCache {
        self.handle
    }

    /// Hands new pipelines to the store and frees the cache, whose device is about to go.
    pub(super) fn close(&mut self, device: &ash::Device) {
        // There is none where the driver refused one.
        if let Some(store) = self.store.as_ref().filter(|_| self.handle != vk::PipelineCache::null()) {
            // SAFETY: device and cache are alive. A lost device has nothing to hand out.
            let data = unsafe { device.get_pipeline_cache_data(self.handle) }.unwrap_or_default();
            if !data.is_empty() && data.len() != self.loaded {
                store.save(&self.device, &data);
            }
        }
        // SAFETY: no pipeline is being made. Destroying a null handle does nothing.
        unsafe { device.destroy_pipeline_cache(self.handle, None) };
        self.handle = vk::PipelineCache::null();
    }
}
