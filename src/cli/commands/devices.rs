//! `labelgs devices`.

use crate::cli::support::Context;
use crate::gpu::{self, Capabilities, Requirement};
use crate::pass::KernelShape;
use crate::{Error, Result};
use serde_json::{Value, json};

/// Prints the devices. Fails if none is usable.
pub(crate) fn run(context: &Context) -> Result<()> {
    let options = context.gpu_options()?;
    let (devices, chosen) = gpu::devices(&options)?;
    let picked = chosen.as_ref().ok().copied();
    let rows: Vec<Value> = devices.iter().map(|device| to_json(device, picked)).collect();
    let text: String = devices.iter().map(|device| to_text(device, picked)).collect();
    context.show(&json!({ "schema_version": 1, "devices": rows }), &text)?;
    match (chosen, devices.is_empty()) {
        (Ok(_), _) => Ok(()),
        (Err(_), true) => Err(Error::NoDevice(
            "the Vulkan loader found no device; install a Vulkan 1.2 driver, such as Mesa's".into(),
        )),
        (Err(error), false) if options.device.is_some() => Err(error),
        (Err(_), false) => {
            Err(Error::NoDevice("no device in the list meets the requirements; see the lines marked MISSING".into()))
        }
    }
}

/// Returns the kernel shape as text.
pub(crate) fn shape_text(shape: &KernelShape) -> String {
    format!(
        "{}subgroups of {}, tiles of {} x {} px, {} reads, sort digits of {} bits",
        if shape.emulated { "emulated " } else { "" },
        shape.subgroup,
        shape.tile_width,
        shape.tile_height,
        reads(shape),
        shape.digit_bits
    )
}

/// Returns the kernel shape as JSON.
pub(crate) fn shape_json(shape: &KernelShape) -> Value {
    json!({
        "subgroup_size": shape.subgroup,
        "emulated": shape.emulated,
        "tile": [shape.tile_width, shape.tile_height],
        "reads": reads(shape),
        "digit_bits": shape.digit_bits,
    })
}

fn reads(shape: &KernelShape) -> &'static str {
    if shape.texel { "texel" } else { "storage" }
}

fn to_text(device: &Capabilities, picked: Option<usize>) -> String {
    let (major, minor, patch) = device.api_version;
    let mark = if picked == Some(device.index) { ", selected" } else { "" };
    let mut text =
        format!("{}: {} ({}, Vulkan {major}.{minor}.{patch}{mark})\n", device.index, device.name, kind(device));
    text += &format!("   driver  {} {}\n   uuid    {}\n", device.driver_name, device.driver_info, device.uuid_text());
    let (heap, usable) = (device.limits.heap >> 20, device.limits.plan.max_memory >> 20);
    text += &format!("   memory  {heap} MiB, {usable} MiB usable\n");
    text += &needs_text(device);
    if device.missing().is_empty() {
        text += &format!("   kernels {}\n", shape_text(&KernelShape::for_device(device)));
    } else {
        text += "   not supported\n";
    }
    text
}

/// Returns the required and optional features of a device, a row each.
pub(crate) fn needs_text(device: &Capabilities) -> String {
    let row = |need: &Requirement| {
        let (what, found) = (need.what, &need.found);
        let needed = if need.is_required { format!("needs {}", need.needed) } else { need.needed.clone() };
        let what = format!("{what} ({needed})");
        // A met optional feature has no drawback.
        let reason = if need.is_required || !need.is_met { need.reason } else { "" };
        format!("   {:<7} {what:<39} {found:<18} {reason}", state(need)).trim_end().to_owned() + "\n"
    };
    device.needs.iter().map(row).collect()
}

/// Returns the same features as JSON.
pub(crate) fn needs_json(device: &Capabilities) -> Vec<Value> {
    let row = |need: &Requirement| {
        json!({
            "what": need.what, "required": need.is_required, "needed": need.needed, "found": need.found,
            "met": need.is_met, "reason": need.reason,
        })
    };
    device.needs.iter().map(row).collect()
}

/// Returns a device as JSON.
pub(crate) fn to_json(device: &Capabilities, picked: Option<usize>) -> Value {
    let (major, minor, patch) = device.api_version;
    let usable = device.missing().is_empty();
    json!({
        "index": device.index,
        "name": device.name,
        "kind": kind(device),
        "vulkan": format!("{major}.{minor}.{patch}"),
        "driver": { "name": device.driver_name, "version": device.driver_info },
        "uuid": device.uuid_text(),
        "memory_bytes": device.limits.heap,
        "usable_memory_bytes": device.limits.plan.max_memory,
        "needs": needs_json(device),
        "usable": usable,
        "picked": picked == Some(device.index),
        "kernels": usable.then(|| shape_json(&KernelShape::for_device(device))),
    })
}

fn kind(device: &Capabilities) -> String {
    format!("{:?}", device.kind).to_lowercase()
}

fn state(need: &Requirement) -> &'static str {
    match (need.is_met, need.is_required) {
        (true, _) => "ok",
        (false, true) => "MISSING",
        (false, false) => "without",
    }
}
