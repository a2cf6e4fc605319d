//! Files whose header claims more data than the file has, or more than memory holds.

use crate::scenes::fixtures::{Scene, refusal, simple};
use crate::support::memory::peak_of;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder,
    Vec2, WritableImage,
};
use labelgs::Result;
use labelgs::files::image::photo_size;
use labelgs::files::read_photo;
use labelgs::formats::read_model;
use labelgs::masks::read_mask;
use labelgs::scene::DepthMap;
use labelgs::scenes::points::read_points;
use labelgs::scenes::{self, DepthFolder, LoadOptions};
use std::path::Path;

/// Returns the message of a reader, and checks that it did not allocate the size in the header.
#[track_caller]
fn refused<T>(read: impl FnOnce() -> Result<T>) -> String {
    let (answer, peak) = peak_of(read);
    assert!(peak < 100 << 20, "{} MiB for a file of nothing", peak >> 20);
    refusal(answer)
}

/// The bytes of a PNG of zeros, packed as well as can be.
fn zeros(path: &Path, size: (u32, u32), colour: png::ColorType, depth: png::BitDepth) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).expect("a file"));
    let mut encoder = png::Encoder::new(file, size.0, size.1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header().expect("a header");
    let line = (size.0 as usize * colour.samples() * depth as usize).div_ceil(8);
    let mut stream = writer.stream_writer().expect("a stream");
    (0..size.1).for_each(|_| std::io::Write::write_all(&mut stream, &vec![0; line]).expect("a line"));
    stream.finish().expect("an end");
}

#[test]
fn a_png_of_40000_by_40000_zeros_is_refused_everywhere() {
    let scene = Scene::new();
    let path = scene.at("bomb.png");
    zeros(&path, (40_000, 40_000), png::ColorType::Grayscale, png::BitDepth::One);
    assert!(std::fs::metadata(&path).expect("a file").len() < 2 << 20, "the file is small");
    assert!(refused(|| read_mask(&path)).contains("40000 x 40000"));
    assert!(refused(|| read_photo(&path, [0.0; 3])).contains("40000 x 40000"));
}

#[test]
fn a_png_that_is_shorter_than_its_header_says_takes_no_memory() {
    let scene = Scene::new();
    for (colour, depth) in
        [(png::ColorType::Rgba, png::BitDepth::Sixteen), (png::ColorType::Grayscale, png::BitDepth::Eight)]
    {
        let path = scene.at("short.png");
        zeros(&path, (16_000, 16), colour, depth);
        let mut bytes = std::fs::read(&path).expect("bytes");
        bytes[20..24].copy_from_slice(&16_000_u32.to_be_bytes());
        let sum = crc32fast::hash(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&sum.to_be_bytes());
        std::fs::write(&path, bytes).expect("written");
        assert!(refused(|| read_photo(&path, [0.0; 3])).contains("so few bytes"));
        if colour == png::ColorType::Grayscale {
            assert!(refused(|| read_mask(&path)).contains("so few bytes"));
        }
    }
}

/// A JPEG of 12 x 8 px with another size in its header.
fn jpeg_of(width: u16, height: u16) -> Vec<u8> {
    let mut bytes = super::seeds::photo_jpeg()[0].clone();
    let frame = bytes.windows(2).position(|pair| pair == [0xff, 0xc0]).expect("a frame");
    bytes[frame + 5..frame + 7].copy_from_slice(&height.to_be_bytes());
    bytes[frame + 7..frame + 9].copy_from_slice(&width.to_be_bytes());
    bytes
}

#[test]
fn a_jpeg_header_of_65535_by_65535_is_refused() {
    let scene = Scene::new();
    let large = scene.write("large.jpg", jpeg_of(65_535, 65_535));
    assert_eq!(photo_size(&large).expect("a size"), (65_535, 65_535));
    assert!(refused(|| read_photo(&large, [0.0; 3])).contains("65535 x 65535"));
    // An allowed number of pixels, but far too many for the size of the file.
    let short = scene.write("short.jpg", jpeg_of(16_000, 16_000));
    assert!(refused(|| read_photo(&short, [0.0; 3])).contains("so few bytes"));
    let none = scene.write("none.jpg", jpeg_of(0, 8));
    refused(|| read_photo(&none, [0.0; 3]));
}

fn depth(bytes: &[u8]) -> Result<DepthMap> {
    let scene = simple(1);
    scene.write("depths/00.exr", bytes);
    let options = LoadOptions { test_every: None, photos: false, ..LoadOptions::default() };
    let dataset = scenes::open(scene.path(), &options).expect("a scene");
    DepthFolder::open(&scene.path().join("depths"), scene.path(), &labelgs::scenes::Lookup::default())?
        .read(&dataset.train[0])
}

