//! What each kernel does, as formulas of the counts of a step.
//!
//! Memory: the sectors that a dispatch touches, each counted once for reading and once for writing. A cache that holds
//! nothing from one dispatch to the next and everything within one moves as many.

use super::compiled::Compiler;
use super::price::{Chain, Work};
use super::scene::{Counts, all, front, some};
use super::step::Item;
use labelgs::internals::scheduler::plan::{Grid, PassDecl};
use labelgs::{Error, Result};

/// Bytes of a kernel at one of its bindings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Touch {
    /// Name of the binding.
    pub binding: &'static str,
    /// Bytes of sectors read.
    pub read: f64,
    /// Bytes of sectors written.
    pub written: f64,
}

/// The work of an item, with the bytes of each binding.
pub fn work(item: &Item, c: &Counts, compiler: &Compiler) -> Result<(Work, Vec<Touch>)> {
    let Some(pass) = &item.pass else {
        return Ok((Work { read: item.moved.0, written: item.moved.1, ..Work::default() }, Vec::new()));
    };
    let kernel = Kernel { pass, c };
    let touches = kernel.touches()?;
    let name = pass.shader.name.replace("_emulated", "").replace("_texel", "");
    let code = compiler.code(&name)?;
    let (waves, trips) = (kernel.waves()?, kernel.trips());
    if trips.len() != code.loops.len() {
        return Err(Error::Check(format!("{name} has {} loops, not {}", code.loops.len(), trips.len())));
    }
    let mut work = Work {
        instructions: waves * code.straight.0,
        specials: waves * code.straight.1,
        chain: kernel.chain(&code.loops),
        ..Work::default()
    };
    for (trips, body) in trips.iter().zip(&code.loops) {
        work.instructions += trips * body.0;
        work.specials += trips * body.1;
    }
    for touch in &touches {
        work.read += touch.read;
        work.written += touch.written;
    }
    Ok((work, touches))
}

/// Lanes of a subgroup.
const LANES: f64 = 32.0;
/// Words of a round of radix_scan.
const SCAN_ROUND: f64 = 8.0;

/// A pass of a step with these counts.
struct Kernel<'a> {
    pass: &'a PassDecl,
    c: &'a Counts,
}

/// Bytes read and written at a binding.
type Bytes = (f64, f64);

fn read(bytes: f64) -> Bytes {
    (bytes, 0.0)
}

fn written(bytes: f64) -> Bytes {
    (0.0, bytes)
}

fn both(bytes: f64) -> Bytes {
    (bytes, bytes)
}

