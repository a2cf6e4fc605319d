//! Depths that photos are known to have: points of the reconstruction, and maps.

use crate::support::runs::{Place, stderr, succeeded};
use std::fs;

const TRAIN_FLAGS: [&str; 6] = ["--iterations", "60", "--checkpoint-every", "20", "--set", "depth_weight=0.5"];

fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    TRAIN_FLAGS.iter().copied().chain(more.iter().copied()).collect()
}

/// A stopped training goes on with the same depths, and without them the model is another one.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn a_training_with_known_depths_goes_on_from_a_checkpoint() {
    let place = Place::new();
    let maps = place.text("scene/depth");
    for (name, more) in [("points", &[][..]), ("maps", &["--depths", maps.as_str()])] {
        succeeded(&place.trained(name, &with(more)));
        let again = format!("{name}-again");
        let broken = place.trained_with(Some("vkQueueSubmit:160:DEVICE_LOST"), &again, &with(more));
        assert!(!broken.status.success() && place.checkpoints(&again)[0].step < 60);
        succeeded(&place.trained(&again, &["--resume"]));
        assert!(place.model(&again, 60) == place.model(name, 60), "{name}: the same bits");
    }
    succeeded(&place.trained("without", &[&TRAIN_FLAGS[..4], &["--set", "depth_weight=0"]].concat()));
    let models = ["points", "maps", "without"].map(|name| place.model(name, 60));
    assert!(models[0] != models[1] && models[0] != models[2] && models[1] != models[2]);
}

/// Writes PFM maps of 64 x 48 px with a depth in each half.
fn written(place: &Place, name: &str, [left, right]: [f32; 2]) -> String {
    fs::create_dir(place.path(name)).expect("a folder");
    let row = (0..64).flat_map(|x| if x < 32 { left } else { right }.to_le_bytes()).collect::<Vec<u8>>();
    let bytes = [b"Pf\n64 48\n-1.0\n".to_vec(), row.repeat(48)].concat();
    (0..6).for_each(|view| fs::write(place.path(name).join(format!("{view:03}.pfm")), &bytes).expect("a map"));
    place.text(name)
}

/// What is left out of the loss has no depth either: a point on somebody who walks through is no prior.
#[test]
fn ignored_pixels_have_no_known_depth() {
    let place = Place::new();
    fs::create_dir(place.path("ignore")).expect("a folder");
    let half = image::GrayImage::from_fn(64, 48, |x, _| image::Luma([if x < 32 { 255 } else { 0 }]));
    (0..6).for_each(|view| half.save(place.path("ignore").join(format!("{view:03}.png"))).expect("a picture"));
    let (near, far, ignore) =
        (written(&place, "near", [2.0, 3.0]), written(&place, "far", [9.0, 3.0]), place.text("ignore"));
    let trained = |name: &str, known: &str, more: &[&str]| {
        let whole =
            ["--iterations", "20", "--set", "start_size=1", "--set", "full_size_from=0", "--set", "depth_weight=1"];
        succeeded(&place.trained(name, &[&whole[..], &["--depths", known], more].concat()));
        place.model(name, 20)
    };
    assert!(trained("a", &near, &[]) != trained("b", &far, &[]), "they count elsewhere");
    assert!(trained("c", &near, &["--ignore", &ignore]) == trained("d", &far, &["--ignore", &ignore]), "the same bits");
}

#[test]
fn depths_that_are_not_there_are_an_error() {
    let place = Place::new();
    let (maps, masks) = (place.text("scene/depth"), place.text("scene/masks"));
    let refused = |flags: &[&str], expected: &[&str]| {
        let message = stderr(&place.trained("out", flags));
        expected.iter().for_each(|part| assert!(message.contains(part), "{part:?} in {message}"));
    };
    refused(&["--depths", &maps, "--set", "depth_weight=0"], &["--depths", "--set depth_weight is above 0"]);
    refused(&with(&["--depths", &place.text("nowhere")]), &["nowhere", "there is no such folder"]);
    refused(&with(&["--depths", &masks]), &["masks", "depth needs 16-bit grey"]);
    let holes = written(&place, "holes", [0.0; 2]);
    refused(&["--iterations", "60", "--depths", &holes], &["holes", "maps without any depth"]);
    refused(&with(&["--depths", &holes]), &["holes", "maps without any depth"]);
    fs::remove_file(place.path("scene/depth/001.exr")).expect("a map");
    refused(&with(&["--depths", &maps]), &["depth", "have none", "001"]);
    refused(&["--set", "depth_weight=-1"], &["depth"]);
    // A reconstruction without points.
    fs::write(place.path("scene/sparse/0/points3D.bin"), 0_u64.to_le_bytes()).expect("written");
    refused(&TRAIN_FLAGS, &["no points with known photos", "--depths"]);
}
