//! The cost of the Gaussians' order on a GPU: bytes of a step in model order, along a space-filling curve (Morton), and
//! in random order. Bytes are counted from what passes read and write, not timed, so any device will do.

use crate::{device, measure::table};
use labelgs::formats::read_model;
use labelgs::pass::KernelShape;
use labelgs::reference::{loss::Photo, step::Target};
use labelgs::run::model_file;
use labelgs::scene::{Camera, Gaussians};
use labelgs::scenes::{LoadOptions, open};
use labelgs::scheduler::plan::Buf;
use labelgs::verify::selftest::fixture::{Fixture, readable};
use labelgs::verify::selftest::scenes::{Scene, generator};
use labelgs::{Result, gpu::Gpu};
use rand::Rng;
use std::{array, path::PathBuf, sync::Arc};

/// Bytes of a Gaussian in each plane: position, size, rotation, colour bands. Culling reads the first two for all
/// Gaussians.
const PLANE_BYTES: [u64; 7] = [16, 16, 16, 16, 48, 64, 96];
/// Bytes of a splat.
const SPLAT_BYTES: u64 = 48;
/// Smallest memory transaction, bytes.
const SECTOR_BYTES: u64 = 32;
/// Bytes of a cache line.
const CACHE_LINE_BYTES: u64 = 128;

/// Options of the counts.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    /// Model, a PLY or the folder of a run.
    model: PathBuf,
    /// Its scene.
    #[arg(long)]
    scene: PathBuf,
    /// Longest side of the views, px.
    #[arg(long)]
    max_resolution: Option<u32>,
    /// Number of views, evenly chosen.
    #[arg(long, default_value_t = 4)]
    views: usize,
}

/// Gaussians of a view by depth, whether each has a gradient, and indices in that order of each tile's splats.
type ViewOrder = (Vec<usize>, Vec<bool>, Vec<Vec<u32>>);

