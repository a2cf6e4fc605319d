//! Identifies a file by its first bytes, for messages about files whose content does not match their name.

use super::read;
use labelgs_scene::{Error, Result};
use std::io::Read;
use std::path::Path;

/// Number of bytes read to identify a file.
const FIRST_BYTES: u64 = 512;

/// The content of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Content {
    /// With its article, as in "a Git LFS pointer".
    pub what: &'static str,
    /// How to get a photo or a model from the file. Empty if the file is a photo or a model itself.
    pub cure: &'static str,
}

const NO_CURE: &str = "";
const CONVERT_CURE: &str = "convert it to JPEG or PNG";
const FRAMES_CURE: &str = "extract its frames as photos first, as with ffmpeg";
const UNPACK_CURE: &str = "unpack it first";
const COPY_CURE: &str = "copy or download it again";
const DOWNLOAD_CURE: &str =
    "the address gave this page instead of the file; download it again, after a login if it needs one";
const OTHER_FILE_CURE: &str = "name another file";

/// Offset and bytes at the start of a kind of file, the kind, and the cure.
type Magic = (usize, &'static [u8], &'static str, &'static str);

/// The first match counts.
const MAGIC: [Magic; 59] = [
    (0, b"version https://git-lfs.github.com/", "a Git LFS pointer", "run git lfs pull where it was cloned"),
    (0, b"/annex/objects/", "a git-annex pointer", "run git annex get on it"),
    (0, b"bplist00", "a placeholder or list of macOS", "download the file itself"),
    (
        0,
        b"\0\x05\x16\x07",
        "a side file of macOS (AppleDouble)",
        "delete it; the file itself has the same name without ._",
    ),
    (0, b"\xFF\xD8\xFF", "a JPEG", NO_CURE),
    (0, b"\x89PNG", "a PNG", NO_CURE),
    (8, b"WEBP", "a WebP picture", CONVERT_CURE),
    (8, b"AVI ", "a video (AVI)", FRAMES_CURE),
    (4, b"ftypavif", "an AVIF picture", CONVERT_CURE),
    (4, b"ftypavis", "an AVIF picture", CONVERT_CURE),
    (4, b"ftyphei", "a HEIC picture", CONVERT_CURE),
    (4, b"ftyphev", "a HEIC picture", CONVERT_CURE),
    (4, b"ftypmif1", "a HEIF picture", CONVERT_CURE),
    (4, b"ftypmif2", "a HEIF picture", CONVERT_CURE),
    (4, b"ftypmsf1", "a HEIF picture", CONVERT_CURE),
    (4, b"ftypcrx ", "a raw photo (CR3)", CONVERT_CURE),
    (4, b"ftypqt", "a video (MOV)", FRAMES_CURE),
    (4, b"ftyp", "a video (MP4)", FRAMES_CURE),
    (4, b"moov", "a video (MOV)", FRAMES_CURE),
    (4, b"mdat", "a video (MOV)", FRAMES_CURE),
    (4, b"wide", "a video (MOV)", FRAMES_CURE),
    (0, b"\x1A\x45\xDF\xA3", "a video (Matroska or WebM)", FRAMES_CURE),
    (0, b"\0\0\x01\xBA", "a video (MPEG)", FRAMES_CURE),
    (0, b"II*\0\x10\0\0\0CR", "a raw photo (CR2)", CONVERT_CURE),
    (0, b"II*\0", "a TIFF or a raw photo", CONVERT_CURE),
    (0, b"MM\0*", "a TIFF or a raw photo", CONVERT_CURE),
    (0, b"II+\0", "a TIFF", CONVERT_CURE),
    (0, b"MM\0+", "a TIFF", CONVERT_CURE),
    (0, b"FUJIFILM", "a raw photo (RAF)", CONVERT_CURE),
    (0, b"IIRO", "a raw photo (ORF)", CONVERT_CURE),
    (0, b"IIRS", "a raw photo (ORF)", CONVERT_CURE),
    (0, b"IIU\0", "a raw photo (RW2)", CONVERT_CURE),
    (0, b"GIF8", "a GIF", CONVERT_CURE),
    (6, b"\0\0\0\0\x36\0\0\0", "a BMP", CONVERT_CURE),
    (0, b"\xFF\x0A", "a JPEG XL picture", CONVERT_CURE),
    (4, b"JXL ", "a JPEG XL picture", CONVERT_CURE),
    (4, b"jP  ", "a JPEG 2000 picture", CONVERT_CURE),
    (0, b"\xFF\x4F\xFF\x51", "a JPEG 2000 picture", CONVERT_CURE),
    (0, b"\x76\x2F\x31\x01", "an EXR picture", CONVERT_CURE),
    (0, b"#?RADIANCE", "an HDR picture", CONVERT_CURE),
    (0, b"8BPS", "a Photoshop document", CONVERT_CURE),
    (0, b"%PDF", "a PDF", OTHER_FILE_CURE),
    (0, b"PK\x03\x04", "a zip archive", UNPACK_CURE),
    (0, b"PK\x05\x06", "an empty zip archive", COPY_CURE),
    (0, b"7z\xBC\xAF", "a 7z archive", UNPACK_CURE),
    (0, b"Rar!", "a RAR archive", UNPACK_CURE),
    (257, b"ustar", "a tar archive", UNPACK_CURE),
    (0, b"\x1F\x8B", "a file packed by gzip", UNPACK_CURE),
    (0, b"\xFD7zXZ", "a file packed by xz", UNPACK_CURE),
    (0, b"BZh", "a file packed by bzip2", UNPACK_CURE),
    (0, b"\x28\xB5\x2F\xFD", "a file packed by Zstandard", UNPACK_CURE),
    (0, b"\x93NUMPY", "a NumPy array", OTHER_FILE_CURE),
    (0, b"ply\n", "a PLY", "name it *.ply"),
    (0, b"ply\r", "a PLY", "name it *.ply"),
    (0, b"NGSP", "an SPZ", "name it *.spz"),
    (0, b"glTF", "a GLB", "name it *.glb"),
    (0, b"#usda ", "a USD layer of text", "name it *.usda"),
    (0, b"PXR-USDC", "a binary USD layer", "save it as text first, as with usdcat IN -o OUT.usda"),
    (0, b"\x80\x02", "a pickle of Python", OTHER_FILE_CURE),
];

/// Starts of text files, in lower case.
const TEXT_STARTS: [(&str, &str, &str); 6] = [
    ("<!doctype html", "a web page", DOWNLOAD_CURE),
    ("<html", "a web page", DOWNLOAD_CURE),
    ("<head", "a web page", DOWNLOAD_CURE),
    ("<svg", "an SVG drawing", CONVERT_CURE),
    ("<?xml", "XML text", DOWNLOAD_CURE),
    ("<", "a page of HTML or XML", DOWNLOAD_CURE),
];

/// Identifies content by its first bytes. `first` is empty only for an empty file.
pub fn identify(first: &[u8]) -> Option<Content> {
    if first.is_empty() {
        return Some(Content { what: "an empty file", cure: COPY_CURE });
    }
    if first.len() >= 16 && first.iter().all(|&byte| byte == 0) {
        return Some(Content { what: "a file of zeros", cure: COPY_CURE });
    }
    // If the first brand of a HEIF file does not name the codec, a compatible brand does.
    let starts = |offset: usize, bytes: &[u8]| first.get(offset..).is_some_and(|rest| rest.starts_with(bytes));
    let brands = first.get(16..64.min(first.len())).unwrap_or_default();
    if starts(4, b"ftypmif1") && brands.chunks_exact(4).any(|brand| brand == b"avif") {
        return Some(Content { what: "an AVIF picture", cure: CONVERT_CURE });
    }
    if let Some(&(_, _, what, cure)) = MAGIC.iter().find(|&&(offset, bytes, ..)| starts(offset, bytes)) {
        return Some(Content { what, cure });
    }
    let text = first.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(first).trim_ascii_start().to_ascii_lowercase();
    let word = TEXT_STARTS.iter().find(|(word, ..)| text.starts_with(word.as_bytes()));
    word.map(|&(_, what, cure)| Content { what, cure })
}

/// Identifies the file at `path`.
pub fn identify_file(path: &Path) -> Result<Option<Content>> {
    let mut first = Vec::new();
    read::open(path)?.take(FIRST_BYTES).read_to_end(&mut first).map_err(Error::read(path))?;
    Ok(identify(&first))
}

impl Content {
    /// Returns the error clause for a file that should be something else, such as "a photo": what it is, and the cure.
    pub fn mismatch(self, expected: &str) -> String {
        let Self { what, cure } = self;
        let cure = if cure.is_empty() { OTHER_FILE_CURE } else { cure };
        format!("is {what}, not {expected}; {cure}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn what(first: &[u8]) -> &'static str {
        identify(first).map_or("unknown", |content| content.what)
    }

    #[test]
    fn first_bytes_tell_what_a_file_is() {
        let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 9\n";
        let mut tar = vec![b'a'; 512];
        tar[257..262].copy_from_slice(b"ustar");
        let cases: [(&[u8], &str); 34] = [
            (b"", "an empty file"),
            (&[0; 64], "a file of zeros"),
            (pointer, "a Git LFS pointer"),
            (b"\xEF\xBB\xBF \n<!DOCTYPE HTML><html>", "a web page"),
            (b"<html lang=en>", "a web page"),
            (b"<?xml version=\"1.0\"?><Error>", "XML text"),
            (b"\xFF\xD8\xFF\xE0\0\x10JFIF", "a JPEG"),
            (b"\x89PNG\r\n\x1A\n", "a PNG"),
            (b"RIFF\x10\0\0\0WEBPVP8 ", "a WebP picture"),
            (b"RIFF\x10\0\0\0AVI LIST", "a video (AVI)"),
            (b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "a HEIC picture"),
            (b"\0\0\0\x1Cftypmif1\0\0\0\0mif1heicmiaf", "a HEIF picture"),
            (b"\0\0\0\x1Cftypmif1\0\0\0\0mif1avifmiaf", "an AVIF picture"),
            (b"\0\0\0\x1Cftypavif\0\0\0\0mif1avif", "an AVIF picture"),
            (b"\0\0\0\x14ftypqt  \0\0\x02\0qt  ", "a video (MOV)"),
            (b"\0\0\0\x20ftypisom\0\0\x02\0isom", "a video (MP4)"),
            (b"\0\0\0\x18ftypcrx \0\0\0\x01crx isom", "a raw photo (CR3)"),
            (b"II*\0\x10\0\0\0CR\x02\0", "a raw photo (CR2)"),
            (b"MM\0*\0\0\0\x08", "a TIFF or a raw photo"),
            (b"GIF89a\x01\0", "a GIF"),
            (b"BM\x46\0\0\0\0\0\0\0\x36\0\0\0", "a BMP"),
            (b"%PDF-1.7\n", "a PDF"),
            (b"PK\x03\x04\x14\0", "a zip archive"),
            (b"\x1F\x8B\x08\0", "a file packed by gzip"),
            (&tar, "a tar archive"),
            (b"\xFF\x0A\xFA\x1F", "a JPEG XL picture"),
            (b"\0\0\0\x0CJXL \r\n\x87\n", "a JPEG XL picture"),
            (b"\0\x05\x16\x07\0\x02\0\0Mac OS X", "a side file of macOS (AppleDouble)"),
            (b"ply\r\nformat ascii 1.0\r\n", "a PLY"),
            (b"glTF\x02\0\0\0", "a GLB"),
            (b"#usda 1.0\n(\n", "a USD layer of text"),
            (b"PXR-USDC\0\x08\0\0", "a binary USD layer"),
            (b"1 2 3 some text", "unknown"),
            (b"plywood", "unknown"),
        ];
        for (first, expected) in cases {
            assert_eq!(what(first), expected, "{:?}", first.get(..24).unwrap_or(first).escape_ascii().to_string());
        }
    }

    #[test]
    fn a_content_is_told_with_its_cure() {
        let told = identify(b"version https://git-lfs.github.com/spec/v1\n").map(|content| content.mismatch("a PLY"));
        assert_eq!(told.as_deref(), Some("is a Git LFS pointer, not a PLY; run git lfs pull where it was cloned"));
        let told = identify(b"\xFF\xD8\xFF\xE0").map(|content| content.mismatch("a model"));
        assert_eq!(told.as_deref(), Some("is a JPEG, not a model; name another file"));
    }
}
