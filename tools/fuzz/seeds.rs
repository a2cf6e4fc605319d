//! Small valid files of every kind, made by the program's own writers where they exist.

use labelgs::files::image as pixels;
use labelgs::files::{LabelEntry, LabelTable};
use labelgs::formats::{SpzVersion, WriteOptions, export_model, write_model};
use labelgs::gpu::PipelineStore;
use labelgs::records::PipelineFolder;
use labelgs::run::{Preset, Settings};
use labelgs::scene::Gaussians;
use std::io::{Cursor, Read};
use std::path::Path;

/// Size of all images, px.
const IMAGE_SIZE: (u32, u32) = (12, 8);

/// The bytes that a writer of files writes.
fn written(name: &str, write: impl FnOnce(&Path)) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    write(&path);
    std::fs::read(path).expect("a file")
}

/// `cameras.bin` with a camera of each supported model.
pub fn colmap_cameras_bin() -> Vec<Vec<u8>> {
    let models: [(u32, &[f64]); 13] = [
        (1, &[10.0, 11.0, 5.5, 4.5]),
        (0, &[10.0, 6.0, 4.0]),
        (2, &[10.0, 6.0, 4.0, 0.01]),
        (3, &[10.0, 6.0, 4.0, 0.01, 0.001]),
        (4, &[10.0, 11.0, 6.0, 4.0, 0.01, 0.001, 0.002, 0.003]),
        (6, &[10.0, 11.0, 6.0, 4.0, 0.01, 0.001, 0.002, 0.003, 0.004, 0.01, 0.0, 0.0]),
        (5, &[10.0, 11.0, 6.0, 4.0, 0.01, 0.001, 0.002, 0.003]),
        (7, &[10.0, 11.0, 6.0, 4.0, 0.9]),
        (10, &[4.0, 4.0, 6.0, 4.0, 0.01, 0.001, 0.002, 0.003, 0.004, 0.01, 0.0, 0.0]),
        (11, &[10.0, 11.0, 6.0, 4.0, 0.01, 0.001, 0.0, 0.0, 0.0, 0.0, 0.001, 0.001, 0.001, 0.0, 0.0, 0.0]),
        (13, &[10.0, 11.0, 6.0, 4.0, -0.1]),
        (16, &[10.0, 11.0, 6.0, 4.0, 0.6, 1.1]),
        (17, &[12.0, 8.0]),
    ];
    let file = |(model, parameters): (u32, &[f64])| {
        let mut out = 1u64.to_le_bytes().to_vec();
        out.extend([1, model].map(u32::to_le_bytes).concat());
        out.extend([u64::from(IMAGE_SIZE.0), u64::from(IMAGE_SIZE.1)].map(u64::to_le_bytes).concat());
        parameters.iter().for_each(|value| out.extend(value.to_le_bytes()));
        out
    };
    models.map(file).to_vec()
}

/// (w, x, y, z) and translation of the images.
const IMAGE_POSES: [([f64; 4], [f64; 3]); 2] =
    [([0.9, 0.1, -0.2, 0.3], [1.0, 0.5, 4.0]), ([0.8, -0.1, 0.2, 0.1], [-1.0, 0.25, 5.0])];

/// `images.bin` with two images, one of them in a folder.
pub fn colmap_images_bin() -> Vec<u8> {
    let mut out = 2u64.to_le_bytes().to_vec();
    for (index, (name, (quaternion, translation))) in ["00.png", "sub/b 1.png"].iter().zip(IMAGE_POSES).enumerate() {
        out.extend((index as u32 + 1).to_le_bytes());
        quaternion.iter().chain(&translation).for_each(|value| out.extend(value.to_le_bytes()));
        out.extend(1u32.to_le_bytes());
        out.extend(name.as_bytes());
        out.push(0);
        out.extend((index as u64).to_le_bytes());
        out.extend(vec![0; index * 24]);
    }
    out
}

/// Positions and colours of the points, enough to start from.
fn points() -> impl Iterator<Item = ([f64; 3], [u8; 3])> {
    (0..17u8)
        .map(|i| ([f64::from(i) * 0.1 - 0.8, f64::from(i % 5) * 0.2, f64::from(i % 3) + 1.0], [i * 15, 255 - i, 7]))
}

