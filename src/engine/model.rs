//! Converts the model between the host and the vec4 planes on the device.

use super::EngineSize;
use super::label_ids::LabelIds;
use super::late::{self, PendingUpdates};
use crate::error::{Error, Result};
use crate::pass::MODEL_ATTRIBUTES;
use crate::scene::{Gaussians, LABEL_MAX, UNLABELLED};
use crate::scheduler::Scheduler;
use crate::scheduler::plan::Buf;

/// Colour planes after the first: plane, floats per Gaussian, and floats above degree 0 in earlier planes.
const HIGHER_COLOUR_PLANES: [(Buf, usize, usize); 3] = [(Buf::SH1, 8, 1), (Buf::SH2, 16, 9), (Buf::SH3, 20, 25)];

/// Writes the planes and sets the optimiser state to 0. Returns the label ids on the device.
pub(super) fn upload(sched: &mut Scheduler, model: &Gaussians, size: &EngineSize) -> Result<LabelIds> {
    model.check()?;
    let with = |rows: &[[f32; 3]], last: &dyn Fn(usize) -> f32| -> Vec<[f32; 4]> {
        rows.iter().enumerate().map(|(i, &[x, y, z])| [x, y, z, last(i)]).collect()
    };
    sched.upload(Buf::MEANS, 0, 0, &with(&model.means, &|i| model.opacities[i]))?;
    sched.upload(Buf::SCALES, 0, 0, &with(&model.scales, &|_| 0.0))?;
    sched.upload(Buf::QUATS, 0, 0, &model.quats)?;
    sched.upload(Buf::SH0, 0, 0, &with(&model.sh0, &|i| model.rest(i).first().map_or(0.0, |first| first[0])))?;
    for (plane, floats, before) in HIGHER_COLOUR_PLANES {
        let mut words = vec![0.0_f32; model.len() * floats];
        for (row, to) in words.chunks_exact_mut(floats).enumerate() {
            let from = model.rest(row).as_flattened().get(before..).unwrap_or_default();
            let count = floats.min(from.len());
            to[..count].copy_from_slice(&from[..count]);
        }
        sched.upload(plane, 0, 0, &words)?;
    }
    for plane in MODEL_ATTRIBUTES.iter().flat_map(|a| a.moments(size.half_moments)).chain([&Buf::DENSIFY_STATS]) {
        sched.fill(*plane, 0)?;
    }
    match (size.labels, &model.labels) {
        (None, _) => Ok(LabelIds::default()),
        (Some(_), None) => {
            sched.upload(Buf::LABELS, 0, 0, &vec![UNLABELLED; model.len()])?;
            Ok(LabelIds::default())
        }
        (Some(_), Some(labels)) => upload_labels(sched, labels, size),
    }
}

/// Writes the labels.
pub(super) fn upload_labels(sched: &mut Scheduler, labels: &[u32], size: &EngineSize) -> Result<LabelIds> {
    let (ids, labels) = LabelIds::pack(labels)?;
    if ids.are_packed() && size.trained {
        let problem = format!("a label of the model is above {LABEL_MAX}, the largest mask id; give it a smaller id");
        return Err(Error::usage("labels", problem));
    }
    sched.upload(Buf::LABELS, 0, 0, &labels)?;
    Ok(ids)
}

/// Reads the planes of `count` Gaussians without labels; with `late`, after applying missed updates.
pub(super) fn download(
    sched: &mut Scheduler,
    late: Option<&PendingUpdates>,
    count: usize,
    sh_degree: u32,
) -> Result<Gaussians> {
    let xyz = |rows: &[[f32; 4]]| rows.iter().map(|&[x, y, z, _]| [x, y, z]).collect::<Vec<_>>();
    let mut rows = |plane: Buf| late::read(sched, late, plane, 4 * count).map(|all| all.as_chunks::<4>().0.to_vec());
    let (means, sh0) = (rows(Buf::MEANS)?, rows(Buf::SH0)?);
    let mut model = Gaussians {
        means: xyz(&means),
        opacities: means.iter().map(|row| row[3]).collect(),
        scales: xyz(&rows(Buf::SCALES)?),
        quats: rows(Buf::QUATS)?,
        sh0: xyz(&sh0),
        sh_degree,
        ..Gaussians::default()
    };
    let rest = model.rest_per_gaussian();
    model.sh_rest = vec![[0.0; 3]; count * rest];
    model.sh_rest.chunks_exact_mut(rest.max(1)).zip(&sh0).for_each(|(to, from)| to[0][0] = from[3]);
    for (plane, floats, before) in HIGHER_COLOUR_PLANES.into_iter().filter(|plane| plane.2 < 3 * rest) {
        let words = late::read(sched, late, plane, count * floats)?;
        for (to, from) in model.sh_rest.chunks_exact_mut(rest).zip(words.chunks_exact(floats)) {
            let to = &mut to.as_flattened_mut()[before..];
            let count = floats.min(to.len());
            to[..count].copy_from_slice(&from[..count]);
        }
    }
    Ok(model)
}
