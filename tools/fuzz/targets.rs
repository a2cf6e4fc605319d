//! The fuzzed readers of user files, as a table of names and functions. The fuzzer and the tests share it.
//!
//! Each target is a folder in which one file changes. The bytes are written to that file and read as the program reads
//! them. The reader must accept them with a consistent result, or refuse them with an error that names a file and is
//! not `Error::Bug`.

use super::readers::*;
use super::seeds;
use labelgs::gpu::PipelineStore;
use labelgs::masks::Format;
use labelgs::records::PipelineFolder;
use labelgs::records::checkpoint::VERSION;
use labelgs::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A reader.
pub struct Target {
    /// Name.
    pub name: &'static str,
    /// The file, below the folder, that receives the bytes.
    file: &'static str,
    /// Writes the other files of the folder.
    prepare: fn(&Path),
    /// Reads the file in the folder and checks the result.
    read: fn(&Path, &Path) -> Result<()>,
    /// Small valid files.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Adds a correct checksum to the bytes, for formats in which a checksum would reject every change.
    dress: fn(&[u8]) -> Vec<u8>,
    /// Bytes of memory that the reader may use per byte of the file.
    per_byte: usize,
}

const PLAIN_TARGET: Target = Target {
    name: "",
    file: "",
    prepare: |_| (),
    read: |_, _| Ok(()),
    seeds: Vec::new,
    dress: <[u8]>::to_vec,
    per_byte: 64,
};

/// Files of compressed pixels: a byte may encode 8192 samples, held as floats and once more during decoding.
const PIXEL_TARGET: Target = Target { per_byte: 8192 * 4 * 2, ..PLAIN_TARGET };