/// `points3D.bin`, some points with tracks.
pub fn colmap_points_bin() -> Vec<u8> {
    let mut out = 17u64.to_le_bytes().to_vec();
    for (id, (position, colour)) in points().enumerate() {
        out.extend((id as u64).to_le_bytes());
        position.iter().for_each(|value| out.extend(value.to_le_bytes()));
        out.extend(colour);
        out.extend(0.5f64.to_le_bytes());
        let track = id as u64 % 2;
        out.extend(track.to_le_bytes());
        out.extend(vec![1; track as usize * 8]);
    }
    out
}

/// `cameras.txt`, each with one camera.
pub fn colmap_cameras_txt() -> Vec<Vec<u8>> {
    [
        "# Camera list\n1 PINHOLE 12 8 10 11 5.5 4.5\n",
        "1 SIMPLE_RADIAL 12 8 10 6 4 0.01\r\n",
        "1 OPENCV 12 8 10 11 6 4 0.01 0.001 0.002 -3e-3\n",
        "1 FULL_OPENCV 12 8 10 11 6 4 0.01 0.001 0.002 0.003 0.004 0.01 0 0",
    ]
    .map(|text| text.as_bytes().to_vec())
    .to_vec()
}

/// `images.txt`.
pub fn colmap_images_txt() -> Vec<u8> {
    let mut text = String::from("# Image list\n");
    for (index, (name, ([w, x, y, z], [a, b, c]))) in ["00.png", "sub/b 1.png"].iter().zip(IMAGE_POSES).enumerate() {
        let observations = if index == 0 { "" } else { "1.5 2.5 -1 3.0 4.0 7" };
        text += &format!("{} {w} {x} {y} {z} {a} {b} {c} 1 {name}\n{observations}\n", index + 1);
    }
    text.into_bytes()
}

/// `points3D.txt`.
pub fn colmap_points_txt() -> Vec<u8> {
    let line = |(id, ([x, y, z], [r, g, b])): (usize, ([f64; 3], [u8; 3]))| {
        format!("{id} {x} {y} {z} {r} {g} {b} 0.5 1 0 2 1\n")
    };
    points().enumerate().map(line).collect::<String>().into_bytes()
}

/// `transforms.json` of instant-ngp, nerfstudio and Blender.
pub fn transforms_json() -> Vec<Vec<u8>> {
    let pose = "[[1,0,0,0.5],[0,1,0,0.25],[0,0,1,3],[0,0,0,1]]";
    let turned = "[[0,0,1,5],[1,0,0,6],[0,1,0,7],[0,0,0,1]]";
    [
        format!(
            r#"{{"fl_x": 10, "w": 12, "h": 8, "frames": [
{{"file_path": "images/00.png", "transform_matrix": {pose}}},
{{"file_path": "images\\01.png", "transform_matrix": {turned}, "mask_path": "m.png"}}]}}"#
        ),
        format!(
            r#"{{"camera_angle_x": 0.9, "frames": [{{"file_path": "./images/00", "transform_matrix": {pose}}}],
"ply_file_path": "points.ply", "applied_transform": [[1,0,0,0],[0,0,-1,0],[0,1,0,0]]}}"#
        ),
        format!(
            r#"{{"camera_model": "OPENCV", "cx": 6.5, "cy": 4.5, "k1": 0.1, "k2": 0.01, "p1": 1e-3, "p2": 0, "aabb_scale": 4,
"frames": [{{"file_path": "a.png", "fl_x": 20.0, "fl_y": 21.0, "w": 12, "h": 8, "transform_matrix": {turned}}}]}}"#
        ),
    ]
    .map(String::into_bytes)
    .to_vec()
}

pub fn poses_npy() -> Vec<u8> {
    let row = [0.0, 1.0, 0.0, 0.5, 8.0, 1.0, 0.0, 0.0, 0.25, 12.0, 0.0, 0.0, -1.0, 3.0, 10.0, 0.5, 9.0_f64];
    npy(1, "<f8", "(1, 17)", row.map(f64::to_le_bytes).as_flattened())
}

