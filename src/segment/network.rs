//! A promptable segmentation network: an encoder that processes a photo once, and a decoder that answers prompts.

use super::features::{Features, digest};
use super::interface::{DecoderPorts, EncoderPorts};
use super::prompt::{Frame, MASK_GRID_SIDE, Prompt};
use labelgs_files::read;
use labelgs_scene::{Error, Photo, Result};
use rten::{Model, NodeId, RunOptions, ThreadPool, Value, ValueOrView, ValueView};
use rten_tensor::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Mean and standard deviation of ImageNet's channels, 0 to 255, with which these networks expect photos to be
/// normalised.
const CHANNEL_MEANS: [f32; 3] = [123.675, 116.28, 103.53];
const CHANNEL_DEVIATIONS: [f32; 3] = [58.395, 57.12, 57.375];

/// Memory of an encoder for a photo of 1024 px, and of each decoder thread, bytes.
const ENCODER_BYTES: u64 = 400 << 20;
const THREAD_BYTES: u64 = 60 << 20;

/// Returns the number of threads for a network: one per processor, or fewer if `free` bytes of memory do not suffice.
pub fn threads_for(processors: usize, free: Option<u64>) -> usize {
    let fitting = free.map(|bytes| bytes.saturating_sub(ENCODER_BYTES) / THREAD_BYTES);
    let fitting = fitting.map_or(processors, |count| usize::try_from(count).unwrap_or(processors));
    processors.min(fitting).max(1)
}

/// A segmentation network with weights from the user.
pub struct Network {
    encoder: NetworkFile,
    decoder: NetworkFile,
    encoder_ports: EncoderPorts,
    ports: DecoderPorts,
    threads: usize,
    /// Distinguishes the network from others with the same file names.
    pub digest: String,
}

/// One of the two files.
struct NetworkFile {
    path: PathBuf,
    model: Model,
}

impl NetworkFile {
    fn open(path: PathBuf) -> Result<(Self, u64)> {
        let bytes = read::bytes(&path)?;
        let digest = digest(&bytes);
        let model = Model::load(bytes).map_err(|error| {
            Error::data(&path, "", format!("is not a usable ONNX network: {error}; export it as the guide says"))
        })?;
        Ok((Self { path, model }, digest))
    }

    fn failed(&self, error: impl std::fmt::Display) -> Error {
        Error::data(&self.path, "", format!("the network failed: {error}"))
    }
}

/// The answer to a prompt: masks as logits on the network's grid, cropped to the photo.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Logits of each mask, positive inside, `[height][width]` of [`Frame::grid`].
    pub masks: Vec<Vec<f32>>,
    /// The network's estimate of each mask's IoU with an object.
    pub scores: Vec<f32>,
}

/// A decoder's precomputed values for a photo.
pub struct PreparedPhoto {
    /// The layout of photo, network and masks.
    pub frame: Frame,
    known: Vec<(NodeId, Value)>,
    rest: Vec<(NodeId, Value)>,
}

impl Network {
    /// Opens the network in a folder and runs it on `threads` threads. The files are `encoder.onnx` and `decoder.onnx`,
    /// or a pair with these endings, or with `sam.onnx` as the decoder.
    pub fn open(folder: &Path, threads: usize) -> Result<Self> {
        let (encoder, decoder) = super::interface::pair_in(folder)?;
        let ((encoder, first), (decoder, second)) = (NetworkFile::open(encoder)?, NetworkFile::open(decoder)?);
        let encoder_ports = EncoderPorts::find(&encoder.model, &encoder.path)?;
        let ports = DecoderPorts::find(&decoder.model, &decoder.path, &encoder_ports)?;
        Ok(Self {
            encoder,
            decoder,
            encoder_ports,
            ports,
            threads: threads.max(1),
            digest: format!("{first:016x}{second:016x}"),
        })
    }

    /// Returns the longest side of a photo in the network, px.
    pub fn side(&self) -> u32 {
        self.encoder_ports.side as u32
    }

    /// Returns the number of threads.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Returns the layout of a photo with the given size.
    pub fn frame(&self, size: (u32, u32)) -> Frame {
        Frame::new(size, self.encoder_ports.side, self.encoder_ports.fit)
    }

    /// Encodes a photo. This takes most of the time; the result is used for all prompts.
    pub fn encode(&self, photo: &Photo) -> Result<Features> {
        let frame = self.frame((photo.width, photo.height));
        let (shape, pixels) = self.input(photo, &frame);
        let input = ValueView::from_shape(&shape, &pixels).map_err(|error| self.encoder.failed(error))?;
        let options = self.options(self.threads);
        let inputs = vec![(self.encoder_ports.input, ValueOrView::View(input))];
        let found = self.encoder.model.run(inputs, &self.encoder_ports.outputs, Some(options));
        let values = found.map_err(|error| self.encoder.failed(error))?;
        let tensors = values.into_iter().map(|value| {
            let tensor =
                value.into_tensor::<f32>().ok_or_else(|| self.encoder.failed("an output is not of type float"))?;
            Ok((tensor_shape(&tensor), tensor.to_vec()))
        });
        let features = Features::new((photo.width, photo.height), tensors.collect::<Result<_>>()?);
        features.finite().then_some(features).ok_or_else(|| self.encoder.failed("its features are not finite"))
    }

