//! A network is found, prompted and understood; its masks become levels.
#![allow(missing_docs, reason = "a test")]

mod tiny;

use labelgs_scene::{LabelMap, Photo};
use labelgs_segment::{FeatureCache, Features, Level, Network, Prompt, Search, masks_of_photo, threads_for};
use std::path::Path;

const SEARCH_OPTIONS: Search = Search { grid: 8, min_score: 0.7, min_stability: 0.5 };

fn network(folder: &Path) -> Network {
    tiny::write(folder);
    Network::open(folder, 2).expect("network")
}

/// Red on the left, green on the right, a blue square in the red half.
fn photo(width: u32, height: u32) -> Photo {
    let at = |at: u32| {
        let (x, y) = (at % width, at / width);
        let is_square = (width / 8..width / 4).contains(&x) && (height / 4..height / 2).contains(&y);
        match (is_square, 2 * x < width) {
            (true, _) => [0, 0, 255, 255],
            (_, true) => [255, 0, 0, 255],
            _ => [0, 255, 0, 255],
        }
    };
    Photo { width, height, rgba: (0..width * height).map(at).collect() }
}

fn message<T>(result: labelgs_scene::Result<T>) -> String {
    result.err().map(|error| error.to_string()).unwrap_or_default()
}

#[test]
fn a_prompt_is_answered_where_it_was_asked() {
    let folder = tempfile::tempdir().expect("folder");
    let network = network(folder.path());
    // Wide and tall photos have different layouts in the network's square.
    for (width, height) in [(320, 240), (120, 360)] {
        let photo = photo(width, height);
        let features = network.encode(&photo).expect("features");
        let prepared = network.prepare(&features).expect("prepared");
        let (columns, rows) = prepared.frame.grid();
        for (x, y) in [(0.75, 0.5), (0.4, 0.8), (0.18, 0.36)] {
            let place = [x * width as f32, y * height as f32];
            let answer = network.ask(&prepared, &Prompt::from_point(place)).expect("answer");
            assert_eq!((answer.masks.len(), answer.scores.as_slice()), (1, [0.95].as_slice()));
            let wanted = photo.rgba[place[1] as usize * width as usize + place[0] as usize];
            let cells = answer.masks[0].iter().enumerate();
            let right = cells.filter(|&(at, logit)| {
                let along = |cell: usize, of: usize, side: u32| ((cell as f32 + 0.5) / of as f32 * side as f32) as u32;
                let (px, py) = (along(at % columns, columns, width), along(at / columns, rows, height));
                let shown = photo.rgba[(py.min(height - 1) * width + px.min(width - 1)) as usize];
                (*logit > 0.0) == (shown == wanted)
            });
            // Where colours meet, a cell of 16 px mixes both: for a tall photo, 341 px wide in the network, 5 % on the
            // long border.
            let share = right.count() as f64 / (columns * rows) as f64;
            assert!(share > 0.9, "{width} x {height}, {place:?}: {share}");
        }
    }
}

#[test]
fn masks_do_not_depend_on_threads_and_levels_show_them() {
    let folder = tempfile::tempdir().expect("folder");
    let first = network(folder.path());
    let photo = photo(160, 120);
    let features = first.encode(&photo).expect("features");
    let levels = [Level::Objects, Level::Parts, Level::Wholes];
    let find =
        |network: &Network| masks_of_photo(network, &features, &SEARCH_OPTIONS, &levels, (160, 120)).expect("masks");
    let found = find(&first);
    assert_eq!(found.masks.len(), 3, "each colour once");
    let one = Network::open(folder.path(), 1).expect("network");
    let again = find(&one);
    assert_eq!(found.levels, again.levels);
    let at = |map: &LabelMap, x: u32, y: u32| map.ids[(y * 160 + x) as usize];
    for map in &found.levels[..2] {
        let (red, blue, green) = (at(map, 60, 100), at(map, 30, 45), at(map, 120, 60));
        assert!(red != blue && blue != green && red != green && red * blue * green != 0, "{red} {blue} {green}");
    }
    // Half a photo counts as surroundings, not as a whole.
    assert_eq!(at(&found.levels[2], 120, 60), 0);
}

