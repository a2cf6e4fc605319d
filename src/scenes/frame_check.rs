//! Tests whether poses, points and photos of a scene share a frame, and if not, names the convention that fits.
//!
//! Poses with other axes, or inverted ones, read without an error. The cameras then look at nothing, and training
//! produces floaters.

use super::pose_convention::{Native, PoseConvention};
use labelgs_files::names::shortened;
use labelgs_scene::agreement::{Agreement, Sample};
use labelgs_scene::{Dataset, Result, SceneProblem, Setting, View};

/// Fewest points for judging a scene.
const POINTS_MIN: usize = 50;
/// Points and photos do not fit if their colour correlation is below the first value, and fit if it is above the
/// second. Correct scenes have 0.5 to 0.95, wrong ones -0.1 to 0.2.
const COLOUR_CORRELATION_MIN: f64 = 0.2;
const COLOUR_CORRELATION_GOOD: f64 = 0.3;
/// A scene without photos is examined more closely if the mean share of points inside an image is below this value.
const SHARE_MIN: f64 = 0.02;
/// Another convention is convincing above this share, and above this multiple of the current share.
const SHARE_GOOD: f64 = 0.05;
const SHARE_RATIO_MIN: f64 = 4.0;

/// The results of the check.
#[derive(Default)]
struct FrameFindings {
    /// Problems.
    flaws: Vec<String>,
    /// Possible problems.
    notes: Vec<String>,
}

/// Compares the points of a scene with its views and notes problems. `native` is the convention of its file; `None` if
/// its views are cube faces or `given` overrides it.
pub(super) fn check(dataset: &mut Dataset, native: Option<Native>, given: PoseConvention) -> Result<()> {
    let found = find(dataset, native, given)?;
    dataset.notes.extend(found.flaws.iter().cloned().chain(found.notes));
    dataset.flaws.extend(found.flaws.into_iter().map(SceneProblem::Frame));
    Ok(())
}

fn find(dataset: &Dataset, native: Option<Native>, given: PoseConvention) -> Result<FrameFindings> {
    let views = dataset.all();
    let mut found = FrameFindings::default();
    let sample = Sample::new(&views, dataset.points.iter().copied())?;
    if sample.point_count() < POINTS_MIN || views.len() < 2 {
        return Ok(found);
    }
    let as_is = sample.agreement(|_| ());
    let is_empty = as_is.in_median_picture * sample.point_count() as f64 <= 1.0;
    if !is_doubtful(&as_is, is_empty) {
        found.notes.extend(blind(&sample, &views, &as_is));
        return Ok(found);
    }
    let others = native.into_iter().flat_map(|native| native.others().into_iter().map(move |other| (native, other)));
    let compared = others.map(|(native, other)| (other, sample.agreement(|camera| other.apply(native, camera))));
    let convincing = compared.filter(|(_, other)| convinces(other, &as_is));
    let merit = |of: &Agreement| of.colour.unwrap_or(0.0) + of.in_picture;
    let best = convincing.max_by(|(_, a), (_, b)| merit(a).total_cmp(&merit(b)));
    let (percent, count) = (100.0 * as_is.in_picture, dataset.points.len());
    let shown = format!("a photo shows {percent:.1} % of the {count} points on average");
    if let Some((other, with)) = best {
        found.flaws.push(format!(
            "poses and points do not fit: {shown}{}; with {} it shows {:.1} %{}. Read the scene with {}",
            colours(&as_is),
            other.text(),
            100.0 * with.in_picture,
            colours(&with),
            Setting("poses").to(other)
        ));
    } else if is_empty {
        let hint = if given.is_native() { "" } else { " as they are said to be" };
        found.flaws.push(format!(
            "poses and points do not fit{hint}: {shown}, and {:.1} % are in front of its camera. They are in different \
             frames, or the poses have another convention (see {})",
            100.0 * as_is.in_front,
            Setting("poses")
        ));
    } else if let Some(colour) = as_is.colour {
        found.notes.push(format!(
            "the colours of the points differ from the photos at their pixels (correlation {colour:.2}; usual are 0.5 \
             to 0.95): poses, points and photos may not belong together"
        ));
    }
    Ok(found)
}

/// `is_empty`: most photos show none of the points.
fn is_doubtful(as_is: &Agreement, is_empty: bool) -> bool {
    as_is.colour.map_or(is_empty || as_is.in_picture < SHARE_MIN, |colour| colour < COLOUR_CORRELATION_MIN)
}

fn convinces(other: &Agreement, as_is: &Agreement) -> bool {
    match (other.colour, as_is.colour) {
        (Some(other), as_is) => {
            other > COLOUR_CORRELATION_GOOD.max(as_is.unwrap_or(0.0) + COLOUR_CORRELATION_GOOD - COLOUR_CORRELATION_MIN)
        }
        (None, _) => other.in_picture > SHARE_GOOD.max(SHARE_RATIO_MIN * as_is.in_picture),
    }
}

fn colours(of: &Agreement) -> String {
    of.colour.map_or(String::new(), |colour| format!(", whose colours have a correlation of {colour:.2} with it"))
}

/// Names photos that show no points although most photos show many.
fn blind(sample: &Sample, views: &[&View], as_is: &Agreement) -> Option<String> {
    if as_is.in_median_picture < SHARE_GOOD {
        return None;
    }
    let sees_none = |view: &&&View| sample.is_unseen(&view.camera);
    let blind: Vec<&str> = views.iter().filter(sees_none).map(|view| view.name.as_str()).collect();
    (!blind.is_empty()).then(|| {
        tracing::debug!("photos that show no point: {}", blind.join(", "));
        format!(
            "{} of {} photos show none of the points, although most show {:.0} %: wrong poses, or looking away ({})",
            blind.len(),
            views.len(),
            100.0 * as_is.in_median_picture,
            shortened(&blind)
        )
    })
}