pub fn metashape_xml() -> Vec<Vec<u8>> {
    let of_kind = |kind: &str| {
        format!(
            r#"<?xml version="1.0"?><document><chunk><sensors><sensor id="0" type="{kind}"><resolution width="12" height="8"/>
<calibration class="adjusted"><f>10</f><cx>0.5</cx><k1>0.1</k1><p1>1e-3</p1><b1>0.5</b1><b2>0.1</b2></calibration></sensor></sensors>
<components><component id="0"><transform><rotation>1 0 0 0 1 0 0 0 1</rotation><translation>0 0 1</translation><scale>2</scale>
</transform></component></components><cameras><camera id="0" sensor_id="0" component_id="0" label="00">
<transform>1 0 0 0.5 0 1 0 1 0 0 1 1 0 0 0 1</transform></camera><camera id="1" label="b"/></cameras></chunk></document>"#
        )
    };
    ["frame", "fisheye", "spherical"].map(|kind| of_kind(kind).into_bytes()).to_vec()
}

fn gaussians(count: usize, degree: u32, labelled: bool) -> Gaussians {
    let mut g = Gaussians { sh_degree: degree, ..Gaussians::default() };
    let rest = g.rest_per_gaussian();
    let mut at = 0.0f32;
    let mut value = || {
        at += 0.37;
        at % 4.0 - 2.0
    };
    for _ in 0..count {
        g.means.push([value(), value(), value()]);
        g.quats.push([1.0, value(), value(), value()]);
        g.scales.push([value(), value(), value()]);
        g.opacities.push(value());
        g.sh0.push([value(), value(), value()]);
        g.sh_rest.extend((0..rest).map(|_| [value(), value(), value()]));
    }
    g.labels = labelled.then(|| (0..count as u32).map(|index| index * 300).collect());
    g.label_confidence = labelled.then(|| vec![0.75; count]);
    g
}

/// A model from another program.
pub fn golden(name: &str) -> Vec<u8> {
    golden_file("formats", name)
}

/// A mask file from another program.
pub fn golden_mask(name: &str) -> Vec<u8> {
    golden_file("masks", name)
}

fn golden_file(room: &str, name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    // The fuzzer is a separate crate, in a subfolder of the engine's.
    let root = if folder.ends_with("tools/fuzz") { folder.join("../..") } else { folder.to_owned() };
    std::fs::read(root.join("src").join(room).join("tests/golden").join(name)).expect("a file of the tests")
}

/// A model with labels, names and confidences.
fn exported(name: &str, degree: u32, options: WriteOptions) -> Vec<u8> {
    written(name, |path| {
        let names = LabelTable::new(vec![LabelEntry { name: Some("cup".into()), ..LabelEntry::new(300) }]);
        export_model(path, &gaussians(3, degree, true), Some(&names), options).expect("written");
    })
}

/// Compressed SPZ of version 3.
pub fn spz_gzip() -> Vec<Vec<u8>> {
    vec![exported("a.spz", 1, WriteOptions::default()), golden("splat-transform-v3.spz")]
}

/// SPZ of version 3 before compression.
pub fn spz_stream() -> Vec<u8> {
    let mut bytes = Vec::new();
    let packed = exported("a.spz", 2, WriteOptions::default());
    flate2::read::GzDecoder::new(packed.as_slice()).read_to_end(&mut bytes).expect("unpacked");
    bytes
}

/// SPZ of version 4.
pub fn spz_framed() -> Vec<Vec<u8>> {
    let options = WriteOptions { spz_version: SpzVersion::V4, ..WriteOptions::default() };
    vec![exported("a.spz", 1, options), golden("splat-transform-v4.spz")]
}

/// USD with labels and names, and a file of another program: every kind of value, groups and transforms.
pub fn usd_text() -> Vec<Vec<u8>> {
    vec![exported("a.usda", 1, WriteOptions::default()), golden("foreign.usda")]
}

/// A package of USD.
pub fn usd_package() -> Vec<Vec<u8>> {
    vec![exported("a.usdz", 0, WriteOptions::default())]
}

/// SOG with labels and names.
pub fn sog() -> Vec<Vec<u8>> {
    vec![exported("a.sog", 1, WriteOptions::default())]
}

