//! The records of labels and of the initial view in an SPZ.
//!
//! Labels: version, count, bytes per id, whether confidences follow, the packed ids and confidences in the order of the
//! Gaussians, then the names as JSON. Initial view: up direction and eye position in the world of labelgs, as 64-bit
//! floats.

use super::axes::FileAxes;
use crate::format::{Export, FirstView, LabelType};
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use glam::DVec3;
use labelgs_files::label_table::LabelTable;
use labelgs_scene::{Error, MODEL_LABEL_MAX, Result};
use std::io::{self, Read, Write};
use std::path::Path;

/// Type of the labels record: the vendor `LG` in the upper half.
const LABELS_RECORD: u32 = 0x4C47_0001;
/// Type of the record of the initial view.
const VIEW_RECORD: u32 = 0x4C47_0002;
/// Type of the record of the file's axes.
const AXES_RECORD: u32 = 0xADBE_0003;
/// Type of the record with limits for a viewer's camera.
const ORBIT_RECORD: u32 = 0xADBE_0002;
const VERSION: u32 = 1;
/// Bytes before the packed ids.
const LABELS_HEAD_BYTES: usize = 16;

/// The content of a file's records.
#[derive(Debug, Default)]
pub(super) struct Records {
    pub(super) labels: Option<Vec<u32>>,
    pub(super) confidence: Option<Vec<f32>>,
    pub(super) names: Option<LabelTable>,
    pub(super) first_view: Option<FirstView>,
    pub(super) axes: FileAxes,
    pub(super) notes: Vec<String>,
}

/// Returns the records of an export: labels and initial view, if it has them.
pub(super) fn write(export: &Export) -> io::Result<Vec<u8>> {
    let mut records = Vec::new();
    let mut add = |kind: u32, payload: Vec<u8>| {
        records.extend(kind.to_le_bytes());
        records.extend((payload.len() as u32).to_le_bytes());
        records.extend(payload);
    };
    if let Some(labels) = export.labels() {
        add(LABELS_RECORD, payload(export, labels)?);
    }
    // Without labels, write no records at all, because some readers warn about them.
    if let Some(FirstView { up, eye }) =
        export.options.first_view.filter(|_| export.options.label_type != LabelType::None)
    {
        add(VIEW_RECORD, [up, eye].iter().flat_map(DVec3::to_array).flat_map(f64::to_le_bytes).collect());
    }
    Ok(records)
}

/// Returns the content of the labels record.
fn payload(export: &Export, labels: &[u32]) -> io::Result<Vec<u8>> {
    let ids = || export.rows.iter().map(|&row| labels[row]);
    let width: u8 = match ids().max().unwrap_or_default() {
        0..=0xff => 1,
        0x100..=0xffff => 2,
        _ => 4,
    };
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::best());
    for id in ids() {
        packer.write_all(&id.to_le_bytes()[..usize::from(width)])?;
    }
    if let Some(shares) = export.label_confidence() {
        let bytes: Vec<u8> = export.rows.iter().map(|&row| (shares[row] * 255.0).round() as u8).collect();
        packer.write_all(&bytes)?;
    }
    let packed = packer.finish()?;
    let mut payload = VERSION.to_le_bytes().to_vec();
    payload.extend((export.rows.len() as u32).to_le_bytes());
    payload.extend([width, u8::from(export.label_confidence().is_some()), 0, 0]);
    payload.extend((packed.len() as u32).to_le_bytes());
    payload.extend(packed);
    if let Some(names) = export.names {
        serde_json::to_writer(&mut payload, names)?;
    }
    Ok(payload)
}

/// Reads the records of a file of `count` Gaussians. Unknown ones get a note.
pub(super) fn read(path: &Path, mut bytes: &[u8], count: usize) -> Result<Records> {
    let mut records = Records::default();
    while let Some((head, rest)) = bytes.split_first_chunk::<8>() {
        let [a, b, c, d, e, f, g, h] = *head;
        let (kind, length) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]) as usize);
        let Some((payload, rest)) = rest.split_at_checked(length) else {
            let problem = format!("promises {length} bytes; only {} are left; the file was cut short", rest.len());
            return Err(Error::data(path, format!("record {kind:#010x}"), problem));
        };
        match kind {
            LABELS_RECORD => labels(path, payload, count, &mut records)?,
            AXES_RECORD => match payload.try_into().ok().map(u32::from_le_bytes).and_then(FileAxes::from_record) {
                Some(axes) => records.axes = axes,
                None => records.notes.push(
                    "its axes record is unknown, so its axes were read as right, up, back; turn the model if \
                     it lies wrong"
                        .into(),
                ),
            },
            VIEW_RECORD => records.first_view = first_view(payload),
            ORBIT_RECORD => {}
            _ => records.notes.push(format!("its record {kind:#010x} is unknown and was not read")),
        }
        bytes = rest;
    }
    Ok(records)
}

/// Decodes the initial view, or returns `None` if the record is damaged.
fn first_view(payload: &[u8]) -> Option<FirstView> {
    let numbers: Vec<f64> = payload.as_chunks().0.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect();
    let [a, b, c, d, e, f] = numbers.try_into().ok()?;
    FirstView::checked(DVec3::new(a, b, c), DVec3::new(d, e, f))
}

fn labels(path: &Path, payload: &[u8], count: usize, to: &mut Records) -> Result<()> {
    let bad = |problem: String| {
        let cure = "write the file again, or without labels";
        Error::data(path, "labels record", format!("{problem}; {cure}"))
    };
    let head: &[u8; LABELS_HEAD_BYTES] = payload
        .first_chunk()
        .ok_or_else(|| bad(format!("has {} bytes; expected {LABELS_HEAD_BYTES} or more", payload.len())))?;
    let number = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    let (version, own, width, confident, length) = (number(0), number(4), head[8], head[9], number(12) as usize);
    if version != VERSION || !matches!(width, 1 | 2 | 4) || confident > 1 {
        let problem =
            format!("has version {version}, {width} bytes per id, {confident}; expected {VERSION}, 1 or 2, 0 or 1");
        return Err(bad(problem));
    }
    if own as usize != count {
        return Err(bad(format!("has labels of {own} Gaussians; the file has {count}")));
    }
    let (packed, names) = payload[LABELS_HEAD_BYTES..].split_at_checked(length).ok_or_else(|| {
        bad(format!("promises {length} packed bytes; only {} are left", payload.len() - LABELS_HEAD_BYTES))
    })?;
    let expected = count * (usize::from(width) + usize::from(confident));
    let mut plain = Vec::new();
    let unpacked = ZlibDecoder::new(packed).take(expected as u64 + 1).read_to_end(&mut plain);
    unpacked.map_err(|error| bad(format!("cannot be unpacked: {error}")))?;
    if plain.len() != expected {
        return Err(bad(format!("does not unpack to {expected} bytes of ids")));
    }
    let (ids, shares) = plain.split_at(count * usize::from(width));
    let id = |bytes: &[u8]| bytes.iter().rev().fold(0, |id, &byte| id << 8 | u32::from(byte));
    let ids: Vec<u32> = ids.chunks_exact(usize::from(width)).map(id).collect();
    if let Some(id) = ids.iter().find(|&&id| id > MODEL_LABEL_MAX) {
        return Err(bad(format!("has the label {id}; labels are from 0 to {MODEL_LABEL_MAX}")));
    }
    to.labels = Some(ids);
    to.confidence = (confident == 1).then(|| shares.iter().map(|&share| f32::from(share) / 255.0).collect());
    if !names.is_empty() {
        to.names = Some(LabelTable::parse(path, names)?);
    }
    Ok(())
}
