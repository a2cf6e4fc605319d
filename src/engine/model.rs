//! Converts the model between its host form and the planes of vec4 on the device.

use super::EngineSize;
use super::label_ids::LabelIds;
use super::late::{self, Late};
use crate::error::{Error, Result};
use crate::pass::ATTRIBUTES;
use crate::scene::{Gaussians, LABEL_MAX, UNLABELLED};
use crate::scheduler::Scheduler;
use crate::scheduler::plan::Buf;

/// Bands above degree 0: plane, vec4 per Gaussian, first coefficient (without degree 0), number of coefficients.
const BANDS: [(Buf, usize, usize, usize); 3] = [(Buf::SH1, 3, 0, 3), (Buf::SH2, 4, 3, 5), (Buf::SH3, 6, 8, 7)];

/// Writes the planes; sets the optimiser state to 0. Returns the ids of the labels on the device.
pub(super) fn upload(sched: &mut Scheduler, model: &Gaussians, size: &EngineSize) -> Result<LabelIds> {
    model.check()?;
    let with = |rows: &[[f32; 3]], last: &dyn Fn(usize) -> f32| -> Vec<[f32; 4]> {
        rows.iter().enumerate().map(|(i, &[x, y, z])| [x, y, z, last(i)]).collect()
    };
    sched.upload(Buf::MEANS, 0, 0, &with(&model.means, &|i| model.opacities[i]))?;
    sched.upload(Buf::SCALES, 0, 0, &with(&model.scales, &|_| 0.0))?;
    sched.upload(Buf::QUATS, 0, 0, &model.quats)?;
    sched.upload(Buf::SH0, 0, 0, &with(&model.sh0, &|_| 0.0))?;
    let rest = model.rest_per_gaussian();
    for (plane, stride, first, count) in BANDS {
        let mut words = vec![0.0_f32; model.len() * stride * 4];
        if first < rest {
            for (row, out) in words.chunks_exact_mut(stride * 4).enumerate() {
                let from = row * rest + first;
                out[..count * 3].copy_from_slice(model.sh_rest[from..from + count].as_flattened());
            }
        }
        sched.upload(plane, 0, 0, &words)?;
    }
    for plane in ATTRIBUTES.iter().flat_map(|a| a.moments(size.half_moments)).chain([&Buf::DENSIFY_STATS]) {
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
        let problem =
            format!("a label of the model is above {LABEL_MAX}, the largest id of masks; give it a smaller one");
        return Err(Error::usage("labels", problem));
    }
    sched.upload(Buf::LABELS, 0, 0, &labels)?;
    Ok(ids)
}

/// Reads the planes of `count` Gaussians; without labels. `late`: with the updates that they have missed.
pub(super) fn download(sched: &mut Scheduler, late: Option<&Late>, count: usize, sh_degree: u32) -> Result<Gaussians> {
    let xyz = |rows: &[[f32; 4]]| rows.iter().map(|&[x, y, z, _]| [x, y, z]).collect::<Vec<_>>();
    let mut rows = |plane: Buf| late::read(sched, late, plane, 4 * count).map(|all| all.as_chunks::<4>().0.to_vec());
    let means = rows(Buf::MEANS)?;
    let mut model = Gaussians {
        means: xyz(&means),
        opacities: means.iter().map(|row| row[3]).collect(),
        scales: xyz(&rows(Buf::SCALES)?),
        quats: rows(Buf::QUATS)?,
        sh0: xyz(&rows(Buf::SH0)?),
        sh_degree,
        ..Gaussians::default()
    };
    let rest = model.rest_per_gaussian();
    model.sh_rest = vec![[0.0; 3]; count * rest];
    for (plane, stride, first, coefficients) in BANDS.into_iter().filter(|band| band.2 < rest) {
        let words = late::read(sched, late, plane, count * stride * 4)?;
        for (row, words) in words.chunks_exact(stride * 4).enumerate() {
            let to = row * rest + first;
            model.sh_rest[to..to + coefficients].as_flattened_mut().copy_from_slice(&words[..coefficients * 3]);
        }
    }
    Ok(model)
}
