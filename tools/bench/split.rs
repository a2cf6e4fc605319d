//! Makes a large model from a trained one: each Gaussian is split into several, as in training. Further training steps
//! then settle them.

use glam::{Quat, Vec3};
use labelgs::formats::{read_model, write_model};
use labelgs::run::model_file;
use labelgs::scene::Gaussians;
use labelgs::verify::selftest::scenes::generator;
use labelgs::{Error, Result, Setting};
use rand::Rng;
use std::path::PathBuf;

/// Options of the split.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    /// Model to split, a PLY or the folder of a run.
    pub model: PathBuf,
    /// PLY to write.
    pub to: PathBuf,
    /// Number of Gaussians in the large model.
    #[arg(long, value_name = "N")]
    pub gaussians: usize,
}

/// Writes the large model.
pub fn run(options: &Options) -> Result<()> {
    let path = model_file(&options.model)?;
    let model = read_model(&path)?.gaussians;
    if model.is_empty() || options.gaussians < model.len() {
        let problem = format!("is {}, and {} has {} to split", options.gaussians, path.display(), model.len());
        return Err(Error::usage(Setting("gaussians"), problem));
    }
    let large = split(&model, options.gaussians);
    write_model(&options.to, &large)?;
    println!("{}: {} Gaussians from {}", options.to.display(), large.len(), model.len());
    Ok(())
}

/// Splits Gaussians evenly into `count`. The parts keep the orientation of their Gaussian and together cover the same
/// area.
fn split(model: &Gaussians, count: usize) -> Gaussians {
    let mut random = generator(5);
    let mut normal = || (0..12).map(|_| random.random::<f32>()).sum::<f32>() - 6.0;
    let higher = model.sh_rest.len() / model.len();
    let mut large = Gaussians {
        origin: model.origin,
        sh_degree: model.sh_degree,
        antialiased: model.antialiased,
        labels: model.labels.as_ref().map(|_| Vec::with_capacity(count)),
        label_confidence: model.label_confidence.as_ref().map(|_| Vec::with_capacity(count)),
        ..Gaussians::default()
    };
    for row in 0..model.len() {
        let parts = count * (row + 1) / model.len() - count * row / model.len();
        let [w, x, y, z] = model.quats[row];
        let turn = Quat::from_xyzw(x, y, z, w).normalize();
        let smaller = 0.5 * (parts.max(1) as f32).ln();
        for _ in 0..parts {
            let away = Vec3::from_array(model.scales[row].map(f32::exp)) * Vec3::new(normal(), normal(), normal());
            let away = if parts > 1 { turn * away } else { Vec3::ZERO };
            large.means.push((Vec3::from_array(model.means[row]) + away).to_array());
            large.quats.push(model.quats[row]);
            large.scales.push(model.scales[row].map(|scale| scale - smaller));
            large.opacities.push(model.opacities[row]);
            large.sh0.push(model.sh0[row]);
            large.sh_rest.extend_from_slice(&model.sh_rest[row * higher..(row + 1) * higher]);
            copy(&mut large.labels, model.labels.as_deref(), row);
            copy(&mut large.label_confidence, model.label_confidence.as_deref(), row);
        }
    }
    large
}

fn copy<T: Copy>(to: &mut Option<Vec<T>>, from: Option<&[T]>, row: usize) {
    if let Some((to, from)) = to.as_mut().zip(from) {
        to.push(from[row]);
    }
}
