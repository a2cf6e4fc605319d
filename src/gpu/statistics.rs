//! Statistics of compiled kernels, as reported by the driver (VK_KHR_pipeline_executable_properties).

use super::call::vk_call;
use super::capabilities::Capabilities;
use super::{Gpu, Pipeline};
use crate::error::{Error, Result};
use crate::shaders::ShaderDesc;
use ash::vk;

/// A statistic of a compiled kernel, under the driver's name for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistic {
    /// Name, such as `VGPRs` or `Register Count`.
    pub name: String,
    /// Value.
    pub value: f64,
}

/// The extension's functions.
pub(super) type StatisticFunctions = ash::khr::pipeline_executable_properties::Device;

/// The error for a driver without the extension.
pub(super) fn unknown(device: &Capabilities) -> Error {
    Error::NoDevice(format!(
        "{} ({} {}) does not report statistics of compiled kernels: the driver lacks \
        VK_KHR_pipeline_executable_properties",
        device.name, device.driver_name, device.driver_info
    ))
}

impl Gpu {
    /// Flags for new pipelines.
    pub(super) fn pipeline_flags(&self) -> vk::PipelineCreateFlags {
        match self.statistics {
            Some(_) => vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR,
            None => vk::PipelineCreateFlags::empty(),
        }
    }

    /// Compiles a kernel for a subgroup size, and returns the compiler's statistics. `spec` has the
    /// specialisation constants.
    pub fn statistics(&self, shader: &'static ShaderDesc, spec: &[u32], size: u32) -> Result<Vec<Statistic>> {
        let Some(functions) = &self.statistics else { return Err(unknown(&self.capabilities)) };
        let pipeline = Pipeline::new(self, shader, (spec, &self.windows(shader, &[])), self.pinned(shader, size))?;
        // A compute pipeline is one executable.
        let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline.raw()).executable_index(0);
        let found = vk_call("vkGetPipelineExecutableStatisticsKHR", || {
            // SAFETY: the pipeline was created with the flag that captures statistics, and lives until the end.
            unsafe { functions.get_pipeline_executable_statistics(&info) }
        })?;
        Ok(found.iter().map(statistic).collect())
    }
}

fn statistic(found: &vk::PipelineExecutableStatisticKHR<'_>) -> Statistic {
    let name = found.name_as_c_str().map_or_else(|_| String::new(), |name| name.to_string_lossy().into_owned());
    type Format = vk::PipelineExecutableStatisticFormatKHR;
    // SAFETY: the format says which field of the union the driver wrote.
    let value = unsafe {
        match found.format {
            Format::BOOL32 => f64::from(found.value.b32),
            Format::INT64 => found.value.i64 as f64,
            Format::UINT64 => found.value.u64 as f64,
            _ => found.value.f64,
        }
    };
    Statistic { name, value }
}
