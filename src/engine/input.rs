//! Host inputs of the lists, by kind of list.

use super::Engine;
use crate::error::{Error, Result};
use crate::scheduler::DataKey;
use crate::scheduler::plan::Buf;
use crate::shaders::constants::NO_ROW;
use crate::shaders::structs::StepUniforms;
use std::borrow::Cow;
use std::ops::RangeInclusive;

/// Bits of normal floats: a stamp is a part of a vector of floats, and a device may replace subnormal floats by 0.
const NORMAL_STAMPS: RangeInclusive<u32> = 0x0080_0000..=0x7f7f_ffff;

/// The input of a list besides the model.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Input<'a> {
    /// Input of a render, a densification or an opacity reset.
    Uniforms(&'a StepUniforms),
    /// Input of a training step.
    Train(&'a TrainInput<'a>),
    /// Input of a vote on a view.
    Vote(&'a VoteInput<'a>),
}

/// Input of a training step.
#[derive(Clone, Debug)]
pub(crate) struct TrainInput<'a> {
    /// Uniforms.
    pub uniforms: StepUniforms,
    /// Key of the view's photo and labels, if they will be used again.
    pub key: Option<DataKey>,
    /// The photo, `[P]`, RGBA8; pixels with alpha 0 are ignored.
    pub photo: Cow<'a, [[u8; 4]]>,
    /// Labels, in a step with object layers.
    pub layers: Option<LayerInput<'a>>,
    /// Visible object of each pixel, `[P]`, in a step that compares it with splat labels.
    pub disagreement: Option<&'a [u32]>,
    /// Known 1 / depth of each pixel, `[P]`, 0 for unknown, in a step that compares depths.
    pub depths: Option<&'a [f32]>,
    /// Rows of shared parameters that the step uses; its passes refer to them by index in this order.
    pub shared: Vec<SharedRow>,
}

/// A row of shared parameters, as used in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SharedRow {
    /// Index of the row.
    pub row: u32,
    /// Learning rates; if all are 0, the row and its moments stay unchanged.
    pub rates: [f32; 4],
}

/// Label input of a training step.
#[derive(Clone, Debug)]
pub(crate) struct LayerInput<'a> {
    /// Visible object of each pixel, `[P]`.
    pub view_labels: &'a [u32],
    /// Layer of each label id; 0 if the step does not sample the label.
    pub layer_from_label: Vec<u32>,
    /// Label id of each layer.
    pub label_from_layer: Vec<u32>,
    /// Weight of each layer's label loss.
    pub weights: Vec<f32>,
    /// For each layer, one bit per label id; set if that object hides the layer's object.
    pub occluders: Vec<u32>,
}

/// Input of a vote on a view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VoteInput<'a> {
    /// Uniforms.
    pub uniforms: StepUniforms,
    /// Column of each pixel, `[P]`.
    pub columns: &'a [u32],
    /// Weight of the votes of each column.
    pub weights: &'a [f32],
}

impl<'a> Input<'a> {
    /// The uniforms.
    pub(super) fn uniforms(self) -> &'a StepUniforms {
        match self {
            Self::Uniforms(uniforms) => uniforms,
            Self::Train(train) => &train.uniforms,
            Self::Vote(vote) => &vote.uniforms,
        }
    }
}

impl<'a> From<&'a StepUniforms> for Input<'a> {
    fn from(uniforms: &'a StepUniforms) -> Self {
        Self::Uniforms(uniforms)
    }
}

impl<'a> From<&'a TrainInput<'a>> for Input<'a> {
    fn from(input: &'a TrainInput<'a>) -> Self {
        Self::Train(input)
    }
}

impl<'a> From<&'a VoteInput<'a>> for Input<'a> {
    fn from(input: &'a VoteInput<'a>) -> Self {
        Self::Vote(input)
    }
}