#[test]
fn features_on_the_disk_are_those_of_the_network() {
    let folder = tempfile::tempdir().expect("folder");
    let network = network(&folder.path().join("network"));
    let cache = FeatureCache::new(Some(&folder.path().join("cache")), &network);
    let photo = photo(80, 60);
    let fresh = cache.features(&network, &photo).expect("features");
    assert_eq!(cache.features(&network, &photo).expect("features"), fresh);
    let files: Vec<_> = walk(&folder.path().join("cache"));
    assert_eq!(files.len(), 1);
    assert_eq!(Features::read(&files[0], (80, 60)), Some(fresh.clone()));
    // A damaged file is replaced.
    #[expect(clippy::disallowed_methods, reason = "a test damages a file")]
    std::fs::write(&files[0], b"half").expect("written");
    assert_eq!(cache.features(&network, &photo).expect("features"), fresh);
}

#[test]
fn threads_fit_into_the_memory_that_is_left() {
    assert_eq!(threads_for(16, None), 16);
    assert_eq!(threads_for(16, Some(8 << 30)), 16);
    assert_eq!(threads_for(16, Some(900 << 20)), 8);
    assert_eq!(threads_for(16, Some(100 << 20)), 1);
}

#[test]
fn features_that_were_not_used_for_longest_make_room() {
    let folder = tempfile::tempdir().expect("folder");
    let network = network(&folder.path().join("network"));
    let root = folder.path().join("cache");
    let cache = FeatureCache::new(Some(&root), &network);
    let photos: Vec<Photo> = [80, 96, 112].map(|width| photo(width, 60)).into();
    let known = |width: &str| walk(&root).iter().any(|path| path.to_string_lossy().contains(&format!("-{width}x60.")));
    let old = |age: u64| {
        for path in walk(&root) {
            let file = std::fs::File::options().append(true).open(path).expect("a file");
            let time = file.metadata().and_then(|found| found.modified()).expect("a time");
            file.set_modified(time - std::time::Duration::from_secs(age)).expect("older");
        }
    };
    cache.features(&network, &photos[0]).expect("features");
    let bytes = std::fs::metadata(&walk(&root)[0]).expect("a file").len();
    old(10);
    cache.features(&network, &photos[1]).expect("features");
    old(10);
    // The first photo was used again, so the second is the least recently used.
    cache.features(&network, &photos[0]).expect("features");
    // Other files in the folder are not counted.
    #[expect(clippy::disallowed_methods, reason = "a test makes a file")]
    std::fs::write(root.join("pipelines-x.bin"), vec![0; 3 * bytes as usize]).expect("written");
    cache.bounded(2 * bytes).features(&network, &photos[2]).expect("features");
    assert!(known("80") && !known("96") && known("112"), "{:?}", walk(&root));
    assert!(root.join("pipelines-x.bin").is_file());
    let cache = FeatureCache::new(Some(&root), &network).bounded(1);
    cache.features(&network, &photos[1]).expect("features");
    assert!(!known("80") && known("96") && !known("112"), "the newest stays");
}

#[expect(clippy::disallowed_methods, reason = "a test lists what was written")]
fn walk(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).expect("folder").map(|entry| entry.expect("entry").path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}

#[test]
#[expect(clippy::disallowed_methods, reason = "a test makes its input")]
fn what_is_no_network_is_refused_with_what_was_expected() {
    let folder = tempfile::tempdir().expect("folder");
    let open = || message(Network::open(folder.path(), 1));
    assert!(open().contains("has 0 files *encoder.onnx and 0 files *decoder.onnx or sam.onnx"), "{}", open());
    tiny::write(folder.path());
    std::fs::write(folder.path().join("decoder.onnx"), tiny::decoder("points")).expect("written");
    let text = open();
    assert!(text.contains("decoder.onnx: has the inputs image_embeddings, points, point_labels"), "{text}");
    assert!(text.contains("expected point_coords"), "{text}");
    std::fs::write(folder.path().join("decoder.onnx"), tiny::encoder()).expect("written");
    assert!(open().contains("decoder.onnx: has the"), "{}", open());
    let cut = &tiny::encoder()[..100];
    std::fs::write(folder.path().join("encoder.onnx"), cut).expect("written");
    assert!(open().contains("encoder.onnx: is not a usable ONNX network"), "{}", open());
}
