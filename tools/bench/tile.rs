//! The blends alone: the chain of a single tile, and an image of equal tiles.

use crate::kernels::{ALL_MODES, Replacements, TestBed};
use crate::measure::{median, table, write_json};
use crate::{Common, device};
use glam::DMat3;
use labelgs::pass::{KernelShape, Stage};
use labelgs::reference::loss::Photo;
use labelgs::reference::step::Target;
use labelgs::scene::{Camera, Gaussians};
use labelgs::verify::selftest::scenes::{Scene, generator, uniform};
use labelgs::{Error, Result};
use serde_json::json;

/// Opacity of the splats: no pixel of the longest list becomes opaque, so the whole list is walked.
const SPLAT_OPACITY: f64 = 0.012;
/// Standard deviation of the splats, px.
const SPLAT_DEVIATION: f64 = 0.3;
/// Distance of the splats from the borders of their tile, px: more than the reach of a splat of this opacity.
const TILE_INSET: f64 = 1.25;

/// Runs the benchmark.
pub fn run(common: &Common) -> Result<()> {
    let gpu = device::open()?;
    // Tiles along the image's sides, and splats per tile.
    let even_tiles = if gpu.is_cpu() { [25, 20] } else { [100, 67] };
    let (cases, rounds) = match common.small {
        true => ([([1, 1], 64), ([1, 1], 256), ([4, 3], 30)], 2),
        false => ([([1, 1], 1_024), ([1, 1], 8_192), (even_tiles, 300)], 20),
    };
    let shape = KernelShape::for_device(gpu.capabilities());
    println!("{}: the blends of synthetic splats, degree 0, without labels", gpu.capabilities().name);
    let head = ["px", "Gaussians", "longest list", "M pairs", "forward ms", "backward ms", "G pairs/s", "backward"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let mut found = Vec::new();
    let mut lone = Vec::new();
    for (tiles, splats) in cases {
        let scene = even(&shape, tiles, splats);
        let (size, gaussians) = ((scene.camera.width, scene.camera.height), scene.gaussians.len());
        let modes = [(ALL_MODES[0], Replacements::default())];
        let mut bed = TestBed::new(&gpu, scene, &modes)?;
        // Let buffers grow and the driver compile.
        bed.run(0)?;
        let samples = (0..=rounds).map(|_| bed.run(0)).collect::<Result<Vec<_>>>()?;
        let counters = &samples[0].counters;
        if counters.longest_list as usize != splats || counters.instance_count as usize != gaussians {
            return Err(Error::Check(format!("{splats} splats were put into each tile, not as found: {counters:?}")));
        }
        let pairs = counters.walked_splats() as f64 * f64::from(bed.tile_pixels());
        let ms = |stage| median(samples.iter().map(|sample| sample.stages[&stage]));
        let [forward, backward] = [Stage::BLEND_FORWARD, Stage::BLEND_BACKWARD].map(ms);
        if tiles == [1, 1] {
            lone.push((splats as f64, [forward, backward]));
        }
        let rates = [forward, backward].map(|ms| pairs / ms / 1e6);
        let numbers = [pairs / 1e6, forward, backward, rates[0], rates[1]].map(|value| format!("{value:.3}"));
        let counts = [format!("{} x {}", size.0, size.1), gaussians.to_string(), splats.to_string()];
        rows.push(counts.into_iter().chain(numbers).collect());
        found.push(json!({
            "size": [size.0, size.1], "sh_degree": 0, "labels": false, "gaussians": gaussians, "longest_list": splats,
            "pairs": pairs, "forward_ms": forward, "backward_ms": backward,
        }));
    }
    println!("{}", table(&rows));
    // The difference of two runs removes the constant cost.
    let [(few, short), (many, long)] = [lone[0], lone[1]];
    let chain = [0, 1].map(|way: usize| (long[way] - short[way]) * 1e6 / (many - few));
    println!("a splat of a lone tile: {:.1} ns forward, {:.1} ns backward\n", chain[0], chain[1]);
    let chain = json!({ "forward": chain[0], "backward": chain[1] });
    let all = json!({ "schema_version": 1, "device": gpu.capabilities().name, "ns_a_splat": chain, "pictures": found });
    write_json(&common.output.join("tile.json"), &all)
}

/// An image whose tiles have the given number of splats each, none of which leaves its tile.
fn even(shape: &KernelShape, [columns, rows]: [u32; 2], splats: usize) -> Scene {
    let (width, height) = (columns * shape.tile_width, rows * shape.tile_height);
    let focal = f64::from(width.max(64));
    let camera = Camera {
        rotation: DMat3::IDENTITY,
        translation: glam::DVec3::ZERO,
        fx: focal,
        fy: focal,
        cx: f64::from(width) * 0.5,
        cy: f64::from(height) * 0.5,
        width,
        height,
    };
    let mut random = generator(2);
    let mut gaussians = Gaussians::default();
    for tile in 0..columns * rows {
        for _ in 0..splats {
            let mut place = |corner: u32, side: u32| {
                f64::from(corner * side) + uniform(&mut random, TILE_INSET, f64::from(side) - TILE_INSET)
            };
            let (x, y) = (place(tile % columns, shape.tile_width), place(tile / columns, shape.tile_height));
            let depth = uniform(&mut random, 2.0, 8.0);
            let at = [(x - camera.cx) * depth / focal, (y - camera.cy) * depth / focal, depth];
            gaussians.means.push(at.map(|value| value as f32));
            gaussians.quats.push([1.0, 0.0, 0.0, 0.0]);
            gaussians.scales.push([(SPLAT_DEVIATION * depth / focal).ln() as f32; 3]);
            gaussians.opacities.push((SPLAT_OPACITY / (1.0 - SPLAT_OPACITY)).ln() as f32);
            gaussians.sh0.push([0.3, 0.0, -0.3]);
        }
    }
    let pixels = (width * height) as usize;
    let size = (width as usize, height as usize);
    let photo = Photo { size, colours: vec![[0.25; 3]; pixels], valid: vec![true; pixels] };
    let target = Target { photo, label_map: vec![0; pixels], slots: Vec::new(), background: [0.0; 3] };
    Scene { camera, gaussians, target, frozen: 0 }
}