impl Engine {
    /// Writes the input of a list into a frame. Checks the image size, because every camera passes through here.
    pub(crate) fn write(&mut self, frame: usize, input: Input) -> Result<()> {
        let uniforms = input.uniforms();
        self.size.check_image(uniforms.width, uniforms.height)?;
        // The record of a (splat, tile) pair is valid only if it carries the stamp of the current submit.
        self.stamp = if NORMAL_STAMPS.contains(&(self.stamp + 1)) { self.stamp + 1 } else { *NORMAL_STAMPS.start() };
        if let Input::Train(train) = input {
            self.write_shared(frame, &train.shared)?;
        }
        let (gaussian_count, trained_count) = (self.gaussian_count, self.trained_count());
        let word = |room: u64| u32::try_from(room).unwrap_or(u32::MAX);
        // A step's uniforms may be older than the latest densification. Capacities are uniforms rather than kernel
        // constants, so that growth does not recompile kernels.
        let counts = StepUniforms {
            gaussian_count,
            trained_count,
            instance_capacity: word(self.capacity.instances),
            layer_tile_capacity: word(self.capacity.layer_tiles),
            longest_list: word(self.capacity.segments.max(1) * u64::from(self.shape.segment_length)),
            chunk_length: self.shape.group_blend.map_or(0, |blend| blend.chunk_length),
            stamp: self.stamp,
            ..*uniforms
        };
        self.sched.upload(Buf::STEP, frame, 0, &[counts])?;
        self.write_missed(frame)?;
        let (sched, shape) = (&mut self.sched, &self.shape);
        match input {
            Input::Uniforms(_) => Ok(()),
            Input::Train(train) => {
                // A photo made for this step is not used again.
                let key = train.key.filter(|_| matches!(train.photo, Cow::Borrowed(_)));
                sched.load(Buf::TARGET, frame, key, || Cow::Borrowed(&train.photo))?;
                train.depths.map_or(Ok(()), |depths| sched.upload(Buf::DEPTHS, frame, 0, depths))?;
                let of_layers = train.layers.as_ref().map(|layers| layers.view_labels);
                if let Some(labels) = train.disagreement.or(of_layers) {
                    sched.load(Buf::VIEW_LABELS, frame, train.key, || shape.view_labels(labels))?;
                }
                let Some(layers) = &train.layers else { return Ok(()) };
                sched.upload(Buf::LAYER_FROM_LABEL, frame, 0, &layers.layer_from_label)?;
                sched.upload(Buf::LABEL_FROM_LAYER, frame, 0, &layers.label_from_layer)?;
                sched.upload(Buf::LAYER_WEIGHTS, frame, 0, &layers.weights)?;
                sched.upload(Buf::LAYER_OCCLUDERS, frame, 0, &layers.occluders)
            }
            Input::Vote(vote) => {
                sched.upload(Buf::VIEW_LABELS, frame, 0, vote.columns)?;
                sched.upload(Buf::VOTE_WEIGHTS, frame, 0, vote.weights)
            }
        }
    }

    /// Writes the rows of a step and a terminator. Each row may occur once.
    fn write_shared(&mut self, frame: usize, shared: &[SharedRow]) -> Result<()> {
        let mut rows: Vec<u32> = shared.iter().map(|step| step.row).collect();
        let mut sorted = rows.clone();
        sorted.sort_unstable();
        sorted.dedup();
        let all = self.size.shared_rows;
        if sorted.len() < rows.len() || sorted.last().is_some_and(|&row| row >= all) {
            return Err(Error::Bug(format!("shared rows {rows:?} of a step: expected different indices below {all}")));
        }
        if all == 0 {
            return Ok(());
        }
        rows.resize(all as usize, NO_ROW);
        let rates: Vec<[f32; 4]> = shared.iter().map(|step| step.rates).collect();
        self.sched.upload(Buf::STEP_ROWS, frame, 0, &rows)?;
        self.sched.upload(Buf::STEP_RATES, frame, 0, &rates)
    }
}