/// `meta.json` of a SOG.
pub fn sog_meta() -> Vec<u8> {
    let own = golden("splat-transform.sog");
    let mut archive = zip::ZipArchive::new(Cursor::new(own)).expect("an archive");
    let mut text = Vec::new();
    archive.by_name("meta.json").expect("an entry").read_to_end(&mut text).expect("unpacked");
    text
}

/// GLB with labels and names.
pub fn glb() -> Vec<Vec<u8>> {
    vec![exported("a.glb", 0, WriteOptions::default()), exported("a.glb", 1, WriteOptions::default())]
}

/// Models of all degrees, with and without labels, and one in ascii.
pub fn ply_model() -> Vec<Vec<u8>> {
    let model = |degree, labelled| {
        written("a.ply", |path| {
            write_model(path, &gaussians(3, degree, labelled)).expect("written");
        })
    };
    let mut all: Vec<Vec<u8>> = (0..=3).map(|degree| model(degree, degree % 2 == 1)).collect();
    let names = "x y z opacity scale_0 scale_1 scale_2 f_dc_0 f_dc_1 f_dc_2 rot_0 rot_1 rot_2 rot_3";
    let properties: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
    let text = format!(
        "ply\nformat ascii 1.0\ncomment a\nelement camera 1\nproperty list uchar int v\nelement vertex 1\n{properties}\
         property ushort label\nend_header\n2 7 9\n0 1 2 0.5 -1 -2 -3 0.1 0.2 0.3 1 0 0 0 5\n"
    );
    all.push(text.into_bytes());
    all
}

/// Points with integer, float and no colours, in ascii and binary.
pub fn ply_cloud() -> Vec<Vec<u8>> {
    let head = |format: &str, kind: &str| {
        let xyz = "property float x\nproperty float y\nproperty double z\n";
        let rgb = format!("property {kind} red\nproperty {kind} green\nproperty {kind} blue\n");
        format!("ply\nformat {format} 1.0\nelement vertex 2\n{xyz}{rgb}element face 0\nend_header\n").into_bytes()
    };
    let rows: [(f32, f32, f64, [u8; 3]); 2] = [(1.0, 2.0, 3.0, [4, 5, 6]), (-1.0, 0.5, 0.0, [255, 0, 1])];
    let mut little = head("binary_little_endian", "uchar");
    let mut big = head("binary_big_endian", "uchar");
    for (x, y, z, rgb) in rows {
        little.extend([x.to_le_bytes(), y.to_le_bytes()].concat());
        little.extend([&z.to_le_bytes()[..], &rgb].concat());
        big.extend([x.to_be_bytes(), y.to_be_bytes()].concat());
        big.extend([&z.to_be_bytes()[..], &rgb].concat());
    }
    let text = [head("ascii", "float"), b"1 2 3 0.5 0 1\r\n-1 0.5 0 1 0 0.25\n".to_vec()].concat();
    vec![little, big, text]
}

/// A PNG of this kind with samples that differ.
fn png(colour: png::ColorType, depth: png::BitDepth, samples: impl Fn(usize) -> u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, IMAGE_SIZE.0, IMAGE_SIZE.1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if colour == png::ColorType::Indexed {
        encoder.set_palette((0..3 << (depth as u8)).map(|i| i as u8).collect::<Vec<u8>>());
    }
    let line = (IMAGE_SIZE.0 as usize * colour.samples() * depth as usize).div_ceil(8);
    let data: Vec<u8> = (0..line * IMAGE_SIZE.1 as usize).map(samples).collect();
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&data).expect("pixels");
    writer.finish().expect("an end");
    bytes
}

use png::BitDepth::{Eight, Four, One, Sixteen, Two};
use png::ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};

/// Grey and palette images of every depth.
pub fn mask() -> Vec<Vec<u8>> {
    let kinds = [
        (Grayscale, Eight),
        (Grayscale, Sixteen),
        (Grayscale, Four),
        (Grayscale, Two),
        (Grayscale, One),
        (Indexed, Eight),
        (Indexed, Four),
        (Indexed, Two),
        (Indexed, One),
    ];
    kinds.map(|(colour, depth)| png(colour, depth, |i| (i / 5 % 3) as u8)).to_vec()
}

/// Ids in three bytes, those of [`pred_json`].
pub fn mask_rgb() -> Vec<Vec<u8>> {
    vec![png(Rgb, Eight, |i| if i / 36 % 2 == 0 { 1 } else { 0 })]
}

