//! Projects Gaussians to splats in depth order, and carries gradients back.

use super::KernelShape;
use super::build::{Builder, Count, ONE_GROUP, args, over_gaussians, over_splats};
use super::scan::{self, Total};
use super::sort::{self, SortBuffers};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Stage};
use crate::shaders::constants;

/// Gaussian of each splat; the depth sort ends in this buffer.
pub(super) const GAUSSIAN_FROM_SPLAT: Buf = Buf::DEPTH_VALUES_A;

/// Bits of a depth key of the CPU's form.
const DEPTH_BITS: u32 = 32;

/// Lists the visible Gaussians, projects them, and sorts them by depth. Afterwards splats are numbered by depth. With
/// look-back passes, they are numbered in model order instead, and `Buf::DEPTH_ORDER` has the depth order.
pub(super) fn visible_splats(b: &mut Builder) {
    b.list.stage = Stage::PROJECT;
    if b.shape.group_walks {
        let keys = [Buf::DEPTH_KEYS_A, Buf::DEPTH_KEYS_B];
        let buffers = SortBuffers { keys, values: [Buf::DEPTH_ORDER, Buf::DEPTH_VALUES_B], narrow: false };
        let buffers = buffers.ending_in_first(b.shape, constants::DEPTH_BITS);
        project_visible(b, buffers.keys[0]);
        sort::sort(b, buffers, constants::DEPTH_BITS, Count::Splats, "by depth", true);
        return;
    }
    pass!(b, cull {
        step: Buf::STEP, means: Buf::MEANS, scales: Buf::SCALES, depth_keys: Buf::DEPTH_KEYS,
        splat_from_gaussian: Buf::SPLAT_FROM_GAUSSIAN, counters: Buf::COUNTERS,
    } [], over_gaussians());
    let buffers = SortBuffers {
        keys: [Buf::DEPTH_KEYS_A, Buf::DEPTH_KEYS_B],
        values: [GAUSSIAN_FROM_SPLAT, Buf::DEPTH_VALUES_B],
        narrow: false,
    };
    let buffers = buffers.ending_in_first(b.shape, DEPTH_BITS);
    scan::scan_visible(b, Buf::DEPTH_KEYS, Buf::VISIBLE_OFFSETS);
    pass!(b, compact {
        step: Buf::STEP, depth_keys: Buf::DEPTH_KEYS, visible_offsets: Buf::VISIBLE_OFFSETS,
        keys_out: buffers.keys[0], values_out: buffers.values[0], counters: Buf::COUNTERS, } [], over_gaussians());
    sort::sort(b, buffers, DEPTH_BITS, Count::Splats, "by depth", false);
    project_forward(b);
    scan::scan(b, Buf::TILES_TOUCHED, Buf::INSTANCE_OFFSETS, Count::Splats, Total::Instances);
}

fn project_forward(b: &mut Builder) {
    let sh_degree = b.sh_degree;
    pass!(b, project_forward(labels: b.supervision.has_layers()) {
        step: Buf::STEP, counters: Buf::COUNTERS, gaussian_from_splat: GAUSSIAN_FROM_SPLAT, means: Buf::MEANS,
        scales: Buf::SCALES, quats: Buf::QUATS, sh0: Buf::SH0, sh1: Buf::SH1, sh2: Buf::SH2, sh3: Buf::SH3,
        splats: Buf::SPLATS, tiles_touched: Buf::TILES_TOUCHED, splat_from_gaussian: Buf::SPLAT_FROM_GAUSSIAN,
        labels: Buf::LABELS, layer_from_label: Buf::LAYER_FROM_LABEL,
    } [sh_degree: sh_degree], over_splats());
}

/// Does all of this in one pass, except the sort.
fn project_visible(b: &mut Builder, keys: Buf) {
    let (sh_degree, sort_pass, gaussians) = (b.sh_degree, b.sort_passes, b.capacity.gaussians);
    let (look_first, visible_items) = (b.next_look(gaussians), KernelShape::visible_items(gaussians));
    let labels = b.supervision.has_layers();
    pass!(b, project_visible(labels: labels, lazy: b.late, half: b.late && b.half, sweep: b.shape.sweeps()) {
        step: Buf::STEP, counters: Buf::COUNTERS, means: Buf::MEANS, scales: Buf::SCALES,
        quats: Buf::QUATS, sh0: Buf::SH0, sh1: Buf::SH1, sh2: Buf::SH2, sh3: Buf::SH3,
        splats: Buf::SPLATS, tiles_touched: Buf::TILES_TOUCHED, splat_from_gaussian: Buf::SPLAT_FROM_GAUSSIAN,
        labels: Buf::LABELS, layer_from_label: Buf::LAYER_FROM_LABEL, m_means: Buf::M_MEANS, m_scales: Buf::M_SCALES,
        m_quats: Buf::M_QUATS, m_sh0: Buf::M_SH0, m_sh1: Buf::M_SH1, m_sh2: Buf::M_SH2, m_sh3: Buf::M_SH3,
        u_means: Buf::U_MEANS, u_scales: Buf::U_SCALES, u_quats: Buf::U_QUATS, u_sh0: Buf::U_SH0, u_sh1: Buf::U_SH1,
        u_sh2: Buf::U_SH2, u_sh3: Buf::U_SH3, touched_at: Buf::TOUCHED_AT, missed: Buf::MISSED, keys_out: keys,
        gaussian_from_splat: GAUSSIAN_FROM_SPLAT, look_back: Buf::LOOK_BACK, dispatch_args: Buf::DISPATCH_ARGS,
        densify_stats: Buf::DENSIFY_STATS,
    } [sh_degree: sh_degree, sort_pass: sort_pass, look_first: look_first, visible_items: visible_items,
        marks_near: u32::from(b.marks_near), key_bits: constants::DEPTH_BITS,
        digit_bits: sort::digit_bits(b.shape, constants::DEPTH_BITS)], args(constants::ARGS_VISIBLE));
}

