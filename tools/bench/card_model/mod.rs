//! A model of a training step on graphics cards: bytes, instructions, dispatches, barriers, host work and time of each
//! stage, checked against counters of memory accesses and against published times of other trainers.
//!
//! `devices.rs` has the figures of cards, `kernels.rs` what each kernel does, `price.rs` the time that follows, and
//! `step.rs` takes the list of passes from the engine.

mod compiled;
mod counters;
mod devices;
mod instrument;
mod kernels;
mod price;
mod scene;
mod step;
mod trainers;

use super::Common;
use super::measure::{self, table};
use compiled::Compiler;
use devices::{A100, Card, EFFICIENCY, RTX_4090};
use labelgs::Result;
use labelgs::internals::pass::Stage;
use price::{Bound, Work, seconds, starts};
use scene::Counts;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use step::Subject;

/// Share of the Gaussians that a view sees.
const VISIBLE: f64 = 0.45;

/// (splat, tile) pairs of the scene for each Gaussian, with tiles of 16 x 16 px.
const PAIRS: f64 = 2.0;

/// Share of the pairs that tiles walk before all their pixels stop, and up to the last pair with a weight.
const WALKED: f64 = 0.9;
const WEIGHTED: f64 = 0.85;

const CARDS: [Card; 2] = [RTX_4090, A100];

/// Kernels that the tables name, the slowest first.
const NAMED: usize = 8;

/// Cost of a stage, or of a kernel over all its dispatches.
#[derive(Clone, Default)]
struct Cost {
    work: Work,
    dispatches: u32,
    barriers: u32,
    /// Seconds on each card.
    seconds: [f64; CARDS.len()],
    /// Seconds by what bounds them, on each card.
    bounds: [BTreeMap<Bound, f64>; CARDS.len()],
}

impl Cost {
    fn add(&mut self, work: &Work, barrier: bool) {
        self.work += *work;
        self.dispatches += 1;
        self.barriers += u32::from(barrier);
        for (index, card) in CARDS.iter().enumerate() {
            let (time, bound) = seconds(work, card);
            self.seconds[index] += time + starts(1.0, f64::from(u8::from(barrier)), card);
            *self.bounds[index].entry(bound).or_default() += time;
        }
    }

    fn bound(&self, card: usize) -> &'static str {
        let most = self.bounds[card].iter().max_by(|a, b| a.1.total_cmp(b.1));
        most.map_or("", |(bound, _)| bound.name())
    }

    fn row(&self, name: &str) -> Vec<String> {
        let mut row = vec![
            name.to_owned(),
            format!("{:.1}", self.work.bytes() / 1e6),
            format!("{:.1}", self.work.instructions / 1e6),
            format!("{:.1}", self.work.specials / 1e6),
            self.dispatches.to_string(),
            self.barriers.to_string(),
        ];
        for card in 0..CARDS.len() {
            row.push(format!("{:.3}", self.seconds[card] * 1e3));
            row.push(self.bound(card).to_owned());
        }
        row
    }

    fn json(&self, name: &str) -> Value {
        let cards = CARDS.iter().enumerate().map(
            |(index, card)| json!({ "card": card.name, "ms": self.seconds[index] * 1e3, "bound": self.bound(index) }),
        );
        json!({
            "name": name, "work": self.work, "dispatches": self.dispatches, "barriers": self.barriers,
            "cards": cards.collect::<Vec<_>>(),
        })
    }
}

/// Counts of a step of `gaussians` at 1600 x 1064 px. Those that a scene decides are assumptions, the same for every
/// number of Gaussians, and are printed with the tables.
fn counts(subject: &Subject) -> Counts {
    let n = subject.gaussians as f64;
    let shape = Subject::shape();
    let (tiles_x, tiles_y) = shape.tiles(subject.size.0, subject.size.1);
    let tiles = f64::from(tiles_x) * f64::from(tiles_y);
    // Masks on 27 % of the pixels add 0.38 object pairs to a scene pair (the benchmark `steps`).
    let (objects, share) = if subject.layers > 0 { (0.38, 0.27) } else { (0.0, 0.0) };
    let instances = PAIRS * n * (1.0 + objects);
    Counts {
        gaussians: n,
        visible: VISIBLE * n,
        instances,
        walked: WALKED * instances,
        weighted: WEIGHTED * instances,
        largest_splat: 0.1 * tiles,
        divergence: 3.0,
        longest_list: 5.0 * PAIRS * n / tiles,
        width: f64::from(subject.size.0),
        height: f64::from(subject.size.1),
        tiles,
        tile_pixels: f64::from(shape.tile_pixels()),
        layers: f64::from(subject.layers),
        layer_tiles: 1.5 * share * tiles,
        object_tiles: share * tiles,
        layer_visible: objects * VISIBLE * n,
    }
}

