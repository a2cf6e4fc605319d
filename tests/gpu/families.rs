//! What devices of each family get: the table of `tools/bench/devices.md`, from the limits that drivers and vendors
//! report.

use crate::support::device::device;
use labelgs::gpu::{Capabilities, DeviceKind, Subgroup};
use labelgs::pass::{KernelShape, Update};

/// Limits of a family.
struct Family {
    name: &'static str,
    /// Invocations of its subgroups: the default, the least and the most; `false` if no pipeline can pin them.
    subgroup: ([u32; 3], bool),
    /// Bytes of shared memory, and invocations of a workgroup.
    shared: u32,
    invocations: u32,
    storage_buffers: u32,
}

/// The AMD rows are Mesa's own, which compiles here; others are what drivers have reported in public.
const FAMILIES: [Family; 8] = [
    family("NVIDIA", ([32, 32, 32], true), 48 << 10, 1024, 1 << 20),
    family("AMD, RDNA (Mesa)", ([64, 32, 64], true), 64 << 10, 1024, 8_388_606),
    family("AMD, GCN (Mesa)", ([64, 64, 64], true), 64 << 10, 1024, 8_388_606),
    family("Intel (Mesa)", ([32, 8, 32], true), 64 << 10, 1024, 64),
    family("Apple (MoltenVK)", ([32, 32, 32], true), 32 << 10, 1024, 31),
    family("Qualcomm Adreno", ([64, 64, 128], false), 32 << 10, 1024, 24),
    family("Arm Mali", ([16, 16, 16], true), 32 << 10, 512, 35),
    family("least that Vulkan has", ([4, 4, 4], false), 16 << 10, 128, 4),
];

const fn family(
    name: &'static str,
    subgroup: ([u32; 3], bool),
    shared: u32,
    invocations: u32,
    storage_buffers: u32,
) -> Family {
    Family { name, subgroup, shared, invocations, storage_buffers }
}

impl Family {
    fn capabilities(&self, of: &Capabilities) -> Capabilities {
        let mut own = of.clone();
        own.kind = DeviceKind::Discrete;
        let (limits, ([default, min, max], is_pinned)) = (&mut own.limits, self.subgroup);
        limits.max_shared = self.shared;
        limits.max_invocations = self.invocations;
        limits.max_group_size = [self.invocations, self.invocations, 64];
        limits.plan.max_storage_buffers = self.storage_buffers;
        limits.plan = limits.plan.packed();
        let is_emulated = !is_pinned;
        own.subgroup.size = if is_emulated { 32 } else { Subgroup::preferred_size(default, min, max) };
        (own.subgroup.is_emulated, own.subgroup.max_per_group) = (is_emulated, u32::MAX);
        own
    }

    /// A row of the table.
    fn row(&self, of: &Capabilities) -> String {
        let shape = KernelShape::for_device(&self.capabilities(of));
        shape.check().expect("a shape");
        let sort = if shape.sweeps() { "look back" } else { "by lanes" };
        let splats = if shape.group_walks { "look back" } else { "by lanes" };
        let blend = if shape.group_blend.is_some() { "workgroups" } else { "subgroups" };
        let loss = match shape.loss_tile {
            0 => "a pass a filter".to_owned(),
            tile => format!("tiles of {tile}"),
        };
        let update = if shape.update == Update::Split { "split" } else { "one kernel" };
        let emulated = if shape.emulated { ", emulated" } else { "" };
        format!(
            "| {} | {} KiB, {}, {} | {}{emulated} | {} x {} | {sort} | {splats} | {blend} | {loss} | {update} |",
            self.name,
            self.shared >> 10,
            self.invocations,
            self.storage_buffers,
            shape.subgroup,
            shape.tile_width,
            shape.tile_height,
        )
    }
}

#[test]
fn the_table_of_families_is_that_of_the_program() {
    let Some(turn) = device() else { return };
    let rows: Vec<String> = FAMILIES.iter().map(|family| family.row(turn.capabilities())).collect();
    let page = include_str!("../../tools/bench/devices.md");
    for row in &rows {
        assert!(page.contains(row.as_str()), "the table of families in tools/bench/devices.md:\n{}", rows.join("\n"));
    }
    // No device needs more than the least.
    let [.., least] = FAMILIES;
    for (what, limit) in [("storage buffers per shader", least.storage_buffers), ("workgroup size", least.invocations)]
    {
        let need = turn.capabilities().needs.iter().find(|need| need.what == what).expect("a need");
        assert_eq!(need.needed, limit.to_string(), "{what}");
    }
}