/// All readers.
pub const ALL_TARGETS: [Target; 45] = [
    Target {
        name: "colmap_cameras_bin",
        file: "sparse/0/cameras.bin",
        prepare: colmap_bin,
        read: scene,
        seeds: seeds::colmap_cameras_bin,
        ..PLAIN_TARGET
    },
    Target {
        name: "colmap_images_bin",
        file: "sparse/0/images.bin",
        prepare: colmap_bin,
        read: scene,
        seeds: || vec![seeds::colmap_images_bin()],
        ..PLAIN_TARGET
    },
    Target {
        name: "colmap_points_bin",
        file: "sparse/0/points3D.bin",
        prepare: colmap_bin,
        read: scene,
        seeds: || vec![seeds::colmap_points_bin()],
        ..PLAIN_TARGET
    },
    Target {
        name: "colmap_cameras_txt",
        file: "sparse/0/cameras.txt",
        prepare: colmap_txt,
        read: scene,
        seeds: seeds::colmap_cameras_txt,
        ..PLAIN_TARGET
    },
    Target {
        name: "colmap_images_txt",
        file: "sparse/0/images.txt",
        prepare: colmap_txt,
        read: scene,
        seeds: || vec![seeds::colmap_images_txt()],
        ..PLAIN_TARGET
    },
    Target {
        name: "colmap_points_txt",
        file: "sparse/0/points3D.txt",
        prepare: colmap_txt,
        read: scene,
        seeds: || vec![seeds::colmap_points_txt()],
        ..PLAIN_TARGET
    },
    Target {
        name: "transforms_json",
        file: "transforms.json",
        prepare: transforms,
        read: scene,
        seeds: seeds::transforms_json,
        ..PLAIN_TARGET
    },
    Target {
        name: "poses_npy",
        file: "poses_bounds.npy",
        prepare: transforms,
        read: scene,
        seeds: || vec![seeds::poses_npy()],
        ..PLAIN_TARGET
    },
    // A tree node takes a hundred bytes and needs only three bytes of the file.
    Target {
        name: "metashape_xml",
        file: "cameras.xml",
        prepare: transforms,
        read: scene,
        seeds: seeds::metashape_xml,
        per_byte: 256,
        ..PLAIN_TARGET
    },
    Target { name: "ply_model", file: "model.ply", read: model, seeds: seeds::ply_model, ..PLAIN_TARGET },
    Target {
        name: "ply_packed",
        file: "model.ply",
        read: model,
        seeds: || vec![seeds::golden("splat-transform.compressed.ply")],
        ..PLAIN_TARGET
    },
    Target {
        name: "spz_stream",
        file: "model.spz",
        read: model,
        seeds: || vec![seeds::spz_stream()],
        dress: gzipped,
        ..PIXEL_TARGET
    },
    Target { name: "spz_gzip", file: "model.spz", read: model, seeds: seeds::spz_gzip, ..PIXEL_TARGET },
    Target { name: "spz_framed", file: "model.spz", read: model, seeds: seeds::spz_framed, ..PIXEL_TARGET },
    Target { name: "glb", file: "model.glb", read: model, seeds: seeds::glb, ..PLAIN_TARGET },
    Target {
        name: "splat",
        file: "model.splat",
        read: model,
        seeds: || vec![seeds::golden("source.splat")],
        ..PLAIN_TARGET
    },
    Target { name: "usd_text", file: "model.usda", read: model, seeds: seeds::usd_text, ..PLAIN_TARGET },
    Target { name: "usd_package", file: "model.usdz", read: model, seeds: seeds::usd_package, ..PLAIN_TARGET },
    Target { name: "sog", file: "model.sog", read: model, seeds: seeds::sog, ..PIXEL_TARGET },
    Target {
        name: "sog_meta",
        file: "model.sog",
        read: model,
        seeds: || vec![seeds::sog_meta()],
        dress: sog_of_meta,
        ..PIXEL_TARGET
    },
    Target { name: "ply_cloud", file: "cloud.ply", read: ply_cloud, seeds: seeds::ply_cloud, ..PLAIN_TARGET },
    Target { name: "mask", file: "mask.png", read: id_mask, seeds: seeds::mask, dress: png_sums, ..PIXEL_TARGET },
    Target {
        name: "mask_rgb",
        file: "in/00.png",
        prepare: masks,
        read: mask_rgb,
        seeds: seeds::mask_rgb,
        dress: png_sums,
        ..PIXEL_TARGET
    },
    Target {
        name: "mask_binary",
        file: "in/cup/00.png",
        prepare: colmap_bin,
        read: |folder, _| imported(folder, Format::BinaryFolders),
        seeds: seeds::mask_binary,
        dress: png_sums,
        ..PIXEL_TARGET
    },
    Target {
        name: "mask_auto",
        file: "in/00.png",
        prepare: colmap_bin,
        read: |folder, _| imported(folder, Format::Auto),
        seeds: seeds::mask,
        dress: png_sums,
        ..PIXEL_TARGET
    },
    Target {
        name: "mask_coco",
        file: "in/a.json",
        prepare: colmap_bin,
        read: |folder, _| imported(folder, Format::Coco),
        seeds: seeds::coco,
        ..PLAIN_TARGET
    },
    Target {
        name: "mask_sam",
        file: "in/00.json",
        prepare: colmap_bin,
        read: |folder, _| imported(folder, Format::SamJson),
        seeds: || vec![seeds::golden_mask("sam/00.json")],
        ..PLAIN_TARGET
    },
    Target {
        name: "mask_sam_table",
        file: "in/00/metadata.csv",
        prepare: sam_pictures,
        read: |folder, _| imported(folder, Format::SamFolders),
        seeds: || vec![seeds::golden_mask("sam/00.csv")],
        ..PLAIN_TARGET
    },
    Target {
        name: "pred_json",
        file: "in/pred.json",
        prepare: pred_masks,
        read: mask_rgb,
        seeds: || vec![seeds::pred_json()],
        ..PIXEL_TARGET
    },
    Target {
        name: "depth_png",
        file: "depths/00.png",
        prepare: colmap_bin,
        read: depth,
        seeds: seeds::depth_png,
        dress: png_sums,
        ..PIXEL_TARGET
    },
    Target {
        name: "depth_exr",
        file: "depths/00.exr",
        prepare: colmap_bin,
        read: depth,
        seeds: seeds::depth_exr,
        ..PIXEL_TARGET
    },
    Target {
        name: "depth_npy",
        file: "depths/00.npy",
        prepare: colmap_bin,
        read: depth,
        seeds: seeds::depth_npy,
        ..PLAIN_TARGET
    },
    Target {
        name: "depth_pfm",
        file: "depths/00.pfm",
        prepare: colmap_bin,
        read: depth,
        seeds: seeds::depth_pfm,
        ..PLAIN_TARGET
    },
    Target {
        name: "photo_png",
        file: "photo.png",
        read: photo,
        seeds: seeds::photo_png,
        dress: png_sums,
        ..PIXEL_TARGET
    },
    Target { name: "photo_jpeg", file: "photo.jpg", read: photo, seeds: seeds::photo_jpeg, ..PIXEL_TARGET },
    Target {
        name: "checkpoint",
        file: "a.ckpt",
        read: checkpoint,
        seeds: || vec![dressed(&seeds::checkpoint())],
        ..PLAIN_TARGET
    },
    Target {
        name: "checkpoint_body",
        file: "a.ckpt",
        read: checkpoint,
        seeds: || vec![seeds::checkpoint()],
        dress: dressed,
        ..PLAIN_TARGET
    },
    Target { name: "config_toml", file: "config.toml", read: config, seeds: seeds::config_toml, ..PLAIN_TARGET },
    Target {
        name: "camera_json",
        file: "camera.json",
        read: camera,
        seeds: || vec![seeds::camera_json()],
        ..PLAIN_TARGET
    },
    Target {
        name: "labels_json",
        file: "labels.json",
        read: labels,
        seeds: || vec![seeds::labels_json()],
        ..PLAIN_TARGET
    },
    Target {
        name: "occlusion_json",
        file: "occlusion.json",
        read: occlusion,
        seeds: || vec![seeds::occlusion_json()],
        ..PLAIN_TARGET
    },
    Target {
        name: "frames_json",
        file: "frames.json",
        read: frames,
        seeds: || vec![seeds::frames_json()],
        ..PLAIN_TARGET
    },
    Target {
        name: "profile_json",
        file: "profile.json",
        read: profile,
        seeds: || vec![seeds::profile_json()],
        ..PLAIN_TARGET
    },
    Target {
        name: "lpips_weights",
        file: "lpips.safetensors",
        read: weights,
        seeds: || vec![seeds::lpips_weights()],
        ..PLAIN_TARGET
    },
    Target {
        name: "pipelines",
        file: "pipelines-x.bin",
        read: |folder, _| {
            PipelineFolder::new(folder).load("x");
            Ok(())
        },
        seeds: || vec![seeds::pipelines()],
        ..PLAIN_TARGET
    },
];

