//! `labelgs plan`.

use crate::cli::commands::devices::{shape_json, shape_text};
use crate::cli::support::Context;
use crate::cli::support::parsers::{Size, bytes, count, size};
use crate::engine::{Engine, EngineSize, LabelSize, capacity, card, predict_for, predict_votes};
use crate::gpu;
use crate::pass::buffers::{Capacity, TABLE};
use crate::pass::{KernelShape, Supervision, Update, Variant, training_step};
use crate::scheduler::plan::{Limits, MemoryReport, PassList, Plan, PlanOptions};
use crate::train::Moments;
use crate::words::counted;
use crate::{Error, Result};
use clap::Args;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// `labelgs plan`.
#[derive(Args, Clone, Debug)]
pub struct PlanArgs {
    /// Number of Gaussians, such as 500k or 2M.
    #[arg(long, alias = "max-gaussians", value_name = "N", value_parser = count, default_value = "1M")]
    pub gaussians: u64,
    /// Image size, px.
    #[arg(long, alias = "max-resolution", value_name = "WxH", value_parser = size, default_value = "1600x1064")]
    pub size: Size,
    /// Number of objects per step; 0 plans a run without labels.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub label_samples: u32,
    /// Degree of the spherical harmonics.
    #[arg(long, value_name = "DEGREE", value_parser = clap::value_parser!(u32).range(0..=3), default_value_t = 3)]
    pub sh_degree: u32,
    /// Precision of the optimiser's moments, as the setting `moments` of `labelgs train`.
    #[arg(long, value_name = "KIND", value_enum, default_value_t)]
    pub moments: Moments,
    /// Plan for a GPU with this much memory, such as 24G, instead of the device of this machine.
    #[arg(long, alias = "gpu-memory", value_name = "SIZE", value_parser = bytes)]
    pub card: Option<u64>,
}

/// Largest label id of the plan; a larger id costs a few bytes.
const PLANNED_LABEL_MAX: u32 = 255;

/// A step and its device.
struct Subject {
    device: Option<String>,
    shape: KernelShape,
    limits: Limits,
    room: EngineSize,
    capacity: Capacity,
    list: PassList,
}

/// The memory of a training.
struct Memory {
    steps: MemoryReport,
    /// While it counts votes.
    votes: Option<MemoryReport>,
}

impl Memory {
    fn total(&self) -> u64 {
        self.votes.iter().map(|votes| votes.total).fold(self.steps.total, u64::max)
    }
}

impl Subject {
    /// Returns the memory with packed moments, if full ones do not fit and these do.
    fn half_fits(&self, full: &Memory) -> Option<u64> {
        let half = self.room.with_half_moments(true);
        let is_tried = full.total() > self.limits.max_memory && !self.room.half_moments;
        predict_for(&self.shape, &self.limits, &half).ok().filter(|_| is_tried).map(|half| half.total)
    }
}

/// Prints the plan of a step. Fails afterwards if the plan exceeds the device.
pub(crate) fn run(args: &PlanArgs, context: &Context) -> Result<()> {
    let subject = subject(args, context)?;
    let (planned, problem) = match planned(&subject, &subject.limits) {
        Err(error @ Error::OutOfMemory { .. }) => (planned(&subject, &without_sizes(&subject.limits))?, Some(error)),
        done => (done?, None),
    };
    context.show(&to_json(&subject, &planned, problem.as_ref()), &to_text(&subject, &planned)?)?;
    problem.map_or(Ok(()), Err)
}

fn subject(args: &PlanArgs, context: &Context) -> Result<Subject> {
    let (device, shape, limits) = match args.card {
        Some(memory) => {
            let (shape, limits) = card(memory);
            (Some(format!("a GPU with {:.1} GiB", memory as f64 / f64::from(1 << 30))), shape, limits)
        }
        None => device(context)?,
    };
    let labels = (args.label_samples > 0).then(|| LabelSize {
        max_label: PLANNED_LABEL_MAX.max(args.label_samples),
        layers: args.label_samples,
        vote_columns: PLANNED_LABEL_MAX.max(args.label_samples) + 1,
    });
    let size = (args.size.0, args.size.1);
    let room = EngineSize::new(args.gaussians.max(1), size).for_training().with_labels(labels);
    let room = room.with_half_moments(args.moments == Moments::Half);
    let capacity = capacity(&shape, &room);
    let supervision = labels.map_or(Supervision::Photo, |_| Supervision::Layers { lift: false });
    let variant = Variant { supervision, sh_degree: args.sh_degree, ..Variant::plain(size) };
    let list = training_step(&shape, &capacity, variant);
    Ok(Subject { device, shape, limits, room, capacity, list })
}

