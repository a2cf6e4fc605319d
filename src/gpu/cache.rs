//! Keeps compiled pipelines between runs, if the driver returns them (VkPipelineCache).

use super::call::vk_call;
use super::capabilities::Capabilities;
use ash::vk;
use std::fmt::Debug;
use std::sync::Arc;

/// Storage of compiled pipelines between runs. A failure only costs time at the next start, so it is not reported as an
/// error.
pub trait PipelineStore: Debug + Send + Sync {
    /// Returns the saved data of a device; empty if there is none.
    fn load(&self, device: &str) -> Vec<u8>;
    /// Saves `data` for the next run.
    fn save(&self, device: &str, data: &[u8]);
}

/// The pipeline cache of a device; without a store, it is lost when the process ends.
pub(super) struct PipelineCache {
    handle: vk::PipelineCache,
    store: Option<Arc<dyn PipelineStore>>,
    /// Number of bytes that the store returned.
    loaded: usize,
    device: String,
}

impl PipelineCache {
    /// If the driver refuses the cache or its saved contents, the engine runs without a cache.
    pub(super) fn new(
        device: &ash::Device,
        capabilities: &Capabilities,
        store: Option<&Arc<dyn PipelineStore>>,
    ) -> Self {
        let name = capabilities.uuid_text();
        let data = store.map_or_else(Vec::new, |store| store.load(&name));
        let make = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the device is alive. The driver checks the data's header; the store checks all of the data.
            vk_call("vkCreatePipelineCache", || unsafe { device.create_pipeline_cache(&info, None) })
        };
        let handle = make(&data).or_else(|_| make(&[])).unwrap_or_default();
        Self { handle, store: store.cloned(), loaded: data.len(), device: name }
    }

    pub(super) fn raw(&self) -> vk::PipelineCache {
        self.handle
    }

    /// Passes new pipelines to the store and frees the cache; the device is destroyed next.
    pub(super) fn close(&mut self, device: &ash::Device) {
        // The handle is null if the driver refused a cache.
        if let Some(store) = self.store.as_ref().filter(|_| self.handle != vk::PipelineCache::null()) {
            // SAFETY: device and cache are alive. A lost device returns nothing.
            let data = unsafe { device.get_pipeline_cache_data(self.handle) }.unwrap_or_default();
            if !data.is_empty() && data.len() != self.loaded {
                store.save(&self.device, &data);
            }
        }
        // SAFETY: no pipeline is under construction. Destroying a null handle does nothing.
        unsafe { device.destroy_pipeline_cache(self.handle, None) };
        self.handle = vk::PipelineCache::null();
    }
}