/// Runs it.
pub fn run(common: &Common) -> Result<()> {
    let compiler = Compiler::read()?;
    println!("instructions: {}; every rate at {EFFICIENCY} of its peak", compiler.name);
    let mut found = Vec::new();
    for (gaussians, layers) in [(1_000_000, 0), (5_000_000, 0), (1_000_000, 10), (5_000_000, 10)] {
        let subject = Subject { gaussians, size: (1600, 1064), layers, sh_degree: 3 };
        found.push(report(&subject, &compiler)?);
    }
    let published = trainers::check(&compiler)?;
    let counted = counters::check(common, &compiler)?;
    measure::write_json(
        &common.output.join("card_model.json"),
        &json!({ "schema_version": 1, "cards": CARDS, "efficiency": EFFICIENCY, "steps": found, "published": published,
            "counters": counted }),
    )
}

/// Prints a step, stage by stage; returns it as JSON.
fn report(subject: &Subject, compiler: &Compiler) -> Result<Value> {
    let c = counts(subject);
    println!(
        "\n{:.0} M Gaussians, {} x {} px, degree {}, {} objects: {:.2} M visible, {:.1} M pairs, {:.0} % of them walked, \
         {:.0} M (pixel, splat) pairs or {:.0} a pixel; {:.0} tiles of the largest splat, {:.0} pairs in the longest list, \
         divergence {}",
        c.gaussians / 1e6,
        c.width,
        c.height,
        subject.sh_degree,
        subject.layers,
        c.visible / 1e6,
        c.instances / 1e6,
        c.walked_share() * 100.0,
        c.walked * c.tile_pixels / 1e6,
        c.walked * c.tile_pixels / c.pixels(),
        c.largest_splat,
        c.longest_list,
        c.divergence,
    );
    let (mut stages, mut kernels): (BTreeMap<Stage, Cost>, BTreeMap<String, Cost>) = Default::default();
    let mut all = Cost::default();
    for item in subject.items()? {
        let (work, _) = kernels::work(&item, &c, compiler)?;
        stages.entry(item.stage).or_default().add(&work, item.barrier);
        kernels.entry(item.title).or_default().add(&work, item.barrier);
        all.add(&work, item.barrier);
    }
    let mut rows = vec![head("stage")];
    rows.extend(stages.iter().map(|(stage, cost)| cost.row(stage.name())));
    rows.push(all.row("step"));
    println!("{}", table(&rows));
    let mut order: Vec<(&String, &Cost)> = kernels.iter().collect();
    order.sort_by(|a, b| b.1.seconds[0].total_cmp(&a.1.seconds[0]));
    let mut rows = vec![head("slowest kernels")];
    rows.extend(order.iter().take(NAMED).map(|(name, cost)| cost.row(name)));
    println!("{}", table(&rows));
    let host = host(subject);
    let link = CARDS.map(|card| format!("{:.2} ms on {}", host / card.link * 1e3, card.name));
    println!(
        "host: {:.1} MB of photo and masks a step, {}, while the card works on the step before",
        host / 1e6,
        link.join(", ")
    );
    Ok(json!({
        "gaussians": subject.gaussians, "layers": subject.layers, "sh_degree": subject.sh_degree, "counts": c,
        "stages": stages.iter().map(|(stage, cost)| cost.json(stage.name())).collect::<Vec<_>>(),
        "kernels": order.iter().map(|(name, cost)| cost.json(name)).collect::<Vec<_>>(),
        "step": all.json("step"), "host_bytes": host,
    }))
}

fn head(first: &str) -> Vec<String> {
    let mut row = [first, "MB", "M instr.", "M special", "dispatches", "barriers"].map(str::to_owned).to_vec();
    for card in &CARDS {
        row.push(format!("{}, ms", card.name));
        row.push("bound by".to_owned());
    }
    row
}

/// Bytes that the host writes for a step: a photo of four bytes a pixel, and with objects as many of labels.
fn host(subject: &Subject) -> f64 {
    let pixels = f64::from(subject.size.0) * f64::from(subject.size.1);
    if subject.layers > 0 { 8.0 * pixels } else { 4.0 * pixels }
}