/// Returns the reader with a name.
pub fn find(name: &str) -> Option<&'static Target> {
    const ALL: &[Target] = &ALL_TARGETS;
    ALL.iter().find(|target| target.name == name)
}

/// All names, for messages.
#[allow(dead_code, reason = "the tests walk the table instead")]
pub fn names() -> String {
    ALL_TARGETS.map(|target| target.name).join(" ")
}

/// A target with its folder.
pub struct TargetFolder {
    target: &'static Target,
    folder: TempDir,
    file: PathBuf,
}

impl TargetFolder {
    /// Creates the folder, in memory if the system allows it.
    pub fn new(target: &'static Target) -> Self {
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
        let folder = folder.expect("a temporary folder");
        (target.prepare)(folder.path());
        let file = folder.path().join(target.file);
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
        Self { target, folder, file }
    }

    /// Returns the bytes of memory that the reader may use for a file of `length` bytes; the constant part covers
    /// decoders and the rest of a scene.
    pub fn memory_bound(&self, length: usize) -> usize {
        (64 << 20) + self.target.per_byte * length
    }

    /// Writes the bytes to their file.
    pub fn put(&self, bytes: &[u8]) {
        std::fs::write(&self.file, (self.target.dress)(bytes)).expect("a file");
    }

    /// Reads the file.
    pub fn read(&self) -> Result<()> {
        (self.target.read)(self.folder.path(), &self.file)
    }

    /// Writes and reads the bytes, and panics on an answer that no user should get. Returns whether the bytes were
    /// accepted.
    pub fn check(&self, bytes: &[u8]) -> bool {
        self.put(bytes);
        self.judge(self.read())
    }

    /// The verdict of [`TargetFolder::check`] on an answer.
    pub fn judge(&self, answer: Result<()>) -> bool {
        let Err(error) = answer else { return true };
        let text = error.to_string();
        let named = match &error {
            Error::Data { path, problem, .. } => path.starts_with(self.folder.path()) && problem.len() > 5,
            Error::Read { path, .. } => path.starts_with(self.folder.path()),
            Error::Usage { argument, problem } => !argument.is_empty() && problem.len() > 5,
            _ => false,
        };
        assert!(named, "{}: the answer is `{text}` ({error:?})", self.target.name);
        false
    }
}

/// A checkpoint file with this body and a correct checksum.
fn dressed(body: &[u8]) -> Vec<u8> {
    let mut bytes = b"labelgsC".to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(crc32fast::hash(body).to_le_bytes());
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(body);
    bytes
}

/// A gzip stream with these bytes and a correct checksum.
fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packer.write_all(bytes).expect("packed");
    packer.finish().expect("packed")
}

/// A SOG of another program with this `meta.json`.
fn sog_of_meta(bytes: &[u8]) -> Vec<u8> {
    let own = seeds::golden("splat-transform.sog");
    let mut from = zip::ZipArchive::new(std::io::Cursor::new(own)).expect("an archive");
    let mut to = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for index in 0..from.len() {
        let mut entry = from.by_index(index).expect("an entry");
        to.start_file(entry.name(), stored).expect("a file");
        if entry.name() == "meta.json" {
            to.write_all(bytes).expect("written");
        } else {
            std::io::copy(&mut entry, &mut to).expect("copied");
        }
    }
    to.finish().expect("an archive").into_inner()
}

/// Recomputes the checksums of a PNG's chunks; returns anything else unchanged.
fn png_sums(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if !bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        return bytes;
    }
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 8) {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let end = at.saturating_add(8).saturating_add(length);
        if end.saturating_add(4) > bytes.len() {
            break;
        }
        let sum = crc32fast::hash(&bytes[at + 4..end]);
        bytes[end..end + 4].copy_from_slice(&sum.to_be_bytes());
        at = end + 4;
    }
    bytes
}
