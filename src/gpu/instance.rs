//! Loader, instance, and the messages of the validation layer.

use super::call::vk_call;
use super::lock;
use crate::error::{Error, Result};
use crate::lab::fault;
use ash::vk;
use std::ffi::{CStr, c_char, c_void};
use std::sync::{Arc, Mutex};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Checks of the validation layer, if it is installed. Only one mode is active at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validation {
    /// Nothing.
    #[default]
    Off,
    /// Correct use of the API.
    On,
    /// Also checks hazards between commands.
    Sync,
    /// Also checks memory accesses of shaders; slow.
    GpuAssisted,
}

impl std::str::FromStr for Validation {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "off" | "0" => Ok(Self::Off),
            "on" | "1" => Ok(Self::On),
            "sync" => Ok(Self::Sync),
            "gpu" => Ok(Self::GpuAssisted),
            _ => Err(Error::usage("LABELGS_VALIDATION", format!("{text} is unknown; expected off, on, sync or gpu"))),
        }
    }
}

/// A message of the validation layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// True for an error (a broken rule), false for a warning.
    pub is_error: bool,
    /// Name of the rule, such as `VUID-vkCmdDispatch-None-02706`.
    pub id: String,
    /// Text of the message.
    pub text: String,
}

/// Messages beyond this number are dropped, because a broken kernel makes one per invocation.
const MESSAGES_MAX: usize = 1000;

/// Messages of the validation layer. The log outlives the device, because destroying the device may also cause
/// messages.
#[derive(Clone, Debug, Default)]
pub struct MessageLog(Arc<Messages>);

impl MessageLog {
    /// All messages so far.
    pub fn messages(&self) -> Vec<Message> {
        lock(&self.0.0).clone()
    }
}

#[derive(Debug, Default)]
struct Messages(Mutex<Vec<Message>>);

struct Messenger {
    functions: ash::ext::debug_utils::Instance,
    handle: vk::DebugUtilsMessengerEXT,
}

/// A Vulkan instance; it outlives everything created from it.
pub(super) struct Instance {
    instance: ash::Instance,
    messenger: Option<Messenger>,
    /// The messenger keeps a pointer to the log.
    log: MessageLog,
    // Owns the loader library; the last field, because the functions above are part of the library.
    _entry: ash::Entry,
}

impl Instance {
    pub(super) fn new(validation: Validation) -> Result<Self> {
        let missing = |cause: &dyn std::fmt::Display| {
            Error::NoDevice(format!(
                "the Vulkan loader (libvulkan.so.1) cannot be loaded: {cause}; install a Vulkan driver"
            ))
        };
        if fault::injected("loader").is_some() {
            return Err(missing(&"injected fault"));
        }
        // SAFETY: loading the system's Vulkan loader runs its initialisers, as in every Vulkan program.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| missing(&error))?;
        // SAFETY: no preconditions.
        let version = vk_call("vkEnumerateInstanceVersion", || unsafe { entry.try_enumerate_instance_version() })?;
        let version = version.unwrap_or(vk::API_VERSION_1_0);
        if version < vk::API_VERSION_1_2 {
            let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
            return Err(Error::NoDevice(format!(
                "the Vulkan loader has version {major}.{minor}; 1.2 or newer is needed"
            )));
        }
        let log = MessageLog::default();
        let validated = validation != Validation::Off && has_layer(&entry)?;
        let instance = create(&entry, version.min(vk::API_VERSION_1_3), validation, validated, &log.0)?;
        let messenger = validated.then(|| Messenger::new(&entry, &instance, &log.0)).transpose();
        let messenger = messenger.inspect_err(|_| {
            // SAFETY: no object was made from the instance.
            unsafe { instance.destroy_instance(None) };
        })?;
        Ok(Self { instance, messenger, log, _entry: entry })
    }

    pub(super) fn raw(&self) -> &ash::Instance {
        &self.instance
    }

    pub(super) fn is_validated(&self) -> bool {
        self.messenger.is_some()
    }

    pub(super) fn has_debug_utils(&self) -> bool {
        self.messenger.is_some()
    }

    pub(super) fn log(&self) -> &MessageLog {
        &self.log
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some(messenger) = &self.messenger {
            // SAFETY: created by this instance, destroyed once.
            unsafe { messenger.functions.destroy_debug_utils_messenger(messenger.handle, None) };
        }
        // SAFETY: the device is the only object made from the instance; it is gone, because its owner holds this.
        unsafe { self.instance.destroy_instance(None) };
    }
}

impl Messenger {
    fn new(entry: &ash::Entry, instance: &ash::Instance, messages: &Messages) -> Result<Self> {
        let functions = ash::ext::debug_utils::Instance::new(entry, instance);
        let info = messenger_info(messages);
        // SAFETY: the callback's data outlives the messenger, see `Instance`.
        let handle = vk_call("vkCreateDebugUtilsMessengerEXT", || unsafe {
            functions.create_debug_utils_messenger(&info, None)
        })?;
        Ok(Self { functions, handle })
    }
}

fn messenger_info(messages: &Messages) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING)
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
        .pfn_user_callback(Some(on_message))
        .user_data(std::ptr::from_ref(messages).cast_mut().cast())
}

fn has_layer(entry: &ash::Entry) -> Result<bool> {
    // SAFETY: no preconditions.
    let layers =
        vk_call("vkEnumerateInstanceLayerProperties", || unsafe { entry.enumerate_instance_layer_properties() })?;
    Ok(layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER)))
}

fn create(
    entry: &ash::Entry,
    version: u32,
    validation: Validation,
    validated: bool,
    messages: &Messages,
) -> Result<ash::Instance> {
    let application = vk::ApplicationInfo::default().application_name(c"labelgs").api_version(version);
    let layers: &[*const c_char] = if validated { &[VALIDATION_LAYER.as_ptr()] } else { &[] };
    let extensions: &[*const c_char] = if validated {
        &[ash::ext::debug_utils::NAME.as_ptr(), vk::EXT_VALIDATION_FEATURES_NAME.as_ptr()]
    } else {
        &[]
    };
    let enabled: &[vk::ValidationFeatureEnableEXT] = match validation {
        Validation::Off | Validation::On => &[],
        Validation::Sync => &[vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION],
        Validation::GpuAssisted => &[
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
        ],
    };
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(enabled);
    // Receives messages about creating and destroying the instance itself.
    let mut early = messenger_info(messages);
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(layers)
        .enabled_extension_names(extensions);
    if validated {
        info = info.push_next(&mut features).push_next(&mut early);
    }
    // SAFETY: all pointers live until the call returns; `messages` lives as long as the instance.
    let created = vk_call("vkCreateInstance", || unsafe { entry.create_instance(&info, None) });
    created.map_err(|error| Error::NoDevice(format!("{error}; install a Vulkan 1.2 driver")))
}

unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    let text = |pointer: *const c_char| {
        if pointer.is_null() {
            return String::new();
        }
        // SAFETY: the layer passes strings with a terminating 0.
        unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
    };
    // SAFETY: `user` is the `Messages` given at creation, which outlives the messenger; `data` is valid here.
    let (data, messages) = unsafe { (&*data, &*user.cast::<Messages>()) };
    let is_error = severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR);
    let mut messages = lock(&messages.0);
    if messages.len() < MESSAGES_MAX {
        messages.push(Message { is_error, id: text(data.p_message_id_name), text: text(data.p_message) });
    }
    vk::FALSE
}