/// Prints the counts.
pub fn run(options: &Options) -> Result<()> {
    let model =
        Gaussians { labels: None, label_confidence: None, ..read_model(&model_file(&options.model)?)?.gaussians };
    let load = LoadOptions { photos: false, max_resolution: options.max_resolution, ..LoadOptions::default() };
    let views = open(&options.scene, &load)?.train;
    let (gpu, every) = (device::open()?, (views.len() / options.views.max(1)).max(1));
    let seen = views.iter().step_by(every).map(|view| look(&gpu, &model, &view.camera)).collect::<Result<Vec<_>>>()?;
    let mean = |of: fn(&ViewOrder) -> usize| seen.iter().map(of).sum::<usize>() / seen.len().max(1);
    let (visible, touched) = (mean(|of| of.0.len()), mean(|of| of.1.iter().filter(|&&touched| touched).count()));
    let pairs = mean(|of| of.2.iter().map(Vec::len).sum());
    println!("{} Gaussians; {visible} visible, {touched} with a gradient, {pairs} pairs; MB of a view", model.len());
    let mut random = generator(3);
    let orders = [("model", vec![0; model.len()]), ("Morton", codes(&model.means))];
    let orders = orders.into_iter().chain([("random", (0..model.len()).map(|_| random.random()).collect())]);
    let head = ["order", "warps without any", "project", "update", "tiles: splats", "their lines"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for (name, keys) in orders {
        let mut order: Vec<usize> = (0..model.len()).collect();
        order.sort_by_key(|&index| keys[index]);
        let mut places = vec![0; model.len()];
        (0..).zip(order).for_each(|(place, index)| places[index] = place);
        let all: Vec<_> = seen.iter().map(|seen| count(seen, &places)).collect();
        let mean = |at: usize| all.iter().map(|counts| counts[at]).sum::<f64>() / all.len() as f64;
        rows.push([name.to_owned()].into_iter().chain((0..5).map(|at| format!("{:.3}", mean(at)))).collect());
    }
    println!("{}", table(&rows));
    Ok(())
}

/// Runs a step on a view.
fn look(gpu: &Arc<Gpu>, model: &Gaussians, camera: &Camera) -> Result<ViewOrder> {
    let shape = KernelShape { antialiased: model.antialiased, ..KernelShape::for_device(gpu.capabilities()) };
    let camera = Camera { translation: camera.translation + camera.rotation * model.origin, ..camera.clone() };
    let (size, pixels) = ((camera.width as usize, camera.height as usize), (camera.width * camera.height) as usize);
    let tiles = shape.tiles(camera.width, camera.height);
    let photo = Photo { size, colours: vec![[0.5; 3]; pixels], valid: vec![true; pixels] };
    let target = Target { photo, label_map: vec![0; pixels], slots: Vec::new(), background: [0.0; 3] };
    let scene = Scene { camera, gaussians: model.clone(), target, frozen: 0 };
    let mut fixture = Fixture::new(Arc::clone(gpu), scene, false, shape, readable())?;
    let mut report = fixture.train()?;
    while fixture.engine.recover(&report)? {
        report = fixture.train()?;
    }
    let splats = fixture.splats()?;
    let touched = fixture.splat_gradients(&splats)?.iter().map(|gradient| gradient.colour != [0.0; 3]).collect();
    let sorted = fixture.sorted_splats(report.counters.instance_count as usize)?;
    let [starts, ends] =
        [Buf::TILE_STARTS, Buf::TILE_ENDS].map(|of| fixture.get::<u32>(of, (tiles.0 * tiles.1) as usize));
    let lists =
        starts?.into_iter().zip(ends?).map(|(start, end)| sorted[start as usize..end.max(start) as usize].to_vec());
    Ok((splats.iter().map(|splat| splat.gaussian).collect(), touched, lists.collect()))
}

/// Returns Morton codes of 10 bits per axis in the bounding box of all means.
fn codes(means: &[[f32; 3]]) -> Vec<u32> {
    let side = |axis: usize, pick: fn(f32, f32) -> f32| means.iter().map(|mean| mean[axis]).reduce(pick).unwrap_or(0.0);
    let sides: [_; 3] = array::from_fn(|axis| (side(axis, f32::min), side(axis, f32::max)));
    let cell =
        |value: f32, (low, high): (f32, f32)| ((value - low) / (high - low).max(f32::MIN_POSITIVE) * 1023.0) as u32;
    let bit = |mean: &[f32; 3], bit: usize| (cell(mean[bit % 3], sides[bit % 3]) >> (bit / 3) & 1) << bit;
    means.iter().map(|mean| (0..30).map(|at| bit(mean, at)).sum()).collect()
}

/// Returns the MB moved in units that contain elements of `bytes` bytes at ascending positions.
fn moved(places: impl IntoIterator<Item = u64>, bytes: u64, unit: u64) -> f64 {
    let (mut next, mut units) = (0, 0);
    for place in places {
        let end = ((place + 1) * bytes).div_ceil(unit);
        (units, next) = (units + end - next.max(place * bytes / unit).min(end), end);
    }
    (units * unit) as f64 / 1e6
}

/// Returns the share of the subgroups of 32 without a visible Gaussian, and MB: of the visible Gaussians with both
/// moments; of everything that an update reads and writes; of each tile's splats; and of the cache lines that contain
/// these.
fn count((gaussians, touched, tiles): &ViewOrder, places: &[u64]) -> [f64; 5] {
    let mut order: Vec<(u64, usize)> =
        gaussians.iter().zip(0..).map(|(&gaussian, rank)| (places[gaussian], rank)).collect();
    order.sort_unstable();
    let idle = 1.0 - moved(order.iter().map(|of| of.0), 1, 32) * 1e6 / places.len().next_multiple_of(32) as f64;
    let planes = |from: usize, all: bool| -> f64 {
        let places = || order.iter().filter(|of| all || touched[of.1]).map(|of| of.0);
        PLANE_BYTES[from..].iter().map(|&bytes| moved(places(), bytes, SECTOR_BYTES)).sum()
    };
    let mut numbers = vec![0; order.len()];
    (0..).zip(&order).for_each(|(number, &(_, rank))| numbers[rank] = number);
    let of_tile = |tile: &Vec<u32>| {
        let mut own: Vec<u64> = tile.iter().map(|&rank| numbers[rank as usize]).collect();
        own.sort_unstable();
        [SECTOR_BYTES, CACHE_LINE_BYTES].map(|unit| moved(own.iter().copied(), SPLAT_BYTES, unit))
    };
    let [splats, lines] = tiles.iter().map(of_tile).fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
    [idle, 3.0 * planes(2, true), 6.0 * planes(0, false), splats, lines]
}