#[test]
fn an_exr_with_a_huge_window_is_refused() {
    let whole = &super::seeds::depth_exr()[0];
    let name = b"dataWindow\0box2i\0";
    let at = whole.windows(name.len()).position(|part| part == name).expect("the window") + name.len() + 4;
    for (x, y) in [(i32::MAX, i32::MAX), (i32::MAX - 1, 7), (39_999, 39_999), (16_383, 16_383), (11, 1 << 20)] {
        let mut bytes = whole.clone();
        bytes[at + 8..at + 12].copy_from_slice(&x.to_le_bytes());
        bytes[at + 12..at + 16].copy_from_slice(&y.to_le_bytes());
        let text = refused(|| depth(&bytes));
        assert!(text.contains("00.exr"), "{text}");
    }
    let mut turned = whole.clone();
    turned[at..at + 4].copy_from_slice(&100_i32.to_le_bytes());
    refused(|| depth(&turned));
}

fn exr(names: &[&'static str], blocks: Blocks, compression: Compression) -> Vec<u8> {
    let samples = |index: usize| (0..96).map(|pixel| (pixel + 100 * index) as f32).collect::<Vec<f32>>();
    let channels =
        names.iter().enumerate().map(|(index, &name)| AnyChannel::new(name, FlatSamples::F32(samples(index))));
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let channels = AnyChannels::sort(channels.collect());
    let layer = Layer::new((12, 8), LayerAttributes::default(), encoding, channels);
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).expect("an EXR");
    bytes.into_inner()
}

#[test]
fn exrs_with_tiles_and_any_channel_name_are_read() {
    let tiles = Blocks::Tiles(Vec2(5, 3));
    for (blocks, compression) in [
        (tiles, Compression::ZIP1),
        (tiles, Compression::PIZ),
        (tiles, Compression::Uncompressed),
        (Blocks::ScanLines, Compression::RLE),
        (Blocks::ScanLines, Compression::ZIP16),
    ] {
        // A single channel of any name is the depth; of several channels, Y, Z or R.
        for (names, from) in [(&["depth"][..], 0), (&["A", "Z"], 1), (&["B", "G", "R"], 2), (&["R", "Y"], 1)] {
            let map = depth(&exr(names, blocks, compression)).expect("a map");
            assert_eq!(map.values[7], (7 + 100 * from) as f32, "{names:?}");
        }
        assert!(refused(|| depth(&exr(&["A", "B"], blocks, compression))).contains("Y, Z or R"));
    }
}

#[test]
fn a_ply_header_ends_within_64_kib() {
    let scene = Scene::new();
    let endless = format!("ply\nformat ascii 1.0\n{}", "comment x\n".repeat(1 << 20));
    let path = scene.write("endless.ply", &endless);
    for text in [refused(|| read_model(&path)), refused(|| read_points(&path).map(|_| ()))] {
        assert!(text.contains("no `end_header` line within the first 65536 bytes"), "{text}");
    }
    let one_line = scene.write("line.ply", format!("ply\ncomment {}", "x".repeat(100 << 20)));
    refused(|| read_model(&one_line));
}

#[test]
fn a_ply_promises_more_than_there_is() {
    let scene = Scene::new();
    let whole = super::seeds::ply_model()[0].clone();
    let at = whole.windows(8).position(|part| part == b"vertex 3").expect("the element");
    for count in ["1152921504606846976", "18446744073709551615", "4294967295", "-1", "3.5", "NaN", "1e9", "4"] {
        let bytes = [&whole[..at + 7], count.as_bytes(), &whole[at + 8..]].concat();
        let text = refused(|| read_model(scene.write("a.ply", &bytes)));
        assert!(text.contains("a.ply: header"), "{text}");
    }
    let none = [&whole[..at + 7], b"0", &whole[at + 8..]].concat();
    let read = read_model(scene.write("none.ply", none)).expect("no Gaussians and bytes behind them");
    assert!(read.gaussians.is_empty() && read.notes[0].contains("bytes after the last"), "{:?}", read.notes);
}

#[test]
fn json_nested_deeply_is_refused() {
    let scene = Scene::new();
    for text in [
        "[".repeat(100_000),
        r#"{"frames":"#.repeat(100_000),
        format!(r#"{{"frames": {}{}}}"#, "[".repeat(100_000), "]".repeat(100_000)),
        format!(r#"{{"frames": [], "aabb": {}1{}}}"#, "[".repeat(100_000), "]".repeat(100_000)),
    ] {
        scene.write("transforms.json", text);
        let text = refused(|| scenes::open(scene.path(), &LoadOptions::default()));
        assert!(text.contains("transforms.json") && text.contains("line 1"), "{text}");
    }
    let toml = scene.write("config.toml", format!("near = {}", "[".repeat(100_000)));
    refused(|| labelgs::run::Settings::read(&toml));
    let keys = scene.write("keys.toml", format!("{}near = 1", "a.".repeat(50_000)));
    refused(|| labelgs::run::Settings::read(&keys));
}