/// Returns the name, kernels and limits of the device, or of an assumed CPU device if there is none.
fn device(context: &Context) -> Result<(Option<String>, KernelShape, Limits)> {
    let options = context.gpu_options()?;
    match gpu::devices(&options) {
        Ok((devices, Ok(picked))) => {
            let device = &devices[picked];
            Ok((Some(device.name.clone()), KernelShape::for_device(device), device.limits.plan))
        }
        Ok((_, Err(error))) | Err(error) if options.device.is_some() => Err(error),
        Ok((_, Err(_))) | Err(Error::NoDevice(_)) => {
            tracing::warn!("no usable Vulkan device; the plan assumes a CPU device with modest limits");
            Ok((None, KernelShape::new(8, true), Limits::default()))
        }
        Err(error) => Err(error),
    }
}

fn planned(subject: &Subject, limits: &Limits) -> Result<(Memory, Plan)> {
    let lists = Engine::lists_of(&subject.shape, &subject.capacity, &subject.room);
    let options = PlanOptions::default();
    let steps = MemoryReport::predict(TABLE, &subject.capacity.counts(), &lists, limits, options)?;
    let votes = predict_votes(&subject.shape, limits, &subject.room)?;
    Ok((Memory { steps, votes }, Plan::new(TABLE, &subject.capacity.counts(), &subject.list, limits, options)?))
}

/// Returns the limits with unlimited memory, for a report of the needed memory.
fn without_sizes(limits: &Limits) -> Limits {
    const UNLIMITED_BYTES: u64 = 1 << 60;
    Limits {
        max_storage_range: UNLIMITED_BYTES,
        max_texel_elements: UNLIMITED_BYTES,
        max_allocation: UNLIMITED_BYTES,
        max_memory: UNLIMITED_BYTES,
        ..*limits
    }
}

fn to_text(subject: &Subject, (memory, plan): &(Memory, Plan)) -> Result<String> {
    let (room, capacity) = (&subject.room, &subject.capacity);
    let objects = room.labels.map_or(0, |labels| labels.layers);
    Ok(format!(
        "Training {} on {} x {} px images with {} per step{}\n\
         device:  {}\nkernels: {}\nroom for {} (splat, tile) pairs, {} tiles of object layers\n\n\
         MEMORY at the start; pairs and tiles of object layers grow when a view needs more\n{}{}\n\
         SCRATCH ARENA of the step; buffers whose items do not overlap share bytes\n{}\n\
         PASSES\n{}\n{}",
        counted(room.gaussians, "Gaussian"),
        room.image.0,
        room.image.1,
        counted(objects, "object"),
        if room.half_moments { ", 16-bit moments" } else { "" },
        subject.device.as_deref().unwrap_or("none found, limits assumed"),
        shape_text(&subject.shape),
        capacity.instances,
        capacity.layer_tiles,
        memory.steps.report(),
        memory.votes.as_ref().map_or(String::new(), votes_text),
        plan.arena_report(),
        plan.report(),
        summary(subject, memory)?
    ))
}

const MIB_BYTES: f64 = 1_048_576.0;

/// Returns what a count of votes needs: their memory comes and goes with it.
fn votes_text(votes: &MemoryReport) -> String {
    let rows = votes.rows.iter().filter(|row| row.name.starts_with("votes_"));
    let (own, scratch) =
        (rows.map(|row| row.bytes).sum::<u64>() as f64 / MIB_BYTES, votes.step_pages.iter().sum::<u64>());
    let (scratch, total) = (scratch as f64 / MIB_BYTES, votes.total as f64 / MIB_BYTES);
    format!(
        "\nvote counting, between steps: votes {own:.0} MiB, scratch arena {scratch:.0} MiB, total {total:.0} MiB\n"
    )
}

