//! Inputs and outputs of exported networks, by the names that exporters use.
//!
//! Supported: `export_onnx_model.py` of Segment Anything and MobileSAM; samexporter for SAM, MobileSAM and SAM 2;
//! EdgeSAM's exporter.

use labelgs_files::read;
use labelgs_scene::{Error, Result};
use rten::{Dimension, Model, NodeId};
use std::path::{Path, PathBuf};

/// Default longest side of a photo if the network does not specify one, px.
const DEFAULT_SIDE: usize = 1024;
/// Names of features, in the decoder's order.
const EMBEDDING_NAMES: [&str; 4] = ["image_embeddings", "image_embed", "high_res_feats_0", "high_res_feats_1"];
const MASK_NAMES: [&str; 2] = ["low_res_masks", "masks"];
const SCORE_NAMES: [&str; 2] = ["iou_predictions", "scores"];
/// Intermediate values of decoders exported with a single mask output: all four masks and their scores.
const ALL_MASKS: [(&str, &str); 1] = [("/Reshape_9_output_0", "/iou_prediction_head/layers.2/Gemm_output_0")];

/// How a photo is placed in the network's square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// At the upper left, with its aspect ratio.
    Padded,
    /// Stretched over the whole square (SAM 2).
    Stretched,
}

/// The ports of an encoder.
pub struct EncoderPorts {
    pub input: NodeId,
    pub outputs: Vec<NodeId>,
    /// Names of the outputs.
    names: Vec<String>,
    /// Whether the photo is `[height][width][channel]` from 0 to 255 and the network normalises it.
    pub raw: bool,
    /// Side of the square, px.
    pub side: usize,
    pub fit: Fit,
}

/// The ports of a decoder.
pub struct DecoderPorts {
    /// The inputs for the encoder's outputs, in the same order.
    pub embeddings: Vec<NodeId>,
    pub point_coords: NodeId,
    pub point_labels: NodeId,
    pub mask_input: Option<NodeId>,
    pub has_mask_input: Option<NodeId>,
    pub orig_im_size: Option<NodeId>,
    pub masks: NodeId,
    pub scores: NodeId,
}

/// Returns the two files of a network.
pub fn pair_in(folder: &Path) -> Result<(PathBuf, PathBuf)> {
    let files = read::folder(folder)?;
    let named = |ends: &[&str]| -> Vec<PathBuf> {
        let name = |path: &&PathBuf| path.file_name().and_then(|name| name.to_str()).map(str::to_lowercase);
        files
            .iter()
            .filter(|path| name(path).is_some_and(|name| ends.iter().any(|end| name.ends_with(end))))
            .cloned()
            .collect()
    };
    let (encoders, decoders) = (named(&["encoder.onnx"]), named(&["decoder.onnx", "sam.onnx"]));
    match (encoders.as_slice(), decoders.as_slice()) {
        ([encoder], [decoder]) => Ok((encoder.clone(), decoder.clone())),
        (encoders, decoders) => Err(Error::data(
            folder,
            "",
            format!(
                "has {} files *encoder.onnx and {} files *decoder.onnx or sam.onnx; expected one of each, from \
                 the same network",
                encoders.len(),
                decoders.len()
            ),
        )),
    }
}

/// Returns the named ports among `ids`.
fn names(model: &Model, ids: &[NodeId]) -> Vec<(String, NodeId)> {
    let name = |&id: &NodeId| Some((model.node_info(id)?.name()?.to_owned(), id));
    ids.iter().filter_map(name).collect()
}

fn list(ports: &[(String, NodeId)]) -> String {
    let names: Vec<&str> = ports.iter().map(|(name, _)| name.as_str()).collect();
    names.join(", ")
}

fn sides(model: &Model, id: NodeId) -> Vec<Option<usize>> {
    let fixed = |side: &Dimension| if let Dimension::Fixed(side) = side { Some(*side) } else { None };
    model.node_info(id).and_then(|info| info.shape()).unwrap_or_default().iter().map(fixed).collect()
}

