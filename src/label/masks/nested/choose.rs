//! Chooses the groups that are objects.

use super::group::{Group, Scene};
use crate::masks::explain;
use std::collections::BTreeSet;

/// Smallest quality of an object.
const QUALITY_MIN: f64 = 0.15;
/// Smallest share of the views that must confirm an object.
const SUPPORT_MIN: f64 = 0.5;
/// Smallest share of a group that no better group covers, for it to be an object.
const OWN_SHARE_MIN: f64 = 0.5;
/// A part is a separate object if it has at least this share of the whole, and the quality and support below: for
/// example two things that touch in most views.
const APART_SHARE_MIN: f64 = 0.2;
/// Smallest quality of such a part.
const APART_QUALITY_MIN: f64 = 0.5;
/// Smallest support of such a part.
const APART_SUPPORT_MIN: f64 = 0.9;
/// Largest share that two such parts may have in common.
const APART_SHARED_MAX: f64 = 0.3;

/// Returns the groups that enough views have masks of: at least half of the views that see it, and at least `least`.
pub(super) fn confirmed(groups: Vec<Group>, least: usize) -> Vec<Group> {
    let holds =
        |group: &Group| group.quality >= QUALITY_MIN && group.support >= SUPPORT_MIN && group.best.len() >= least;
    groups.into_iter().filter(holds).collect()
}

/// Chooses objects among groups. Returns group indices, with groups that lie on top of others last. Wholes and parts
/// compete like the masks of one photo ([`explain::objects`]).
pub(super) fn objects(scene: &Scene, groups: &[Group]) -> Vec<usize> {
    let areas: Vec<f64> = groups.iter().map(|group| group.area).collect();
    let qualities: Vec<f64> = groups.iter().map(|group| group.quality).collect();
    let parts = explain::parts_of(&areas, scene.shared(groups).into_iter());
    let chosen = explain::objects(&areas, &qualities, &parts, |chosen| explained(scene, groups, chosen));
    let mut best: Vec<usize> = chosen.into_iter().collect();
    let value = |&group: &usize| groups[group].area * groups[group].quality;
    best.sort_by(|a, b| value(b).total_cmp(&value(a)).then(a.cmp(b)));
    let mut covered = vec![false; scene.weights.len()];
    best.retain(|&group| {
        let free = groups[group].rows.iter().filter(|&&row| !covered[row as usize]);
        let keeps = free.map(|&row| scene.weights[row as usize]).sum::<f64>() >= OWN_SHARE_MIN * groups[group].area;
        if keeps {
            groups[group].rows.iter().for_each(|&row| covered[row as usize] = true);
        }
        keeps
    });
    let on_top: Vec<usize> = best.iter().flat_map(|&whole| apart(scene, groups, whole, &parts[whole])).collect();
    // Groups of higher quality lie on top.
    best.sort_by(|&a, &b| groups[a].quality.total_cmp(&groups[b].quality).then(a.cmp(&b)));
    best.retain(|group| !on_top.contains(group));
    best.extend(on_top);
    best
}

/// Returns the parts of a whole that are separate objects.
fn apart(scene: &Scene, groups: &[Group], whole: usize, parts: &[usize]) -> Vec<usize> {
    let value = |group: usize| groups[group].area * groups[group].quality;
    let holds = |&part: &usize| {
        let found = &groups[part];
        found.area >= APART_SHARE_MIN * groups[whole].area
            && found.quality >= APART_QUALITY_MIN
            && found.support >= APART_SUPPORT_MIN
    };
    let mut able: Vec<usize> = parts.iter().copied().filter(holds).collect();
    able.sort_by(|&a, &b| value(b).total_cmp(&value(a)).then(a.cmp(&b)));
    let mut taken = BTreeSet::new();
    able.retain(|&part| {
        let found = &groups[part];
        let shared = found.rows.iter().filter(|row| taken.contains(*row)).map(|&row| scene.weights[row as usize]);
        let keeps = shared.sum::<f64>() < APART_SHARED_MAX * found.area;
        if keeps {
            taken.extend(found.rows.iter().copied());
        }
        keeps
    });
    able
}

/// Returns the sum over Gaussians of weight times the best quality among their groups.
fn explained(scene: &Scene, groups: &[Group], chosen: &BTreeSet<usize>) -> f64 {
    let mut best = std::collections::BTreeMap::new();
    for &group in chosen {
        for &row in &groups[group].rows {
            let known: &mut f64 = best.entry(row).or_insert(0.0);
            *known = known.max(groups[group].quality);
        }
    }
    best.into_iter().map(|(row, quality): (u32, f64)| quality * scene.weights[row as usize]).sum()
}