    /// Prepares the decoder for prompts on a photo.
    pub fn prepare(&self, features: &Features) -> Result<PreparedPhoto> {
        let frame = self.frame(features.photo);
        let mut given: Vec<(NodeId, Value)> = Vec::new();
        let shaped = |shape: &[usize], data: Vec<f32>| {
            Value::from_shape(shape, data).map_err(|error| self.decoder.failed(error))
        };
        for (&node, (shape, data)) in self.ports.embeddings.iter().zip(features.tensors()) {
            given.push((node, shaped(shape, data)?));
        }
        if let Some(node) = self.ports.mask_input {
            given.push((
                node,
                shaped(&[1, 1, MASK_GRID_SIDE, MASK_GRID_SIDE], vec![0.0; MASK_GRID_SIDE * MASK_GRID_SIDE])?,
            ));
        }
        if let Some(node) = self.ports.has_mask_input {
            given.push((node, shaped(&[1], vec![0.0])?));
        }
        if let Some(node) = self.ports.orig_im_size {
            given.push((node, shaped(&[2], vec![frame.size.1 as f32, frame.size.0 as f32])?));
        }
        let views = given.iter().map(|(node, value)| (*node, ValueOrView::View(value.as_view()))).collect();
        let outputs = [self.ports.masks, self.ports.scores];
        let known = self.decoder.model.partial_run(views, &outputs, Some(self.options(self.threads)));
        let known = known.map_err(|error| self.decoder.failed(error))?;
        // A precomputed value may itself be an input.
        given.retain(|(node, _)| known.iter().all(|(other, _)| other != node));
        Ok(PreparedPhoto { frame, known, rest: given })
    }

    /// Answers a prompt on a single thread.
    pub fn ask(&self, prepared: &PreparedPhoto, prompt: &Prompt) -> Result<Answer> {
        let (coordinates, labels) = prompt.tensors(&prepared.frame);
        let count = labels.len();
        let mut inputs: Vec<(NodeId, ValueOrView)> = Vec::new();
        let views = prepared.rest.iter().chain(&prepared.known);
        inputs.extend(views.map(|(node, value)| (*node, ValueOrView::View(value.as_view()))));
        let failed = |error: String| self.decoder.failed(error);
        let points = ValueView::from_shape([1, count, 2], &coordinates).map_err(|error| failed(error.to_string()))?;
        let kinds = ValueView::from_shape([1, count], &labels).map_err(|error| failed(error.to_string()))?;
        inputs.push((self.ports.point_coords, points.into()));
        inputs.push((self.ports.point_labels, kinds.into()));
        let outputs = [self.ports.masks, self.ports.scores];
        let found = self.decoder.model.run(inputs, &outputs, Some(self.options(1)));
        let mut found = found.map_err(|error| failed(error.to_string()))?.into_iter();
        let mut next = || {
            let tensor = found.next().and_then(Value::into_tensor::<f32>);
            let tensor = tensor.ok_or_else(|| failed("an output is not of type float".to_owned()))?;
            Ok::<_, Error>((tensor_shape(&tensor), tensor.to_vec()))
        };
        let ((shape, logits), (_, scores)) = (next()?, next()?);
        let count = scores.len();
        if count == 0 || shape != [1, count, MASK_GRID_SIDE, MASK_GRID_SIDE] {
            let problem = format!(
                "its masks have the shape {shape:?} and {count} scores; expected [1, {count}, {MASK_GRID_SIDE}, {MASK_GRID_SIDE}]"
            );
            return Err(failed(problem));
        }
        Ok(prompt.choose(&prepared.frame, &logits, &scores))
    }

    fn options(&self, threads: usize) -> RunOptions {
        let mut options = RunOptions::default();
        options.thread_pool = Some(pool(threads));
        options
    }

    /// Returns the shape and values of the encoder's input.
    fn input(&self, photo: &Photo, frame: &Frame) -> (Vec<usize>, Vec<f32>) {
        let resized = frame.resized(photo);
        let (width, height) = resized.dimensions();
        if self.encoder_ports.raw {
            let pixels = resized.pixels().flat_map(|pixel| pixel.0.map(f32::from)).collect();
            return (vec![height as usize, width as usize, 3], pixels);
        }
        let side = frame.side;
        let mut values = vec![0.0; 3 * side * side];
        for (x, y, pixel) in resized.enumerate_pixels() {
            for channel in 0..3 {
                values[(channel * side + y as usize) * side + x as usize] =
                    (f32::from(pixel.0[channel]) - CHANNEL_MEANS[channel]) / CHANNEL_DEVIATIONS[channel];
            }
        }
        (vec![1, 3, side, side], values)
    }
}

fn pool(threads: usize) -> Arc<ThreadPool> {
    Arc::new(ThreadPool::with_num_threads(threads))
}

fn tensor_shape(tensor: &rten_tensor::Tensor<f32>) -> Vec<usize> {
    tensor.shape().to_vec()
}
