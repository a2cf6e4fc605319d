//! Photos and masks within a budget of memory: the same bits as with all of them in memory.

use crate::support::device;
use crate::support::runs::{Place, files, succeeded};
use labelgs::scene::{Dataset, Pixels};
use labelgs::scenes::{self, LoadOptions};
use labelgs::synth::{self, SynthOptions};
use std::path::Path;
use std::time::Duration;

/// Budgets of a scene of 6 photos of 64 x 48 px: some photos fit, none does.
const MEMORY_BUDGETS: [&str; 2] = ["150K", "1K"];
const STEP_COUNT: u32 = 40;

fn scene(folder: &Path, lens: &str) -> LoadOptions {
    let lens = lens.parse().expect("a lens");
    let options = SynthOptions { views: 5, width: 96, height: 64, points: 60, lens, ..SynthOptions::default() };
    synth::write(&options, folder, &|_| Ok(())).expect("written");
    // A part of each photo is left out.
    let masks = folder.join("masks");
    LoadOptions { masks: Some(masks.clone()), ignore: Some(masks), max_resolution: Some(48), ..LoadOptions::default() }
}

fn open(folder: &Path, options: &LoadOptions) -> Dataset {
    scenes::open(folder, options).expect("a scene")
}

fn equal(a: &Dataset, b: &Dataset) {
    assert_eq!(a.all().len(), b.all().len());
    for (a, b) in a.all().into_iter().zip(b.all()) {
        assert_eq!((&a.name, a.photo().expect("a photo")), (&b.name, b.photo().expect("a photo")));
        assert_eq!(a.mask().expect("a mask"), b.mask().expect("a mask"));
        let objects = |mask: &Option<Pixels<_>>| mask.as_ref().map(Pixels::objects);
        assert_eq!(objects(&a.mask), objects(&b.mask));
    }
}

fn held(dataset: &Dataset) -> usize {
    dataset.all().into_iter().filter(|view| view.photo.as_ref().is_some_and(Pixels::is_held)).count()
}

#[test]
fn pixels_are_the_same_wherever_they_wait() {
    for lens in ["PINHOLE", "OPENCV_FISHEYE", "EQUIRECTANGULAR"] {
        let folder = tempfile::tempdir().expect("a folder");
        let options = scene(folder.path(), lens);
        let whole = open(folder.path(), &options);
        assert_eq!(held(&whole), whole.all().len());
        let some =
            whole.all().iter().map(|view| 14 * u64::from(view.camera.width * view.camera.height)).sum::<u64>() - 1;
        for budget in [some, 1] {
            let cache = folder.path().join("cache");
            let photo_folder = Some(cache.clone());
            let few = open(folder.path(), &LoadOptions { photo_memory: budget, photo_folder, ..options.clone() });
            assert_eq!(held(&few) == 0, budget == 1, "{lens}");
            assert!(held(&few) < few.all().len());
            equal(&whole, &few);
            assert_eq!(files(&cache), [""; 0].map(Path::new), "the file has no name");
        }
    }
}

/// Without space for the temporary file photos are decoded again; one that has changed meanwhile is refused.
#[test]
fn photos_without_a_place_are_decoded_again() {
    for lens in ["PINHOLE", "EQUIRECTANGULAR"] {
        let folder = tempfile::tempdir().expect("a folder");
        let options = scene(folder.path(), lens);
        let whole = open(folder.path(), &options);
        let photo_folder = Some(folder.path().join("masks/000.png/no-folder"));
        let few = open(folder.path(), &LoadOptions { photo_memory: 1, photo_folder, ..options.clone() });
        equal(&whole, &few);
        equal(&whole, &open(folder.path(), &LoadOptions { photo_memory: 1, photo_folder: None, ..options }));
        let image = |name: &str| folder.path().join("images").join(name);
        let [first, second] = ["000.png", "001.png"].map(image);
        std::fs::copy(&second, &first).expect("another photo");
        std::fs::remove_file(&second).expect("removed");
        let view = |name: &str| few.all().into_iter().find(|view| view.name.starts_with(name)).expect("a view").clone();
        let changed = view("000").photo().expect_err("it has changed").to_string();
        assert!(changed.contains("images/000.png: has different pixels than when the scene was opened"), "{changed}");
        let gone = view("001").photo().expect_err("it is gone").to_string();
        assert!(gone.contains("images/001.png") && gone.contains("restore it and resume"), "{gone}");
        assert!(view("001").mask().is_ok());
    }
}

