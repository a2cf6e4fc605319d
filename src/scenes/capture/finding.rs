//! What a scan finds: kinds, texts, cures.

use labelgs_scene::SceneProblem;
use labelgs_scene::words::name_of;
use serde::Serialize;
use std::collections::BTreeMap;

/// A kind of fault in a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// Photos that the scene lists were left out.
    LeftOut,
    /// Photos of the capture have no pose.
    Unposed,
    /// Poses and points are not in one frame.
    Frame,
    /// Most points that the photo is said to show lie behind its camera.
    Behind,
    /// Points are far from where the photo shows them.
    Reprojection,
    /// The photo is less sharp than those beside it.
    Blur,
    /// The photo is brighter or darker than the mean photo, by the points that photos share.
    Exposure,
    /// The photo has another tint than the mean photo, by the points that photos share.
    WhiteBalance,
    /// Hardly any point of the photo is seen by others.
    Alone,
    /// The surroundings do not follow the poses, as around an object on a turntable.
    Surroundings,
    /// Sizes or distances that training cannot handle well.
    Scale,
}

impl Fault {
    /// Returns the display name.
    pub fn text(self) -> String {
        name_of(&self).replace('-', " ")
    }

    /// Returns what to do about it.
    pub fn cure(self) -> &'static str {
        match self {
            Self::LeftOut => "bring them back or mend them, or take them off the list",
            Self::Unposed => "find the poses of all photos in one model, with more overlap, or take the larger model",
            Self::Frame => "say what the poses mean, or export poses and points in the convention of their format",
            Self::Behind | Self::Reprojection => "leave the photo out, or adjust the reconstruction again",
            Self::Blur => "leave the photo out",
            Self::Exposure | Self::WhiteBalance => {
                "train gains of each photo (exposure), or take photos with fixed exposure and white balance"
            }
            Self::Alone => "leave the photo out, or add photos between it and the others",
            Self::Surroundings => "make masks of the object, and train it alone (masked_only)",
            Self::Scale => "scale and centre the reconstruction, or remove stray points",
        }
    }

    /// Returns what to do about it where most photos have it: they cannot all be left out.
    fn cure_of_most(self) -> &'static str {
        match self {
            Self::Behind => {
                "export the poses with the convention of the format: its axes, and world-to-camera or camera-to-world as it \
                 says"
            }
            Self::Alone => {
                "take poses and points from one reconstruction, with the axes that its format says; if they are, match the \
                 photos again with more overlap"
            }
            Self::Reprojection => "adjust the reconstruction again",
            _ => self.cure(),
        }
    }
}

/// A fault of a capture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Kind.
    pub fault: Fault,
    /// Name of the photo, if the fault is that of one.
    pub view: Option<String>,
    /// Description with numbers.
    pub text: String,
    /// What to do about it.
    pub cure: &'static str,
}

impl Finding {
    pub(super) fn new(fault: Fault, view: Option<&str>, text: String) -> Self {
        Self { fault, view: view.map(str::to_owned), text, cure: fault.cure() }
    }
}

/// Returns a flaw of the scene as a finding.
pub(super) fn of_flaw(flaw: &SceneProblem) -> Finding {
    let fault = match flaw {
        SceneProblem::LeftOut(_) => Fault::LeftOut,
        SceneProblem::Unposed(_) => Fault::Unposed,
        SceneProblem::Frame(_) => Fault::Frame,
    };
    Finding::new(fault, None, flaw.text().to_owned())
}

/// Returns findings by kind and photo. One for the scene replaces those of the same kind in most of its `views`: they have one
/// cause.
pub(super) fn joined(found: Vec<Finding>, views: usize) -> Vec<Finding> {
    let mut kinds: BTreeMap<Fault, Vec<Finding>> = BTreeMap::new();
    found.into_iter().for_each(|finding| kinds.entry(finding.fault).or_default().push(finding));
    let of_kind = |(fault, mut found): (Fault, Vec<Finding>)| {
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