/// Returns what to take from the plan: the memory, the Gaussians that fit, and what smaller values save.
fn summary(subject: &Subject, memory: &Memory) -> Result<String> {
    let room = &subject.room;
    let (needed, limit) = (memory.total() as f64 / MIB_BYTES, subject.limits.max_memory as f64 / MIB_BYTES);
    let mut text = format!("needed:  {needed:.0} MiB at the start, of {limit:.0} MiB available\n");
    text += &match most_gaussians(subject) {
        0 => "fits:    no Gaussians at this image size\n".to_owned(),
        most => format!("fits:    up to {} at this image size and number of objects\n", counted(most, "Gaussian")),
    };
    let moments = if room.half_moments { Moments::Half } else { Moments::Full };
    if let Some(total) = subject.half_fits(memory) {
        let needed = total as f64 / MIB_BYTES;
        text += &format!("moments: fits with `labelgs train --set moments=half`: {needed:.0} MiB\n");
    } else if let Some(advice) = moments.advice(room.gaussians).filter(|_| subject.shape.update == Update::Lazy) {
        text += &format!("moments: {advice}\n");
    }
    let kept = subject.limits.kept_max(memory.total());
    if kept > 0 {
        let views = kept / (6 * u64::from(room.image.0) * u64::from(room.image.1)).max(1);
        text += &format!("photos:  {views} with masks stay resident, in {:.0} MiB\n", kept as f64 / MIB_BYTES);
    }
    let half = |value: u32| (value / 2).max(1);
    let image = (half(room.image.0), half(room.image.1));
    let labels = room.labels.map(|labels| LabelSize { layers: half(labels.layers), ..labels });
    let smaller = [
        ("half of --gaussians", EngineSize { gaussians: (room.gaussians / 2).max(1), ..*room }),
        ("--moments half", room.with_half_moments(true)),
        ("half of both sides of --size", EngineSize { image, ..*room }),
        ("half of --label-samples", EngineSize { labels, ..*room }),
    ];
    let mut savings = Vec::new();
    for (what, room) in smaller.into_iter().filter(|(_, smaller)| smaller != room) {
        let total = predict_for(&subject.shape, &without_sizes(&subject.limits), &room)?.total;
        savings.push((memory.total().saturating_sub(total), what));
    }
    savings.sort_by(|a, b| b.cmp(a));
    let shown = savings.iter().filter(|(bytes, _)| *bytes as f64 >= MIB_BYTES);
    let savings: Vec<String> =
        shown.map(|(bytes, what)| format!("{what} saves {:.0} MiB", *bytes as f64 / MIB_BYTES)).collect();
    Ok(text + &format!("savings: {}\n", savings.join(", ")))
}

/// Returns the most Gaussians that fit the device.
fn most_gaussians(subject: &Subject) -> u64 {
    let fits = |gaussians| {
        let room = EngineSize { gaussians, ..subject.room };
        predict_for(&subject.shape, &subject.limits, &room).is_ok()
    };
    let (mut fitting, mut tried) = (0, 1);
    while tried <= u64::from(u32::MAX) && fits(tried) {
        (fitting, tried) = (tried, 2 * tried);
    }
    // Three digits are enough.
    while tried - fitting > (fitting / 1000).max(1) {
        let middle = fitting.midpoint(tried);
        if fits(middle) { fitting = middle } else { tried = middle }
    }
    fitting
}

fn to_json(subject: &Subject, (memory, plan): &(Memory, Plan), problem: Option<&Error>) -> Value {
    let room = &subject.room;
    let buffers = memory.steps.rows.iter().map(|row| {
        json!({
            "name": row.name, "class": row.class.name(), "elements": row.count, "element_bytes": row.element_bytes,
            "bytes": row.bytes,
        })
    });
    let passes = plan.items.iter().map(|item| {
        let names = |writes| -> BTreeSet<&str> {
            let touches = item.touches.iter().filter(|touch| touch.kind.writes() == writes);
            touches.map(|touch| TABLE[touch.buf.index()].name).collect()
        };
        let barrier = item.barrier.as_ref().map(|barrier| &barrier.reason);
        json!({ "name": item.label, "reads": names(false), "writes": names(true), "barrier": barrier })
    });
    json!({
        "schema_version": 1,
        "device": subject.device,
        "kernels": shape_json(&subject.shape),
        "gaussians": room.gaussians,
        "size": [room.image.0, room.image.1],
        "moments": if room.half_moments { Moments::Half } else { Moments::Full },
        "fits_with_half_moments": room.half_moments && problem.is_none() || subject.half_fits(memory).is_some(),
        "label_samples": room.labels.map_or(0, |labels| labels.layers),
        "instances": subject.capacity.instances,
        "layer_tiles": subject.capacity.layer_tiles,
        "fits": problem.is_none(),
        "problem": problem.map(Error::to_string),
        "memory": {
            "buffers": buffers.collect::<Vec<_>>(),
            "scratch_pages": memory.steps.step_pages,
            "scratch_without_sharing": memory.steps.step_unaliased,
            "staging": memory.steps.staging,
            "total_while_counting_votes": memory.votes.as_ref().map(|votes| votes.total),
            "total": memory.total(),
            "kept_max": subject.limits.kept_max(memory.total()),
        },
        "barriers": plan.barrier_count(),
        "passes": passes.collect::<Vec<_>>(),
    })
}