#[test]
fn a_training_has_the_same_bits_for_any_budget() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let train = |out: &str, flags: &[&str]| {
        // Early steps are small, and each view comes at several sizes.
        let config = ["--config", &place.settings(), "--set", "start_size=0.5", "--set", "full_size_from=20"];
        let all = [&config[..], &["--exposure", "on"], flags].concat();
        succeeded(&place.trained(out, &[&all[..], &["--iterations", &STEP_COUNT.to_string()]].concat()))
    };
    let text = train("whole", &[]);
    assert!(!text.contains("temporary file"), "{text}");
    for budget in MEMORY_BUDGETS {
        let text = train(budget, &["--photo-memory", budget]);
        assert!(text.contains("photos stay in memory, the others in a temporary file"), "{text}");
        assert!(place.model(budget, STEP_COUNT) == place.model("whole", STEP_COUNT), "{budget}: the models differ");
        assert_eq!(place.history(budget), place.history("whole"), "{budget}");
        let names = |out: &str| {
            let mut all = files(&place.path(out))
                .into_iter()
                .map(|path| path.strip_prefix(place.path(out)).expect("in").to_owned())
                .collect::<Vec<_>>();
            all.sort();
            all
        };
        assert_eq!(names(budget), names("whole"), "{budget}");
    }
    // A killed run goes on with another budget.
    let settings = place.settings();
    let flags = ["--config", &settings, "--set", "start_size=0.5", "--set", "full_size_from=20", "--exposure", "on"];
    let mut child =
        place.spawned(&place.train("killed", &[&flags[..], &["--photo-memory", MEMORY_BUDGETS[0]]].concat()));
    while place.checkpoints("killed").is_empty() && child.try_wait().expect("a child").is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().expect("killed or done");
    child.wait().expect("a child");
    let args =
        ["train", &place.text("scene"), "-o", &place.text("killed"), "--resume", "--photo-memory", MEMORY_BUDGETS[1]];
    let text = succeeded(&place.labelgs(&args));
    assert!(text.contains("--photo-memory: 150K in the checkpoint, now 1K"), "{text}");
    assert!(place.model("killed", STEP_COUNT) == place.model("whole", STEP_COUNT), "the models differ after a kill");
}

/// A disk that is full, or that returns other bytes, costs time and no bit.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn a_disk_that_fails_costs_no_bit() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    // Without what reads the points again after the scene was opened.
    let flags = ["--iterations", "8", "--checkpoint-every", "0", "--set", "preview_every=0", "--set", "start_size=0.5"];
    let flags = [&flags[..], &["--set", "depth_weight=0", "--exposure", "off"]].concat();
    succeeded(&place.trained("whole", &flags));
    let few = [&flags[..], &["--photo-memory", "1K"]].concat();
    for (fault, is_told) in
        [("write:1:NO_SPACE", true), ("write:2:NO_SPACE", true), ("write:5:IO", true), ("write:3:SHORT", false)]
    {
        let text = succeeded(&place.trained_with(Some(fault), fault, &few));
        assert!(text.contains("injected fault"), "{fault}: {text}");
        assert_eq!(text.contains("no space for data that does not fit into memory"), is_told, "{fault}: {text}");
        assert!(place.model(fault, 8) == place.model("whole", 8), "{fault}: the models differ");
    }
    // Reads after the scene was opened are those of the temporary file and of compiled pipelines.
    let is_told = |nth: u32| {
        let fault = format!("read:{nth}:IO");
        let text = succeeded(&place.trained_with(Some(&fault), &fault, &few));
        assert!(text.contains("injected fault"), "{fault}: {text}");
        assert!(place.model(&fault, 8) == place.model("whole", 8), "{fault}: the models differ");
        text.contains("the temporary file of photos cannot be read")
    };
    assert!([130, 150, 170].into_iter().filter(|&nth| is_told(nth)).count() > 0);
}
