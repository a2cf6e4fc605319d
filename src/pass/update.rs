//! Updates the Gaussians that a step touched in one kernel. All others miss the update, and catch up when something
//! touches or reads them.

use super::build::{Builder, over_gaussians};
use super::shape::Update;
use super::{Extension, KernelShape, project};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Stage};

/// Returns true if one kernel does a step's update, or only its statistic, because no extension interferes.
pub(crate) fn is_fused(shape: &KernelShape, (extension, passes): (&dyn Extension, u32)) -> bool {
    shape.update == Update::Lazy && !extension.splits_update(passes) && extension.updates_unseen(passes)
}

/// Sums the gradient records of the visible trained Gaussians. With `changes`, it also updates those with a gradient.
pub(super) fn update(b: &mut Builder, changes: bool) {
    let (sh_degree, modes) = (b.sh_degree, if changes { b.update_modes } else { 0 });
    b.list.stage = Stage::OPTIMISE;
    pass!(b, update(labels: b.supervision.has_layers(), half: b.half, poses: b.pose.is_some()) {
        step: Buf::STEP, counters: Buf::COUNTERS, splat_from_gaussian: Buf::SPLAT_FROM_GAUSSIAN,
        tiles_touched: Buf::TILES_TOUCHED, instance_offsets: Buf::INSTANCE_OFFSETS, v_instances_a: Buf::V_INSTANCES_A,
        v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C, densify_stats: Buf::DENSIFY_STATS,
        touched_at: Buf::TOUCHED_AT, missed: Buf::MISSED, means: Buf::MEANS, scales: Buf::SCALES, quats: Buf::QUATS,
        sh0: Buf::SH0, sh1: Buf::SH1, sh2: Buf::SH2, sh3: Buf::SH3, m_means: Buf::M_MEANS, m_scales: Buf::M_SCALES,
        m_quats: Buf::M_QUATS, m_sh0: Buf::M_SH0, m_sh1: Buf::M_SH1, m_sh2: Buf::M_SH2, m_sh3: Buf::M_SH3,
        u_means: Buf::U_MEANS, u_scales: Buf::U_SCALES, u_quats: Buf::U_QUATS, u_sh0: Buf::U_SH0, u_sh1: Buf::U_SH1,
        u_sh2: Buf::U_SH2, u_sh3: Buf::U_SH3, labels: Buf::LABELS, layer_from_label: Buf::LAYER_FROM_LABEL,
        pose_partials: project::POSE_PARTIALS,
    } [sh_degree: sh_degree, changes: u32::from(changes), modes: modes], over_gaussians());
    if let Some(row) = b.pose {
        project::pose_reduce(b, row, false);
    }
}

/// Gives all Gaussians the updates that they have missed.
pub(super) fn catch_up(b: &mut Builder) {
    let sh_degree = b.sh_degree;
    pass!(b, catch_up(half: b.half) {
        step: Buf::STEP, counters: Buf::COUNTERS, touched_at: Buf::TOUCHED_AT, missed: Buf::MISSED, means: Buf::MEANS,
        scales: Buf::SCALES, quats: Buf::QUATS, sh0: Buf::SH0, sh1: Buf::SH1, sh2: Buf::SH2, sh3: Buf::SH3,
        m_means: Buf::M_MEANS, m_scales: Buf::M_SCALES, m_quats: Buf::M_QUATS, m_sh0: Buf::M_SH0, m_sh1: Buf::M_SH1,
        m_sh2: Buf::M_SH2, m_sh3: Buf::M_SH3, u_means: Buf::U_MEANS, u_scales: Buf::U_SCALES, u_quats: Buf::U_QUATS,
        u_sh0: Buf::U_SH0, u_sh1: Buf::U_SH1, u_sh2: Buf::U_SH2, u_sh3: Buf::U_SH3,
    } [sh_degree: sh_degree], over_gaussians());
}