/// Black and white images of every kind without transparency.
pub fn mask_binary() -> Vec<Vec<u8>> {
    let kinds = [(Grayscale, Eight), (Grayscale, Sixteen), (Indexed, One), (Rgb, Eight)];
    kinds.map(|(colour, depth)| png(colour, depth, |i| if i / 24 % 2 == 0 { 255 } else { 0 })).to_vec()
}

/// COCO instances, from CVAT with tracks, and from Label Studio.
pub fn coco() -> Vec<Vec<u8>> {
    ["coco.json", "cvat-tracks.json", "label-studio-coco.json"].map(golden_mask).to_vec()
}

/// A DEVA run.
pub fn pred_json() -> Vec<u8> {
    let text = r#"{"annotations": [{"file_name": "00.jpg", "segments_info": [{"id": 65793, "category_id": 0, "score": 0.9},
{"id": 7, "category_id": null}]}], "categories": [{"id": 0, "name": "cup"}]}"#;
    text.as_bytes().to_vec()
}

/// Depths from 1 on.
fn depths() -> Vec<f32> {
    (0..IMAGE_SIZE.0 * IMAGE_SIZE.1).map(|i| 1.0 + i as f32 * 0.25).collect()
}

/// 16-bit grey.
pub fn depth_png() -> Vec<Vec<u8>> {
    vec![png(Grayscale, Sixteen, |i| i as u8)]
}

/// One channel and three.
pub fn depth_exr() -> Vec<Vec<u8>> {
    let (width, height) = IMAGE_SIZE;
    let one = written("a.exr", |path| pixels::write_exr_y(path, width, height, &depths()).expect("written"));
    let three: Vec<[f32; 3]> = depths().into_iter().map(|value| [value, 0.0, -value]).collect();
    vec![one, written("a.exr", |path| pixels::write_exr_rgb(path, width, height, &three).expect("written"))]
}

/// Floats of every width, of both byte orders and both versions of the header.
pub fn depth_npy() -> Vec<Vec<u8>> {
    let file = |version: u8, descr: &str, number: fn(f32) -> Vec<u8>| {
        npy(version, descr, "(8, 12)", &depths().into_iter().flat_map(number).collect::<Vec<u8>>())
    };
    vec![
        file(1, "<f4", |value| value.to_le_bytes().to_vec()),
        file(2, ">f8", |value| f64::from(value).to_be_bytes().to_vec()),
        file(1, "<f2", |value| half::f16::from_f32(value).to_le_bytes().to_vec()),
    ]
}

fn npy(version: u8, descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = [b"\x93NUMPY".as_slice(), &[version, 0]].concat();
    match version {
        1 => bytes.extend((header.len() as u16).to_le_bytes()),
        _ => bytes.extend((header.len() as u32).to_le_bytes()),
    }
    [&bytes, header.as_bytes(), data].concat()
}

/// Both byte orders.
pub fn depth_pfm() -> Vec<Vec<u8>> {
    let file = |scale: &str, number: fn(f32) -> [u8; 4]| {
        [format!("Pf\n12 8\n{scale}\n").into_bytes(), depths().into_iter().flat_map(number).collect()].concat()
    };
    vec![file("-1.0", f32::to_le_bytes), file("1", f32::to_be_bytes)]
}

/// Every kind of PNG.
pub fn photo_png() -> Vec<Vec<u8>> {
    let kinds = [
        (Rgb, Eight),
        (Rgba, Eight),
        (Rgb, Sixteen),
        (Rgba, Sixteen),
        (Grayscale, Eight),
        (Grayscale, One),
        (GrayscaleAlpha, Sixteen),
        (Indexed, Four),
    ];
    kinds.map(|(colour, depth)| png(colour, depth, |i| (i * 7) as u8)).to_vec()
}