impl EncoderPorts {
    pub fn find(model: &Model, path: &Path) -> Result<Self> {
        let refuse = |problem: String| Error::data(path, "", problem);
        let &[input] = model.input_ids() else {
            let found = list(&names(model, model.input_ids()));
            return Err(refuse(format!("has the inputs {found}; expected an encoder, with one photo as its input")));
        };
        let outputs = names(model, model.output_ids());
        let found: Vec<&(String, NodeId)> =
            EMBEDDING_NAMES.iter().filter_map(|known| outputs.iter().find(|(name, _)| name == known)).collect();
        // A single output is the feature, whatever its name.
        let chosen = if found.is_empty() && outputs.len() == 1 { vec![&outputs[0]] } else { found };
        if chosen.is_empty() {
            return Err(refuse(format!(
                "has the outputs {}; expected one of {}",
                list(&outputs),
                EMBEDDING_NAMES.join(", ")
            )));
        }
        let shape = sides(model, input);
        let raw = shape.len() == 3;
        if !raw && shape.len() != 4 {
            return Err(refuse(format!("takes a photo of {} axes; expected [1, 3, side, side]", shape.len())));
        }
        let side = if raw { None } else { shape[3].or(shape[2]) };
        let fit = if chosen.len() > 1 { Fit::Stretched } else { Fit::Padded };
        Ok(Self {
            input,
            outputs: chosen.iter().map(|(_, id)| *id).collect(),
            names: chosen.iter().map(|(name, _)| name.clone()).collect(),
            raw,
            side: side.unwrap_or(DEFAULT_SIDE),
            fit,
        })
    }
}

impl DecoderPorts {
    pub fn find(model: &Model, path: &Path, encoder: &EncoderPorts) -> Result<Self> {
        let (inputs, outputs) = (names(model, model.input_ids()), names(model, model.output_ids()));
        let port = |ports: &[(String, NodeId)], wanted: &[&str]| {
            wanted.iter().find_map(|wanted| ports.iter().find(|(name, _)| name == wanted)).map(|(_, id)| *id)
        };
        let need = |what: &str, ports: &[(String, NodeId)], wanted: &[&str]| {
            let problem = || format!("has the {what} {}; expected {}", list(ports), wanted.join(" or "));
            port(ports, wanted).ok_or_else(|| Error::data(path, "", problem()))
        };
        let embeddings = match encoder.names.as_slice() {
            [one] => vec![need("inputs", &inputs, &[one, EMBEDDING_NAMES[0], EMBEDDING_NAMES[1]])?],
            several => several.iter().map(|name| need("inputs", &inputs, &[name])).collect::<Result<_>>()?,
        };
        let inner = ALL_MASKS.iter().find_map(|(masks, scores)| {
            let (masks, scores) = (model.find_node(masks)?, model.find_node(scores)?);
            Some((masks, scores))
        });
        let masks = need("outputs", &outputs, &MASK_NAMES)?;
        let scores = need("outputs", &outputs, &SCORE_NAMES)?;
        let single = sides(model, masks).get(1) == Some(&Some(1));
        let (masks, scores) = inner.filter(|_| single).unwrap_or((masks, scores));
        let ports = Self {
            embeddings,
            point_coords: need("inputs", &inputs, &["point_coords"])?,
            point_labels: need("inputs", &inputs, &["point_labels"])?,
            mask_input: port(&inputs, &["mask_input"]),
            has_mask_input: port(&inputs, &["has_mask_input"]),
            orig_im_size: port(&inputs, &["orig_im_size"]),
            masks,
            scores,
        };
        let known = ports.embeddings.iter().copied().chain([ports.point_coords, ports.point_labels]);
        let known: Vec<NodeId> =
            known.chain([ports.mask_input, ports.has_mask_input, ports.orig_im_size].into_iter().flatten()).collect();
        let unknown: Vec<(String, NodeId)> = inputs.iter().filter(|(_, id)| !known.contains(id)).cloned().collect();
        if !unknown.is_empty() {
            let problem = format!("has unknown inputs: {}; all its inputs are {}", list(&unknown), list(&inputs));
            return Err(Error::data(path, "", problem));
        }
        Ok(ports)
    }
}