impl Kernel<'_> {
    /// Name of the kernel without its variant.
    fn stem(&self) -> &'static str {
        self.pass.shader.stem.trim_end_matches("_flag").trim_end_matches("_labels")
    }

    /// Value of a specialisation constant.
    fn constant(&self, name: &str) -> f64 {
        let place = self.pass.shader.spec.iter().position(|constant| constant.name == name);
        place.and_then(|place| self.pass.spec.get(place)).map_or(0.0, |&word| f64::from(word))
    }

    /// Number of items of a scan or sort.
    fn items(&self) -> f64 {
        match self.constant("COUNT_SOURCE") as u32 {
            0 => self.c.gaussians,
            1 => self.c.visible,
            2 => self.c.instances,
            _ => self.c.virtual_tiles(),
        }
    }

    fn touches(&self) -> Result<Vec<Touch>> {
        let bindings = self.pass.shader.bindings.iter();
        let touches = bindings.map(|binding| {
            let (read, written) = self.bytes(binding.name)?;
            Ok(Touch { binding: binding.name, read, written })
        });
        touches.collect()
    }

    fn bytes(&self, binding: &str) -> Result<Bytes> {
        let common = match binding {
            "step" => Some(read(160.0)),
            "failure" if self.stem().starts_with("prepare") => Some(both(32.0)),
            "failure" => Some(read(32.0)),
            "counters" if self.stem() == "step_begin" => Some(written(96.0)),
            "counters" => Some(read(32.0)),
            "dispatch_args" => Some(written(32.0)),
            "layer_from_label" | "label_from_layer" | "layer_weights" | "layer_occluders" => Some(read(32.0)),
            _ => None,
        };
        let found = common.or_else(|| match self.stem() {
            "cull" | "compact" | "project_forward" | "project_backward" | "adam" => self.of_gaussians(binding),
            "scan_reduce" | "scan_spine" | "scan_apply" | "radix_count" | "radix_scan" | "radix_scatter" => {
                self.of_sorts(binding)
            }
            "emit_instances" | "tile_ranges" | "layer_list" | "gather" => self.of_lists(binding),
            "blend_forward" | "blend_backward" => self.of_blends(binding),
            _ => self.of_loss(binding),
        });
        found.ok_or_else(|| Error::Check(format!("no formula for {binding} of {}", self.pass.shader.name)))
    }

    fn of_gaussians(&self, binding: &str) -> Option<Bytes> {
        let (n, v) = (self.c.gaussians, self.c.visible);
        let stem = self.stem();
        let band = |from: f64, bytes: u32| if self.constant("SH_DEGREE") < from { 0 } else { bytes };
        // A band with its place in the rows of the model, chosen by the splats.
        let row = |bytes: u32| if bytes == 0 { 0.0 } else { some(n, v, bytes) };
        Some(match (stem, binding) {
            ("cull", "means" | "scales") => read(all(n, 16.0)),
            ("cull", "depth_keys" | "splat_from_gaussian") => written(all(n, 4.0)),
            ("compact", "depth_keys") => read(all(n, 4.0)),
            ("compact", "visible_offsets") => read(some(n, v, 4)),
            ("compact", "keys_out" | "values_out") => written(all(v, 4.0)),
            ("project_forward" | "project_backward", "gaussian_from_splat") => read(all(v, 4.0)),
            ("project_forward" | "project_backward", "means" | "scales" | "quats" | "sh0") => read(row(16)),
            ("project_forward" | "project_backward", "sh1") => read(row(band(1.0, 48))),
            ("project_forward" | "project_backward", "sh2") => read(row(band(2.0, 64))),
            ("project_forward" | "project_backward", "sh3") => read(row(band(3.0, 96))),
            ("project_forward", "splats") => written(all(v, 48.0)),
            ("project_forward", "tiles_touched") => written(all(v, 4.0)),
            ("project_forward", "splat_from_gaussian") => written(some(n, v, 4)),
            ("project_forward", "labels") => read(some(n, v, 4)),
            ("project_backward", "v_splats") => read(all(v, 48.0)),
            ("project_backward", "v_means" | "v_scales" | "v_quats" | "v_sh0") => written(all(v, 16.0)),
            ("project_backward", "v_sh1") => written(all(v, f64::from(band(1.0, 48)))),
            ("project_backward", "v_sh2") => written(all(v, f64::from(band(2.0, 64)))),
            ("project_backward", "v_sh3") => written(all(v, f64::from(band(3.0, 96)))),
            ("adam", "splat_from_gaussian") => read(all(n, 4.0)),
            ("adam", "gradients") => read(all(v, 16.0 * self.constant("STRIDE"))),
            ("adam", name) if name.ends_with("_in") => read(all(n, 16.0 * self.constant("STRIDE"))),
            ("adam", "parameters" | "first_moments" | "second_moments") => {
                written(all(n, 16.0 * self.constant("STRIDE")))
            }
            _ => return None,
        })
    }

    fn of_sorts(&self, binding: &str) -> Option<Bytes> {
        let (n, lanes) = (self.items(), self.constant("LANES"));
        let cells = lanes * self.constant("DIGIT_BITS").exp2();
        Some(match (self.stem(), binding) {
            ("scan_reduce" | "scan_apply", "values") => read(all(n, 4.0)),
            ("scan_reduce", "partials") => written(all(lanes, 4.0)),
            ("scan_spine", "partials") => both(all(lanes, 4.0)),
            ("scan_apply", "partials") => read(all(lanes, 4.0)),
            ("scan_apply", "offsets") => written(all(n, 4.0)),
            ("radix_count" | "radix_scatter", "keys_in") => read(all(n, 4.0)),
            ("radix_count", "histogram") => written(all(cells, 4.0)),
            ("radix_count", "totals") => written(all(cells / LANES, 4.0)),
            ("radix_scan", "totals") => both(all(self.constant("CELLS"), 4.0)),
            ("radix_scatter", "histogram") => read(all(cells, 4.0)),
            ("radix_scatter", "totals") => read(all(cells / LANES, 4.0)),
            ("radix_scatter", "values_in") if self.constant("IDENTITY") != 0.0 => read(0.0),
            ("radix_scatter", "values_in") => read(all(n, 4.0)),
            ("radix_scatter", "keys_out" | "values_out") => written(all(n, 4.0)),
            _ => return None,
        })
    }

    fn of_lists(&self, binding: &str) -> Option<Bytes> {
        let c = self.c;
        let (n, v, e, tiles) = (c.gaussians, c.visible, c.instances, c.virtual_tiles());
        Some(match (self.stem(), binding) {
            (_, "labels") => read(some(n, v, 4)),
            (_, "tiles_touched" | "instance_offsets" | "gaussian_from_splat") => read(all(v, 4.0)),
            ("emit_instances", "splats") => read(all(v, 48.0)),
            ("emit_instances", "tile_keys" | "splat_from_instance") => written(all(e, 4.0)),
            ("tile_ranges", "tile_keys") => read(searched(e, c.jobs())),
            ("tile_ranges", "tile_starts" | "tile_ends" | "layer_occupied") => written(all(tiles, 4.0)),
            ("layer_list", "layer_occupied") => read(all(tiles, 4.0)),
            ("layer_list", "layer_offsets") => read(some(tiles, c.layer_tiles, 4)),
            ("layer_list", "layer_tiles") => written(all(c.layer_tiles, 4.0)),
            ("gather", "v_instances_a" | "v_instances_b" | "v_instances_c") => read(all(e, 16.0)),
            ("gather", "v_splats") => written(all(v, 48.0)),
            ("gather", "densify_stats") => both(some(n, v, 8)),
            _ => return None,
        })
    }

    fn of_blends(&self, binding: &str) -> Option<Bytes> {
        let c = self.c;
        let (e, p, jobs) = (c.instances, c.pixels(), c.jobs());
        let w = if self.stem() == "blend_forward" { c.walked } else { c.weighted };
        // A splat is read if one of its tiles walks as far.
        let seen = c.visible * (1.0 - (1.0 - w / e.max(1.0)).powf(c.tiles_of_splat()));
        let layer_pixels = c.layer_tiles * c.tile_pixels;
        Some(match (self.stem(), binding) {
            (_, "tile_starts" | "tile_ends") => read(some(c.virtual_tiles(), jobs, 4)),
            // A tile's list begins anywhere in a sector.
            (_, "instance_from_sorted") => read((all(w, 4.0) + jobs * 28.0).min(all(e, 4.0))),
            (_, "splat_from_instance") => read(front(e, w, 4.0)),
            (_, "splats") => read(some(c.visible, seen, 48)),
            (_, "layer_tiles") => read(all(c.layer_tiles, 4.0)),
            ("blend_forward", "image") => written(all(p, 16.0)),
            ("blend_forward", "last") => written(all(p, 4.0)),
            ("blend_forward", "target" | "view_labels") => read(all(p.min(c.object_tiles * c.tile_pixels), 4.0)),
            ("blend_forward", "layer_state") => written(all(layer_pixels, 8.0)),
            ("blend_forward", "layer_loss") => written(all(c.layer_tiles, 4.0)),
            ("blend_forward", "label_keys" | "gaussian_from_splat") => read(0.0),
            ("blend_backward", "image" | "v_image") => read(all(p, 16.0)),
            ("blend_backward", "last") => read(all(p, 4.0)),
            ("blend_backward", "layer_state") => read(all(layer_pixels, 8.0)),
            ("blend_backward", "v_instances_a" | "v_instances_b" | "v_instances_c") => {
                // Two records fill a sector: those of a splat's neighbouring tiles, which stop at about the same depth.
                written(all(w, 16.0))
            }
            _ => return None,
        })
    }

    fn of_loss(&self, binding: &str) -> Option<Bytes> {
        let p = self.c.pixels();
        Some(match (self.stem(), binding) {
            ("ssim_columns" | "loss_columns_backward", "image") => read(all(p, 16.0)),
            (_, "target") => read(all(p, 4.0)),
            ("ssim_columns", "moments") => written(all(3.0 * p, 16.0)),
            ("ssim_rows", "moments") | ("ssim_rows_backward", "v_moments") | ("loss_columns_backward", "v_rows") => {
                read(all(3.0 * p, 16.0))
            }
            ("ssim_rows", "v_moments") | ("ssim_rows_backward", "v_rows") => written(all(3.0 * p, 16.0)),
            ("loss_columns_backward", "v_image") => written(all(p, 16.0)),
            ("loss_columns_backward", "loss_partials") => written(all(self.partials(), 8.0)),
            ("loss_reduce", "loss_partials") => read(all(self.constant("PARTIALS"), 8.0)),
            ("loss_reduce", "layer_loss") => read(all(self.c.layer_tiles, 4.0)),
            _ => return None,
        })
    }

    /// Partial sums of the loss: one for each subgroup.
    fn partials(&self) -> f64 {
        self.grid() * 64.0 / LANES
    }

    /// Workgroups of a grid that the list fixes.
    fn grid(&self) -> f64 {
        match self.pass.grid {
            Grid::Groups(x, y, z) => f64::from(x) * f64::from(y) * f64::from(z),
            Grid::Indirect(..) => 0.0,
        }
    }

    /// Subgroups of the dispatch.
    fn waves(&self) -> Result<f64> {
        let c = self.c;
        Ok(match self.stem() {
            "cull" | "compact" => c.gaussians / LANES,
            "adam" => c.gaussians * self.constant("STRIDE") / LANES,
            "project_forward" | "project_backward" | "emit_instances" | "gather" => c.visible / LANES,
            "tile_ranges" | "layer_list" => c.virtual_tiles() / LANES,
            "blend_forward" | "blend_backward" => c.jobs(),
            "ssim_columns" | "ssim_rows" | "ssim_rows_backward" | "loss_columns_backward" => self.grid() * 64.0 / LANES,
            stem if matches!(self.pass.grid, Grid::Indirect(..)) => {
                return Err(Error::Check(format!("no formula for the workgroups of {stem}")));
            }
            _ => self.grid(),
        })
    }

    /// Rounds of each loop of the code, over all subgroups.
    fn trips(&self) -> Vec<f64> {
        let c = self.c;
        let splat_waves = c.visible / LANES;
        // The layers of objects double the pairs of a splat, but not its rounds.
        let most_tiles = c.tiles_of_splat() * c.divergence;
        let doubled = 1.0 + c.layer_visible / c.visible.max(1.0);
        let shares = self.items() / LANES;
        match self.stem() {
            "blend_forward" => vec![c.walked / LANES + 0.5 * c.jobs(), c.walked],
            "blend_backward" => vec![c.weighted / LANES + 0.5 * c.jobs(), c.weighted],
            "emit_instances" | "project_forward" => vec![splat_waves * most_tiles / doubled],
            "gather" => vec![splat_waves * most_tiles],
            "radix_count" | "radix_scatter" | "scan_reduce" | "scan_apply" => vec![shares],
            "radix_scan" => vec![self.constant("CELLS") / LANES / SCAN_ROUND; 2],
            "scan_spine" => vec![self.constant("LANES") / LANES; 2],
            "tile_ranges" => vec![c.virtual_tiles() / LANES * c.instances.max(2.0).log2(); 2],
            "loss_reduce" => {
                let layers = self.pass.shader.macros.contains(&"LABELS").then_some(c.layer_tiles / LANES);
                [self.constant("PARTIALS") / LANES].into_iter().chain(layers).collect()
            }
            _ => Vec::new(),
        }
    }

    /// The longest chain of one lane: rounds that each wait for memory, or that one subgroup walks alone.
    fn chain(&self, loops: &[(f64, f64)]) -> Chain {
        let c = self.c;
        let body = |index: usize| loops.get(index).map_or(0.0, |body| body.0);
        let share = (self.items() / self.constant("LANES").max(1.0)).ceil();
        match self.stem() {
            // Words one after the other: one in eight comes from memory.
            "radix_count" | "scan_reduce" | "scan_apply" => {
                let shared = if self.stem() == "radix_count" { 2.0 * share } else { 0.0 };
                Chain { memory: share / 8.0, near: share * 7.0 / 8.0, shared, instructions: share * body(0), far: 0.0 }
            }
            "radix_scatter" => Chain {
                memory: share / 8.0,
                near: share * 7.0 / 8.0,
                shared: 2.0 * share,
                instructions: share * body(0),
                far: 0.0,
            },
            // One subgroup; every round waits for words that the passes before have just written.
            "radix_scan" => {
                let rounds = self.constant("CELLS") / LANES / SCAN_ROUND;
                Chain { far: 2.0 * rounds, instructions: rounds * (body(0) + body(1)), ..Chain::default() }
            }
            "scan_spine" => {
                let rounds = self.constant("LANES") / LANES;
                Chain { far: 2.0 * rounds, instructions: rounds * (body(0) + body(1)), ..Chain::default() }
            }
            "loss_reduce" => {
                let rounds = (self.constant("PARTIALS") + c.layer_tiles) / LANES;
                Chain { far: rounds, instructions: rounds * body(0), ..Chain::default() }
            }
            // One lane walks all tiles of a splat.
            "project_forward" | "emit_instances" => {
                Chain { memory: 4.0, instructions: c.largest_splat * body(0), ..Chain::default() }
            }
            "gather" => Chain {
                memory: c.largest_splat / 2.0,
                near: c.largest_splat / 2.0,
                instructions: c.largest_splat * body(0),
                ..Chain::default()
            },
            "tile_ranges" => Chain { memory: 2.0 * c.instances.max(2.0).log2(), ..Chain::default() },
            // One subgroup walks the longest list; a batch waits for an index, for another, and for the splats.
            "blend_forward" | "blend_backward" => {
                let batches = (c.longest_list / LANES).ceil();
                Chain {
                    far: 3.0 * batches,
                    instructions: batches * body(0) + c.longest_list * body(1),
                    ..Chain::default()
                }
            }
            _ => Chain { memory: 2.0, ..Chain::default() },
        }
    }
}

/// Bytes that a binary search of `tiles + 1` boundaries touches in `count` sorted words.
fn searched(count: f64, tiles: f64) -> f64 {
    let sectors = (count / 8.0).max(1.0);
    let levels = sectors.log2().ceil() as i32;
    let touched: f64 = (0..=levels).map(|level| f64::from(level).exp2().min(tiles + 1.0)).sum();
    touched.min(sectors) * 32.0
}
