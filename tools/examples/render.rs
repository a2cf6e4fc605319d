//! Renders a view of a scene from a model: its colours, and the label of each pixel as a colour.
//!
//! ```sh
//! cargo run --release --example render -- MODEL SCENE VIEW OUT.png LABELS.png
//! ```

use labelgs::engine::Engine;
use labelgs::formats;
use labelgs::gpu::{Gpu, GpuOptions};
use labelgs::render::{Format, Parts, RenderOptions, render, write_rgb};
use labelgs::scene::label_colour;
use labelgs::scenes::{self, LoadOptions};
use std::path::Path;

fn main() -> labelgs::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, scene, view, out, labels_out] = &arguments[..] else {
        return Err(labelgs::Error::usage("arguments", "expected: MODEL SCENE VIEW OUT.png LABELS.png"));
    };
    let model = formats::read_model(model)?.gaussians;
    // Poses only: photos are not decoded.
    let scene = scenes::open(Path::new(scene), &LoadOptions { photos: false, ..LoadOptions::default() })?;
    let missing = || labelgs::Error::usage("VIEW", format!("the scene has no view {view}"));
    let camera = &scene.all().into_iter().find(|found| found.stem() == *view).ok_or_else(missing)?.camera;

    let size = (camera.width, camera.height);
    let mut engine = Engine::for_model(Gpu::new(&GpuOptions::default())?, &model, [size])?;
    let rendered = render(&mut engine, camera, &RenderOptions { parts: Parts::LABELS, ..RenderOptions::default() })?;
    write_rgb(Path::new(out), size, &rendered.rgb, Format::Png)?;

    let colours = rendered.labels.iter().map(|&id| label_colour(id).map(|byte| f32::from(byte) / 255.0));
    write_rgb(Path::new(labels_out), size, &colours.collect::<Vec<_>>(), Format::Png)
}
