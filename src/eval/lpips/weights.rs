//! The weights of LPIPS in a safetensors file.
//!
//! The file joins two published state dictionaries, names unchanged, as 32-bit floats. From torchvision's VGG16 come
//! `features.N.weight` `[outputs, inputs, 3, 3]` and `features.N.bias` `[outputs]` for N of 0, 2, 5, 7, 10, 12, 14, 17,
//! 19, 21, 24, 26, 28. From LPIPS v0.1 comes `linK.model.1.weight` `[1, channels, 1, 1]` for K of 0 to 4 with 64, 128,
//! 256, 512, 512 channels. Other tensors are ignored.

use super::convolution::Layer;
use super::{STAGE_CHANNELS, STAGE_CONVOLUTIONS};
use crate::error::{Error, Result};
use crate::files::read;
use safetensors::{Dtype, SafeTensors};
use std::collections::BTreeMap;
use std::path::Path;

/// The convolutions of VGG16 and the weights of the features.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    layers: BTreeMap<usize, Layer>,
    linear: Vec<Vec<f32>>,
}

impl Weights {
    /// Reads the file. Every tensor must exist with its shape.
    pub fn read(path: &Path) -> Result<Self> {
        let numbers: Vec<(usize, usize)> = STAGE_CONVOLUTIONS
            .iter()
            .zip(STAGE_CHANNELS)
            .flat_map(|(stage, outputs)| stage.iter().map(move |&n| (n, outputs)))
            .collect();
        let mut wanted = Vec::new();
        let mut inputs = 3;
        for &(number, outputs) in &numbers {
            wanted.push((format!("features.{number}.weight"), vec![outputs, inputs, 3, 3]));
            wanted.push((format!("features.{number}.bias"), vec![outputs]));
            inputs = outputs;
        }
        let linear = STAGE_CHANNELS.iter().enumerate();
        wanted.extend(linear.map(|(index, &count)| (format!("lin{index}.model.1.weight"), vec![1, count, 1, 1])));

        let mut read = read_tensors(path, &wanted)?.into_iter();
        let mut next = || read.next().unwrap_or_default();
        let layers = numbers.iter().map(|&(number, _)| (number, Layer { weight: next(), bias: next() })).collect();
        Ok(Self { layers, linear: read.collect() })
    }

    pub(super) fn layer(&self, number: usize) -> Result<&Layer> {
        self.layers.get(&number).ok_or_else(|| Error::Bug(format!("VGG16 has no convolution {number}")))
    }

    pub(super) fn linear(&self, stage: usize) -> &[f32] {
        &self.linear[stage]
    }
}

/// Reads tensors by name and shape from a safetensors file; all must be finite 32-bit floats.
pub fn read_tensors(path: &Path, wanted: &[(String, Vec<usize>)]) -> Result<Vec<Vec<f32>>> {
    let bytes = read::bytes(path)?;
    let file = SafeTensors::deserialize(&bytes)
        .map_err(|error| Error::data(path, "", format!("is not a readable safetensors file: {error}")))?;
    wanted.iter().map(|(name, shape)| floats(path, &file, name, shape)).collect()
}

fn floats(path: &Path, file: &SafeTensors, name: &str, shape: &[usize]) -> Result<Vec<f32>> {
    let cure = "expected torchvision's VGG16 `features` and the `lin` layers of LPIPS v0.1 in one file, 32-bit floats";
    let view = file.tensor(name).map_err(|_| Error::data(path, name, format!("is missing; {cure}")))?;
    if view.dtype() != Dtype::F32 || view.shape() != shape {
        let problem = format!("is {:?} {:?} instead of F32 {shape:?}; {cure}", view.dtype(), view.shape());
        return Err(Error::data(path, name, problem));
    }
    let values: Vec<f32> =
        view.data().chunks_exact(4).map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]])).collect();
    if values.iter().all(|value| value.is_finite()) {
        return Ok(values);
    }
    Err(Error::data(path, name, "has a value that is not finite"))
}
