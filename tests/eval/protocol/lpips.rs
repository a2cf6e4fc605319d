//! LPIPS with weights for which the distance is known.

use labelgs::cli::support::exit_status::exit_status;
use labelgs::engine::Engine;
use labelgs::eval::lpips::convolution::{Layer, Planes, convolve, halve};
use labelgs::eval::lpips::{STAGE_CHANNELS, STAGE_CONVOLUTIONS, Weights};
use labelgs::eval::{Distance, Rendering, WholeModel, evaluate};
use labelgs::render::RenderOptions;
use labelgs::scene::Photo;
use labelgs::scenes::init::initial_gaussians;
use labelgs::synth::{Preset, SynthOptions, dataset};
use std::io::Write;
use std::path::Path;
use tempfile::tempdir;

#[test]
fn a_convolution_equals_the_direct_sum() {
    let value = |index: usize| ((index * 37 + 11) % 19) as f32 - 9.0;
    for (width, height) in [(5, 4), (1, 3), (2, 1)] {
        let area = width * height;
        let input = Planes { channels: 2, width, height, values: (0..2 * area).map(value).collect() };
        let layer = Layer { weight: (0..54).map(|i| value(i + 5)).collect(), bias: vec![1.0, -2.0, 0.5] };
        let found = convolve(&input, &layer);
        assert_eq!((found.channels, found.values.len()), (3, 3 * area));
        for (output, (y, x)) in (0..3).flat_map(|o| (0..height).flat_map(move |y| (0..width).map(move |x| (o, (y, x)))))
        {
            let mut sum = layer.bias[output];
            for (from, dy, dx) in (0..18).map(|i| (i / 9, i / 3 % 3, i % 3)) {
                let (row, column) = ((y + dy).wrapping_sub(1), (x + dx).wrapping_sub(1));
                if row < height && column < width {
                    let weight = layer.weight[(output * 2 + from) * 9 + dy * 3 + dx];
                    sum += weight * input.values[from * area + row * width + column];
                }
            }
            // Whole numbers and halves: exact.
            assert_eq!(found.values[output * area + y * width + x], sum.max(0.0), "{width} {height} {output} {x} {y}");
        }
    }
    let input = Planes { channels: 1, width: 3, height: 2, values: vec![1.0, 5.0, 9.0, 4.0, 2.0, 9.0] };
    assert_eq!(halve(&input).values, [5.0]);
}

/// A file in which each convolution passes its inputs on, and every feature weighs 1; `name` is left out.
fn write_weights(path: &Path, left_out: &str) {
    let mut tensors: Vec<(String, Vec<usize>, Vec<f32>)> = Vec::new();
    let mut inputs = 3;
    for (stage, outputs) in STAGE_CONVOLUTIONS.iter().zip(STAGE_CHANNELS) {
        for number in *stage {
            let mut weight = vec![0.0; outputs * inputs * 9];
            (0..inputs.min(outputs)).for_each(|channel| weight[(channel * inputs + channel) * 9 + 4] = 1.0);
            tensors.push((format!("features.{number}.weight"), vec![outputs, inputs, 3, 3], weight));
            tensors.push((format!("features.{number}.bias"), vec![outputs], vec![0.0; outputs]));
            inputs = outputs;
        }
    }
    let linear = STAGE_CHANNELS.iter().enumerate();
    tensors
        .extend(linear.map(|(i, &count)| (format!("lin{i}.model.1.weight"), vec![1, count, 1, 1], vec![1.0; count])));
    tensors.retain(|(name, ..)| name != left_out);
    let (mut header, mut offset) = (serde_json::Map::new(), 0);
    for (name, shape, values) in &tensors {
        let end = offset + 4 * values.len();
        let entry = serde_json::json!({ "dtype": "F32", "shape": shape, "data_offsets": [offset, end] });
        header.insert(name.clone(), entry);
        offset = end;
    }
    let header = serde_json::Value::Object(header).to_string();
    let mut file = std::io::BufWriter::new(std::fs::File::create(path).expect("a file"));
    file.write_all(&(header.len() as u64).to_le_bytes()).expect("written");
    file.write_all(header.as_bytes()).expect("written");
    for (_, _, values) in &tensors {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        file.write_all(&bytes).expect("written");
    }
    file.flush().expect("written");
}

