//! Hides device features, so that tests can simulate a less capable device.

use super::capabilities::{Features, Subgroup};
use super::limits::Limits;
use crate::error::{Error, Result};
use crate::lab;
use ash::vk;

/// Names of features that can be hidden.
const HIDEABLE_FEATURES: [&str; 11] = [
    "cpu",
    "memory_model",
    "timeline",
    "robust",
    "size_control",
    "full_subgroups",
    "narrow_storage",
    "uniform_flow",
    "shuffle",
    "timestamps",
    "transfer",
];

/// The names in `LABELGS_HIDE`, separated by commas.
#[derive(Clone, Debug, Default)]
pub(super) struct HiddenFeatures(Vec<String>);

impl HiddenFeatures {
    pub(super) fn from_env() -> Result<Self> {
        let Some(text) = lab::var("LABELGS_HIDE") else { return Ok(Self::default()) };
        let names: Vec<String> = text.split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect();
        match names.iter().find(|name| !HIDEABLE_FEATURES.contains(&name.as_str())) {
            Some(name) => Err(Error::usage(
                "LABELGS_HIDE",
                format!("{name} is unknown; expected one of {}", HIDEABLE_FEATURES.join(", ")),
            )),
            None => Ok(Self(names)),
        }
    }

    fn has(&self, name: &str) -> bool {
        self.0.iter().any(|hidden| hidden == name)
    }

    /// Returns the type of the device: a software device whose CPU is hidden counts as a GPU, and gets the kernels,
    /// staging and steps in flight of one.
    pub(super) fn device_type(&self, found: vk::PhysicalDeviceType) -> vk::PhysicalDeviceType {
        if self.has("cpu") { vk::PhysicalDeviceType::DISCRETE_GPU } else { found }
    }

    pub(super) fn features(&self, features: &mut Features) {
        features.memory_model &= !self.has("memory_model");
        features.timeline &= !self.has("timeline");
        features.robust &= !self.has("robust");
        features.size_control &= !self.has("size_control");
        features.full_subgroups &= !self.has("full_subgroups");
        features.narrow_storage &= !self.has("narrow_storage");
        features.uniform_flow &= !self.has("uniform_flow");
    }

    pub(super) fn subgroup(&self, subgroup: &mut Subgroup) {
        if self.has("shuffle") {
            subgroup.operations &= !vk::SubgroupFeatureFlags::SHUFFLE;
        }
    }

    pub(super) fn transfer(&self, family: Option<u32>) -> Option<u32> {
        family.filter(|_| !self.has("transfer"))
    }

    pub(super) fn limits(&self, limits: &mut Limits) {
        if self.has("timestamps") {
            (limits.timestamp_bits, limits.timestamp_period) = (0, 0.0);
        }
    }
}
