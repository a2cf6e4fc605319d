//! A promptable network of 2 kB: the mask is everything with the colour of the first prompt point, or of a box's
//! centre, within a threshold.

use std::path::Path;

/// Squared colour distance, in standard deviations, below which a pixel belongs to the object.
const COLOUR_DISTANCE_MAX: f32 = 0.1;
/// ONNX type codes.
const FLOAT_TYPE: u64 = 1;
const INT64_TYPE: u64 = 7;

fn varint(mut value: u64, out: &mut Vec<u8>) {
    while value > 127 {
        out.push(value as u8 | 128);
        value >>= 7;
    }
    out.push(value as u8);
}

fn number(field: u64, value: u64) -> Vec<u8> {
    let mut out = Vec::new();
    varint(field << 3, &mut out);
    varint(value, &mut out);
    out
}

fn bytes(field: u64, value: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    varint(field << 3 | 2, &mut out);
    varint(value.len() as u64, &mut out);
    out.extend(value);
    out
}

fn text(field: u64, value: &str) -> Vec<u8> {
    bytes(field, value.as_bytes())
}

fn ints(name: &str, values: &[u64]) -> Vec<u8> {
    let list: Vec<Vec<u8>> = values.iter().map(|&value| number(8, value)).collect();
    bytes(5, &[text(1, name), list.concat(), number(20, 7)].concat())
}

fn int(name: &str, value: u64) -> Vec<u8> {
    bytes(5, &[text(1, name), number(3, value), number(20, 2)].concat())
}

fn word(name: &str, value: &str) -> Vec<u8> {
    bytes(5, &[text(1, name), text(4, value), number(20, 3)].concat())
}

fn node(kind: &str, inputs: &[&str], output: &str, attributes: &[Vec<u8>]) -> Vec<u8> {
    let inputs: Vec<Vec<u8>> = inputs.iter().map(|name| text(1, name)).collect();
    bytes(1, &[inputs.concat(), text(2, output), text(4, kind), attributes.concat()].concat())
}

fn tensor(name: &str, shape: &[u64], kind: u64, data: &[u8]) -> Vec<u8> {
    let shape: Vec<Vec<u8>> = shape.iter().map(|&side| number(1, side)).collect();
    bytes(5, &[shape.concat(), number(2, kind), text(8, name), bytes(9, data)].concat())
}

fn floats(name: &str, shape: &[u64], values: &[f32]) -> Vec<u8> {
    tensor(name, shape, FLOAT_TYPE, &values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>())
}

fn longs(name: &str, values: &[i64]) -> Vec<u8> {
    let data: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    tensor(name, &[values.len() as u64], INT64_TYPE, &data)
}

/// An input (field 11) or output (12); a side of 0 is only known at run time.
fn port(field: u64, name: &str, shape: &[u64]) -> Vec<u8> {
    let side = |&side: &u64| bytes(1, &if side > 0 { number(1, side) } else { text(2, "n") });
    let shape: Vec<Vec<u8>> = shape.iter().map(side).collect();
    let of_tensor = [number(1, FLOAT_TYPE), bytes(2, &shape.concat())].concat();
    bytes(field, &[text(1, name), bytes(2, &bytes(1, &of_tensor))].concat())
}

fn model(graph: &[Vec<u8>]) -> Vec<u8> {
    let graph = [graph.concat(), text(2, "tiny")].concat();
    [number(1, 8), bytes(8, &number(2, 13)), bytes(7, &graph)].concat()
}

/// Returns an encoder: mean colours of 16 x 16 px.
pub fn encoder() -> Vec<u8> {
    model(&[
        node(
            "AveragePool",
            &["image"],
            "image_embeddings",
            &[ints("kernel_shape", &[16, 16]), ints("strides", &[16, 16])],
        ),
        port(11, "image", &[1, 3, 1024, 1024]),
        port(12, "image_embeddings", &[1, 3, 64, 64]),
    ])
}

/// Returns a decoder, with the name of its second input as given.
pub fn decoder(points: &str) -> Vec<u8> {
    model(&[
        longs("first", &[0]),
        longs("second", &[1]),
        longs("third", &[2]),
        longs("axis", &[1]),
        longs("yx", &[1, 0]),
        longs("pair", &[1, 2]),
        longs("colour", &[1, 3, 1, 1]),
        longs("grid", &[64, 64, 3]),
        floats("cell", &[1], &[16.0]),
        floats("least", &[1], &[0.0]),
        floats("most", &[1], &[63.0]),
        floats("threshold", &[1], &[COLOUR_DISTANCE_MAX]),
        floats("sharp", &[1], &[100.0]),
        floats("scales", &[4], &[1.0, 1.0, 4.0, 4.0]),
        floats("one", &[1], &[1.0]),
        floats("half", &[1], &[0.5]),
        floats("score", &[1, 1], &[0.95]),
        // If a box comes first, its second corner is next: a label of 2 becomes 1, all others 0.
        node("Slice", &[points, "first", "second", "axis"], "asked", &[]),
        node("Slice", &[points, "second", "third", "axis"], "next", &[]),
        node("Slice", &["point_labels", "first", "second", "axis"], "kind", &[]),
        node("Sub", &["kind", "one"], "lower", &[]),
        node("Max", &["lower", "least"], "is_corner", &[]),
        node("Sub", &["next", "asked"], "across", &[]),
        node("Mul", &["across", "half"], "halfway", &[]),
        node("Mul", &["halfway", "is_corner"], "shift", &[]),
        node("Add", &["asked", "shift"], "point", &[]),
        node("Div", &["point", "cell"], "cells", &[]),
        node("Max", &["cells", "least"], "above", &[]),
        node("Min", &["above", "most"], "within", &[]),
        node("Cast", &["within"], "whole", &[int("to", INT64_TYPE)]),
        node("Reshape", &["whole", "pair"], "xy", &[]),
        node("Gather", &["xy", "yx"], "place", &[int("axis", 1)]),
        node("Transpose", &["image_embeddings"], "last", &[ints("perm", &[0, 2, 3, 1])]),
        node("Reshape", &["last", "grid"], "map", &[]),
        node("GatherND", &["map", "place"], "found", &[]),
        node("Reshape", &["found", "colour"], "wanted", &[]),
        node("Sub", &["image_embeddings", "wanted"], "difference", &[]),
        node("Mul", &["difference", "difference"], "squares", &[]),
        node("ReduceSum", &["squares", "axis"], "distance", &[]),
        node("Sub", &["threshold", "distance"], "rough", &[]),
        node("Mul", &["rough", "sharp"], "logits", &[]),
        node("Resize", &["logits", "", "scales"], "low_res_masks", &[word("mode", "linear")]),
        node("Identity", &["score"], "iou_predictions", &[]),
        port(11, "image_embeddings", &[1, 3, 64, 64]),
        port(11, points, &[1, 0, 2]),
        port(11, "point_labels", &[1, 0]),
        port(12, "low_res_masks", &[1, 1, 256, 256]),
        port(12, "iou_predictions", &[1, 1]),
    ])
}

/// Writes the network to a folder.
#[expect(clippy::disallowed_methods, reason = "a test makes its input")]
pub fn write(folder: &Path) {
    std::fs::create_dir_all(folder).expect("folder");
    std::fs::write(folder.join("encoder.onnx"), encoder()).expect("encoder");
    std::fs::write(folder.join("decoder.onnx"), decoder("point_coords")).expect("decoder");
}
