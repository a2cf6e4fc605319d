//! Findings of a scan: kinds, texts and cures.

use labelgs_scene::SceneProblem;
use labelgs_scene::words::name_of;
use serde::Serialize;
use std::collections::BTreeMap;

/// A kind of problem in a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CaptureProblem {
    /// Photos of the scene were omitted.
    LeftOut,
    /// Photos of the capture have no pose.
    Unposed,
    /// Poses and points do not share a frame.
    Frame,
    /// Most points that the photo should show lie behind its camera.
    Behind,
    /// Points are far from where the photo shows them.
    Reprojection,
    /// The photo is less sharp than its neighbours.
    Blur,
    /// The photo is brighter or darker than the mean photo, judged by shared points.
    Exposure,
    /// The photo's tint differs from the mean photo's, judged by shared points.
    WhiteBalance,
    /// Hardly any of the photo's points appears in other photos.
    Alone,
    /// The surroundings do not follow the poses, as around an object on a turntable.
    Surroundings,
    /// Sizes or distances that training cannot handle well.
    Scale,
}

impl CaptureProblem {
    /// Returns the display name.
    pub fn text(self) -> String {
        name_of(&self).replace('-', " ")
    }

    /// Returns what to do about the problem.
    pub fn cure(self) -> &'static str {
        match self {
            Self::LeftOut => "restore or repair them, or remove them from the list",
            Self::Unposed => "find the poses of all photos in one model, with more overlap, or take the larger model",
            Self::Frame => "set the pose convention, or export poses and points in the convention of their format",
            Self::Behind | Self::Reprojection => "remove the photo, or run the bundle adjustment again",
            Self::Blur => "remove the photo",
            Self::Exposure | Self::WhiteBalance => {
                "train gains of each photo (exposure), or take photos with fixed exposure and white balance"
            }
            Self::Alone => "remove the photo, or add photos between it and the others",
            Self::Surroundings => "make masks of the object, and train it alone (masked_only)",
            Self::Scale => "scale and centre the reconstruction, or remove outlier points",
        }
    }

    /// Returns the cure if most photos have the problem, so that removing them is no option.
    fn cure_of_most(self) -> &'static str {
        match self {
            Self::Behind => {
                "export the poses with the convention of the format: its axes, and world-to-camera or camera-to-world as it \
                 says"
            }
            Self::Alone => {
                "take poses and points from the same reconstruction, with the axes of its format; if they are, match \
                 photos again with more overlap"
            }
            Self::Reprojection => "run the bundle adjustment again",
            _ => self.cure(),
        }
    }
}

/// A problem of a capture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Kind.
    pub fault: CaptureProblem,
    /// Name of the photo, if the problem concerns one.
    pub view: Option<String>,
    /// Description with numbers.
    pub text: String,
    /// What to do about it.
    pub cure: &'static str,
}

impl Finding {
    pub(super) fn new(fault: CaptureProblem, view: Option<&str>, text: String) -> Self {
        Self { fault, view: view.map(str::to_owned), text, cure: fault.cure() }
    }
}

/// Converts a problem found while reading the scene to a finding.
pub(super) fn from_scene_problem(flaw: &SceneProblem) -> Finding {
    let fault = match flaw {
        SceneProblem::LeftOut(_) => CaptureProblem::LeftOut,
        SceneProblem::Unposed(_) => CaptureProblem::Unposed,
        SceneProblem::Frame(_) => CaptureProblem::Frame,
    };
    Finding::new(fault, None, flaw.text().to_owned())
}

/// Sorts findings by kind and photo. A kind found in most of the `views` becomes a single finding about the scene,
/// because it has a single cause.
pub(super) fn joined(found: Vec<Finding>, views: usize) -> Vec<Finding> {
    let mut kinds: BTreeMap<CaptureProblem, Vec<Finding>> = BTreeMap::new();
    found.into_iter().for_each(|finding| kinds.entry(finding.fault).or_default().push(finding));
    let of_kind = |(fault, mut found): (CaptureProblem, Vec<Finding>)| {
        found.sort_by(|a, b| a.view.cmp(&b.view));
        let (of_views, of_scene): (Vec<_>, Vec<_>) = found.into_iter().partition(|of| of.view.is_some());
        match &of_views[..] {
            [first, _, ..] if 2 * of_views.len() > views => {
                let (count, name) = (of_views.len(), first.view.as_deref().unwrap_or_default());
                let text = format!("{count} of {views} photos, such as {name}: {}", first.text);
                let joined = Finding { fault, view: None, text, cure: fault.cure_of_most() };
                [vec![joined], of_scene].concat()
            }
            _ => [of_scene, of_views].concat(),
        }
    };
    kinds.into_iter().flat_map(of_kind).collect()
}
