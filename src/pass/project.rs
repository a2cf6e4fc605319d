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
    pass!(b, cull {} [], over_gaussians());
    let buffers = SortBuffers {
        keys: [Buf::DEPTH_KEYS_A, Buf::DEPTH_KEYS_B],
        values: [GAUSSIAN_FROM_SPLAT, Buf::DEPTH_VALUES_B],
        narrow: false,
    };
    let buffers = buffers.ending_in_first(b.shape, DEPTH_BITS);
    scan::scan_visible(b, Buf::DEPTH_KEYS, Buf::VISIBLE_OFFSETS);
    pass!(b, compact { keys_out: buffers.keys[0], values_out: buffers.values[0] } [], over_gaussians());
    sort::sort(b, buffers, DEPTH_BITS, Count::Splats, "by depth", false);
    project_forward(b);
    scan::scan(b, Buf::TILES_TOUCHED, Buf::INSTANCE_OFFSETS, Count::Splats, Total::Instances);
}

fn project_forward(b: &mut Builder) {
    let sh_degree = b.sh_degree;
    pass!(b, project_forward(labels: b.supervision.has_layers()) { gaussian_from_splat: GAUSSIAN_FROM_SPLAT } [sh_degree: sh_degree], over_splats());
}

/// Does all of this in one pass, except the sort.
fn project_visible(b: &mut Builder, keys: Buf) {
    let (sh_degree, sort_pass, gaussians) = (b.sh_degree, b.sort_passes, b.capacity.gaussians);
    let (look_first, visible_items) = (b.next_look(gaussians), KernelShape::visible_items(gaussians));
    let labels = b.supervision.has_layers();
    pass!(b, project_visible(labels: labels, lazy: b.late, half: b.late && b.half, sweep: b.shape.sweeps()) { keys_out: keys, gaussian_from_splat: GAUSSIAN_FROM_SPLAT } [sh_degree: sh_degree, sort_pass: sort_pass, look_first: look_first, visible_items: visible_items,
        marks_near: u32::from(b.marks_near), key_bits: constants::DEPTH_BITS,
        digit_bits: sort::digit_bits(b.shape, constants::DEPTH_BITS)], args(constants::ARGS_VISIBLE));
}

/// Corrects the pose of the step's camera by rows `row` and `row + 1` of the step.
pub(crate) fn pose(b: &mut Builder, row: u32) {
    b.list.stage = Stage::PROJECT;
    b.pose = Some(row);
    pass!(b, pose { shared_parameters: Buf::SHARED } [row: row], ONE_GROUP);
}

/// Partial sums of the pose's gradient; gradients of splats are no longer needed.
pub(super) const POSE_PARTIALS: Buf = Buf::V_SPLATS;

/// Writes the gradient of that correction.
pub(crate) fn pose_backward(b: &mut Builder, row: u32) {
    let sh_degree = b.sh_degree;
    b.list.stage = Stage::PROJECT_BACKWARD;
    pass!(b, pose_backward { gaussian_from_splat: GAUSSIAN_FROM_SPLAT, pose_partials: POSE_PARTIALS } [sh_degree: sh_degree], over_splats());
    pose_reduce(b, row, true);
}

/// Sums the partial sums of [`pose_backward`] (`by_splat`) or of the update.
pub(super) fn pose_reduce(b: &mut Builder, row: u32, by_splat: bool) {
    pass!(b, pose_reduce { shared_parameters: Buf::SHARED, pose_partials: POSE_PARTIALS } [row: row, by_splat: by_splat.into()], ONE_GROUP);
}

/// Carries the gradients of splats back to the parameters of their Gaussians.
pub(super) fn project_backward(b: &mut Builder) {
    let (sh_degree, modes) = (b.sh_degree, b.update_modes);
    b.list.stage = Stage::PROJECT_BACKWARD;
    pass!(b, project_backward { gaussian_from_splat: GAUSSIAN_FROM_SPLAT } [sh_degree: sh_degree, modes: modes], over_splats());
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