#[test]
fn the_distance_of_plain_pictures_by_hand() {
    let folder = tempdir().expect("folder");
    let file = folder.path().join("weights.safetensors");
    write_weights(&file, "");
    let weights = Weights::read(&file).expect("weights");
    let plain = |colour: [f32; 3]| vec![colour; 16 * 16];
    let (a, b) = ([1.0, 0.9, 0.8], [0.9, 0.9, 1.0]);
    // Every stage sees the scaled colours, all positive; their directions differ by the same in each of the five.
    let direction = |colour: [f32; 3]| {
        let (shift, scale) = ([-0.030, -0.088, -0.188], [0.458, 0.448, 0.450]);
        let scaled: Vec<f64> = (0..3).map(|c| (2.0 * f64::from(colour[c]) - 1.0 - shift[c]) / scale[c]).collect();
        let length = scaled.iter().map(|value| value * value).sum::<f64>().sqrt();
        scaled.into_iter().map(|value| value / length).collect::<Vec<f64>>()
    };
    let square: f64 = direction(a).iter().zip(direction(b)).map(|(a, b)| (a - b).powi(2)).sum();
    let found = weights.distance(&plain(a), &plain(b), 16, 16).expect("large enough");
    assert!((found - 5.0 * square).abs() < 1e-5 && square > 0.01, "{found} {square}");
    assert!(weights.distance(&[a; 60], &[a; 60], 10, 6).is_err_and(|error| exit_status(&error) == 2));
}

#[test]
fn missing_weights_are_named() {
    let folder = tempdir().expect("folder");
    let file = folder.path().join("weights.safetensors");
    write_weights(&file, "features.14.bias");
    let text = super::message(Weights::read(&file));
    assert!(text.contains("features.14.bias") && text.contains("torchvision"), "{text}");
    std::fs::write(&file, "not weights").expect("written");
    assert!(super::message(Weights::read(&file)).contains("not a readable safetensors"));
}

/// The mean difference of the red channel, in place of LPIPS.
#[derive(Debug)]
struct Red;

impl Distance for Red {
    fn distance(&self, a: &[[f32; 3]], b: &[[f32; 3]], width: usize, height: usize) -> labelgs::Result<f64> {
        assert_eq!((a.len(), b.len()), (width * height, width * height));
        Ok(a.iter().zip(b).map(|(a, b)| f64::from((a[0] - b[0]).abs())).sum::<f64>() / a.len() as f64)
    }
}

/// Each view has a distance of its valid pixels, if one is asked for, and the mean is over views.
#[test]
fn held_out_views_have_a_perceptual_distance() {
    let Some(gpu) = crate::support::device() else { return };
    let scene =
        SynthOptions { preset: Preset::Simple, width: 32, height: 24, views: 3, points: 60, ..SynthOptions::default() };
    let data = dataset(&scene, 0);
    let model = initial_gaussians(&data, 0, 60).expect("a model");
    let mut views = data.train.clone();
    let white = |valid| Photo { width: 32, height: 24, rgba: vec![[255, 255, 255, valid]; 32 * 24] };
    (views[0].photo, views[1].photo) = (Some(white(255).into()), Some(white(0).into()));
    views.iter_mut().for_each(|view| view.mask = None);
    let views: Vec<_> = views.iter().take(2).collect();
    let mut engine = Engine::for_model(std::sync::Arc::clone(&gpu), &model, [(32, 24)]).expect("an engine");
    let options = RenderOptions { background: [0.25; 3], ..RenderOptions::default() };
    let mut scores = |lpips: Option<&dyn Distance>| {
        let mut whole = WholeModel { engine: &mut engine, model: &model, min_confidence: 0.0 };
        evaluate(&mut whole, &views, Rendering { lpips, ..Rendering::new(options) }, &(), &mut ()).expect("scores")
    };
    let found = scores(Some(&Red));
    let own: Vec<f64> = views.iter().map(|view| found.views[&view.name].lpips.expect("a distance")).collect();
    assert!(own[0] > 0.1 && own[0] <= 0.75 + 1e-6 && own[1] == 0.0, "{own:?}");
    assert_eq!(found.mean.lpips, Some((own[0] + own[1]) / 2.0));
    let without = scores(None);
    assert!(without.mean.lpips.is_none() && !serde_json::to_string(&without).expect("JSON").contains("lpips"));
}