/// Colour and grey JPEG, and JPEG of other programs: progressive, CMYK, with restarts and an orientation.
pub fn photo_jpeg() -> Vec<Vec<u8>> {
    let colour =
        image::RgbImage::from_fn(IMAGE_SIZE.0, IMAGE_SIZE.1, |x, y| image::Rgb([x as u8 * 20, y as u8 * 30, 90]));
    let jpeg = |picture: image::DynamicImage| {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, image::ImageFormat::Jpeg).expect("a JPEG");
        bytes.into_inner()
    };
    let mut all = vec![jpeg(colour.clone().into()), jpeg(image::DynamicImage::from(colour).to_luma8().into())];
    all.extend([
        include_bytes!("seeds/progressive.jpg").to_vec(),
        include_bytes!("seeds/cmyk.jpg").to_vec(),
        include_bytes!("seeds/turned.jpg").to_vec(),
    ]);
    all
}

/// The part of a checkpoint that its checksum covers.
pub fn checkpoint() -> Vec<u8> {
    let json = r#"{"meta": {"step": 7, "views": ["a.png"]}, "planes": [{"name": "means", "rows": 2, "words": 4},
{"name": "none", "rows": 0, "words": 3}, {"name": "bits", "rows": 1, "words": 1}]}"#;
    let mut body = (json.len() as u64).to_le_bytes().to_vec();
    body.extend(json.as_bytes());
    body.extend([9; 36]);
    body
}

/// The defaults, the paper's settings, and a few hand-written lines.
pub fn config_toml() -> Vec<Vec<u8>> {
    let dump = |settings: &Settings| settings.dump(&[("device", "x".into())]).expect("text").into_bytes();
    let own = b"iterations = 500\nbackground = [0.0, 0.5, 1.0]\nsave_at = [10, 20]\nnear = 0.1\n".to_vec();
    vec![dump(&Settings::default()), dump(&Settings::preset(Preset::Paper)), own]
}

/// A camera of `render --camera`.
pub fn camera_json() -> Vec<u8> {
    let text = r#"{"w2c": [[1,0,0,0.5],[0,0,-1,2],[0,1,0,3],[0,0,0,1]], "fx": 10.5, "fy": 11, "cx": 6, "cy": 4, "W": 12, "H": 8}"#;
    text.as_bytes().to_vec()
}

/// Two labels.
pub fn labels_json() -> Vec<u8> {
    let mut cup = LabelEntry::new(3);
    (cup.name, cup.source, cup.pixels) = (Some("cup".into()), Some("cups/1".into()), 12);
    written("labels.json", |path| LabelTable::new(vec![LabelEntry::new(1), cup]).write(path).expect("written"))
}

/// Two objects in one view.
pub fn occlusion_json() -> Vec<u8> {
    br#"{"schema_version": 1, "kind": "depth", "views": {"00.png": {"1": [], "2": [1, 7]}}}"#.to_vec()
}

/// A photo and a following frame.
pub fn frames_json() -> Vec<u8> {
    let camera = String::from_utf8(camera_json()).expect("text");
    format!(
        r#"{{"schema_version": 1, "frames": [{{"file": "frames/00000.png", "photo": "a.png", "camera": {camera}}},
{{"file": "frames/00001.png", "photo": null, "camera": {camera}}}]}}"#
    )
    .into_bytes()
}

/// Two steps of a profile; the first is not counted.
pub fn profile_json() -> Vec<u8> {
    br#"{"schema_version": 1, "device": "x", "size": [12, 8], "counters": {"visible": {"median": 7, "p90": 8}},
"steps": [{"step": 1, "first_run": true, "stages_ms": {"sort": 1.5}},
{"step": 2, "first_run": false, "stages_ms": {"sort": 0.5, "blend forward": 2}}]}"#
        .to_vec()
}

/// Two tensors with the names of weights of LPIPS.
pub fn lpips_weights() -> Vec<u8> {
    let header = r#"{"__metadata__":{"format":"pt"},"features.0.bias":{"dtype":"F32","shape":[4],"data_offsets":[0,16]},
"lin0.model.1.weight":{"dtype":"F32","shape":[1,2,1,1],"data_offsets":[16,24]}}"#;
    let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
    bytes.extend(header.as_bytes());
    bytes.extend([0.5f32, 1.0, -2.0, 3.5, 0.25, 8.0].iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// Compiled pipelines.
pub fn pipelines() -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    PipelineFolder::new(folder.path()).save("x", b"what a driver gave");
    std::fs::read(folder.path().join("pipelines-x.bin")).expect("a file")
}