/// Corrects the pose of the step's camera by rows `row` and `row + 1` of the step.
pub(crate) fn pose(b: &mut Builder, row: u32) {
    b.list.stage = Stage::PROJECT;
    b.pose = Some(row);
    pass!(b, pose { step: Buf::STEP, step_rows: Buf::STEP_ROWS, shared_parameters: Buf::SHARED } [row: row], ONE_GROUP);
}

/// Partial sums of the pose's gradient; gradients of splats are no longer needed.
pub(super) const POSE_PARTIALS: Buf = Buf::V_SPLATS;

/// Writes the gradient of that correction.
pub(crate) fn pose_backward(b: &mut Builder, row: u32) {
    let sh_degree = b.sh_degree;
    b.list.stage = Stage::PROJECT_BACKWARD;
    pass!(b, pose_backward {
        step: Buf::STEP, counters: Buf::COUNTERS, gaussian_from_splat: GAUSSIAN_FROM_SPLAT, means: Buf::MEANS,
        quats: Buf::QUATS, sh0: Buf::SH0, sh1: Buf::SH1, sh2: Buf::SH2, sh3: Buf::SH3, v_means: Buf::V_MEANS,
        v_quats: Buf::V_QUATS, v_sh0: Buf::V_SH0, pose_partials: POSE_PARTIALS,
    } [sh_degree: sh_degree], over_splats());
    pose_reduce(b, row, true);
}

/// Sums the partial sums of [`pose_backward`] (`by_splat`) or of the update.
pub(super) fn pose_reduce(b: &mut Builder, row: u32, by_splat: bool) {
    pass!(b, pose_reduce {
        step: Buf::STEP, counters: Buf::COUNTERS, step_rows: Buf::STEP_ROWS, shared_parameters: Buf::SHARED,
        pose_partials: POSE_PARTIALS, v_shared: Buf::V_SHARED,
    } [row: row, by_splat: by_splat.into()], ONE_GROUP);
}

/// Carries the gradients of splats back to the parameters of their Gaussians.
pub(super) fn project_backward(b: &mut Builder) {
    let (sh_degree, modes) = (b.sh_degree, b.update_modes);
    b.list.stage = Stage::PROJECT_BACKWARD;
    pass!(b, project_backward {
        step: Buf::STEP, gaussian_from_splat: GAUSSIAN_FROM_SPLAT, means: Buf::MEANS,
        scales: Buf::SCALES, quats: Buf::QUATS, sh0: Buf::SH0, sh1: Buf::SH1, sh2: Buf::SH2, sh3: Buf::SH3,
        v_splats: Buf::V_SPLATS, v_means: Buf::V_MEANS, v_scales: Buf::V_SCALES, v_quats: Buf::V_QUATS,
        v_sh0: Buf::V_SH0, v_sh1: Buf::V_SH1, v_sh2: Buf::V_SH2, v_sh3: Buf::V_SH3, counters: Buf::COUNTERS,
        splat_from_gaussian: Buf::SPLAT_FROM_GAUSSIAN,
    } [sh_degree: sh_degree, modes: modes], over_splats());
}

#[cfg(test)]
mod tests {
    use super::GAUSSIAN_FROM_SPLAT;
    use crate::pass::buffers::Capacity;
    use crate::pass::{KernelShape, render_view};
    use crate::scheduler::plan::{Buf, Work};

    #[test]
    fn the_depth_sort_ends_in_one_buffer_whatever_its_passes() {
        for (digit_bits, passes) in [(4, 8), (7, 5), (8, 4), (11, 3), (16, 2)] {
            let shape = KernelShape { digit_bits, ..KernelShape::new(8, true) };
            let list = render_view(&shape, &Capacity { segments: 1, ..Capacity::default() }, 0, 0);
            let bound = |title: &str, name: &str| -> Vec<Buf> {
                let passes = list.work.iter().filter_map(|work| match work {
                    Work::Pass(pass) if pass.title == title => Some(pass),
                    _ => None,
                });
                let at = |binding: &crate::shaders::BindingDesc| binding.name == name;
                passes.map(|pass| pass.buffers[pass.shader.bindings.iter().position(at).expect(name)]).collect()
            };
            let sorted = bound("radix_scatter by depth", "values_out");
            assert_eq!((sorted.len(), sorted.last()), (passes, Some(&GAUSSIAN_FROM_SPLAT)), "{digit_bits} bits");
            assert_eq!(bound("compact", "values_out"), bound("radix_scatter by depth", "values_in")[..1]);
        }
    }
}
