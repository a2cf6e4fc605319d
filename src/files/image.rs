//! Image files: reads photos, writes PNG and EXR.

use super::{atomic, content, read};
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage};
use image::{ImageDecoder, ImageReader};
use labelgs_scene::view::alpha_of;
use labelgs_scene::{Error, Photo, Result};
use png::{BitDepth, ColorType, Compression, EncodingError};
use std::io::{BufRead, Cursor, ErrorKind, Seek, Write};
use std::path::Path;

/// Most pixels of an image. Larger ones are refused before decoding.
pub const PIXELS_MAX: u64 = 1 << 28;

/// Refuses sizes of 0 or above [`PIXELS_MAX`].
pub fn check_size(path: &Path, (width, height): (u32, u32)) -> Result<()> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > PIXELS_MAX {
        let problem = format!("{width} x {height} px; between 1 and {PIXELS_MAX} pixels are supported");
        return Err(Error::data(path, "", problem));
    }
    Ok(())
}

/// Largest expansion of a byte by deflate. Headers are not subtracted, because they are only a few bytes.
const DEFLATE_MAX: u64 = 1032;
/// Most samples per byte in the other formats. A JPEG has at least one bit per block of 64 samples, times the number of
/// interleaved components.
const SAMPLES_MAX: u64 = 8192;

/// Refuses a PNG with `bits` per pixel whose file is too short for its pixels, before allocating memory.
pub fn check_png_length(path: &Path, (width, height): (u32, u32), bits: u32) -> Result<()> {
    let bytes = (u64::from(width) * u64::from(bits)).div_ceil(8) * u64::from(height);
    if bytes <= (file_length(path)? + 64) * DEFLATE_MAX { Ok(()) } else { Err(too_short(path, (width, height))) }
}

/// Refuses a file that is too short for its pixels with `channels` samples each, whatever the compression.
pub fn check_length(path: &Path, (width, height): (u32, u32), channels: u64) -> Result<()> {
    let samples = u64::from(width) * u64::from(height) * channels;
    if samples <= (file_length(path)? + 64) * SAMPLES_MAX { Ok(()) } else { Err(too_short(path, (width, height))) }
}

/// Refuses a palette whose length is not a multiple of 3: the decoder would read beyond its end.
fn check_palette(path: &Path, bytes: &[u8]) -> Result<()> {
    let reader = png::Decoder::new(Cursor::new(bytes)).read_info();
    let reader = reader.map_err(|error| Error::data(path, "", format!("cannot be decoded: {error}")))?;
    let bytes = reader.info().palette.as_ref().map_or(0, |palette| palette.len());
    if bytes.is_multiple_of(3) {
        return Ok(());
    }
    let problem = format!("has {bytes} bytes, expected a multiple of 3; write the image again");
    Err(Error::data(path, "palette", problem))
}

fn file_length(path: &Path) -> Result<u64> {
    Ok(std::fs::metadata(path).map_err(Error::read(path))?.len())
}

fn too_short(path: &Path, (width, height): (u32, u32)) -> Error {
    let problem =
        format!("{width} x {height} px cannot be in so few bytes; the file was cut short or its header is wrong");
    Error::data(path, "", problem)
}

fn reader<R: BufRead + Seek>(path: &Path, file: R) -> Result<ImageReader<R>> {
    // Detect the format from the first bytes, so that a PNG named .jpg works.
    let mut reader = ImageReader::new(file).with_guessed_format().map_err(Error::read(path))?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(PIXELS_MAX * 16);
    reader.limits(limits);
    Ok(reader)
}

/// Reads width and height from the header, px.
pub fn photo_size(path: impl AsRef<Path>) -> Result<(u32, u32)> {
    let path = path.as_ref();
    reader(path, read::open(path)?)?.into_dimensions().map_err(|error| match error {
        // A truncated file ends early. A failing disk reports another error.
        image::ImageError::IoError(cause) if cause.kind() != ErrorKind::UnexpectedEof => Error::read(path)(cause),
        other => undecodable(path, &other),
    })
}

/// Explains why a file cannot be decoded and what to do.
fn undecodable(path: &Path, error: &image::ImageError) -> Error {
    let problem = match content::identify_file(path).ok().flatten() {
        Some(content) if !["a PNG", "a JPEG"].contains(&content.what) => content.mismatch("a PNG or JPEG"),
        Some(_) => format!("cannot be decoded: {error}; copy it again, or leave it out of the scene"),
        None => format!("cannot be decoded: it is neither PNG nor JPEG ({error}); convert it, or leave it out"),
    };
    Error::data(path, "", problem)
}

/// Reads a PNG or JPEG as 8-bit RGB with alpha 255. Blends transparency over `background` (R, G, B, 0 to 1). Converts
/// grey and 16-bit photos. Ignores an EXIF orientation as COLMAP does, because poses belong to the stored pixels.
pub fn read_photo(path: impl AsRef<Path>, background: [f32; 3]) -> Result<Photo> {
    let picture = decode(path.as_ref())?;
    let transparent = picture.color().has_alpha();
    let mut photo = to_rgba(picture);
    if transparent {
        let background = background.map(|value| f64::from(value) * 255.0);
        photo.rgba.iter_mut().for_each(|texel| *texel = blend_over(*texel, background));
    }
    Ok(photo)
}

/// Like [`read_photo`] over black, and keeps the opacity of transparent photos.
pub fn read_open_photo(path: &Path) -> Result<Photo> {
    let mut photo = to_rgba(decode(path)?);
    for texel in &mut photo.rgba {
        let opacity = f64::from(texel[3]) / 255.0;
        *texel = blend_over(*texel, [0.0; 3]);
        texel[3] = alpha_of(opacity);
    }
    Ok(photo)
}

/// Reads a PNG or JPEG as 8-bit RGBA. Alpha is the stored opacity, or 255 without an alpha channel.
pub fn read_rgba(path: impl AsRef<Path>) -> Result<Photo> {
    Ok(to_rgba(decode(path.as_ref())?))
}

/// Reads a PNG or JPEG as 8-bit grey: width, height, row-major values. Colours become their luminance.
pub fn read_grey(path: impl AsRef<Path>) -> Result<(u32, u32, Vec<u8>)> {
    let picture = decode(path.as_ref())?;
    Ok((picture.width(), picture.height(), picture.into_luma8().into_raw()))
}

fn decode(path: &Path) -> Result<image::DynamicImage> {
    let undecodable = |error: image::ImageError| undecodable(path, &error);
    let bytes = read::bytes(path)?;
    let reader = reader(path, Cursor::new(&bytes))?;
    let png = reader.format() == Some(image::ImageFormat::Png);
    let decoder = reader.into_decoder().map_err(undecodable)?;
    let (size, bits) = (decoder.dimensions(), u32::from(decoder.color_type().bits_per_pixel()));
    check_size(path, size)?;
    // An 8-bit result may come from packed grey or a two-colour palette.
    let packed = if decoder.color_type().bytes_per_pixel() == decoder.color_type().channel_count() { 1 } else { bits };
    if png {
        check_png_length(path, size, packed)?;
        check_palette(path, &bytes)?;
    } else {
        check_length(path, size, 1)?;
    }
    image::DynamicImage::from_decoder(decoder).map_err(undecodable)
}

fn to_rgba(picture: image::DynamicImage) -> Photo {
    let pixels = picture.into_rgba8();
    let (width, height) = pixels.dimensions();
    let rgba = bytemuck::allocation::try_cast_vec(pixels.into_raw())
        .unwrap_or_else(|(_, bytes)| bytemuck::allocation::pod_collect_to_vec(&bytes));
    Photo { width, height, rgba }
}

fn blend_over([r, g, b, a]: [u8; 4], background: [f64; 3]) -> [u8; 4] {
    let alpha = f64::from(a) / 255.0;
    let blend = |c: u8, b: f64| (f64::from(c) * alpha + b * (1.0 - alpha)).round().clamp(0.0, 255.0) as u8;
    [blend(r, background[0]), blend(g, background[1]), blend(b, background[2]), 255]
}

/// Channels and bits of a PNG.
type Layout = (ColorType, BitDepth);

const RGB8: Layout = (ColorType::Rgb, BitDepth::Eight);
const RGBA8: Layout = (ColorType::Rgba, BitDepth::Eight);
const GREY8: Layout = (ColorType::Grayscale, BitDepth::Eight);
const GREY16: Layout = (ColorType::Grayscale, BitDepth::Sixteen);

/// Writes an 8-bit RGB PNG; `pixels` is row-major.
pub fn write_png_rgb8(path: impl AsRef<Path>, width: u32, height: u32, pixels: &[[u8; 3]]) -> Result<()> {
    write_png(path.as_ref(), (width, height), RGB8, pixels.as_flattened())
}

/// Writes an 8-bit RGBA PNG with straight alpha; `pixels` is row-major.
pub fn write_png_rgba8(path: impl AsRef<Path>, width: u32, height: u32, pixels: &[[u8; 4]]) -> Result<()> {
    write_png(path.as_ref(), (width, height), RGBA8, pixels.as_flattened())
}

/// Writes an 8-bit grey PNG; `pixels` is row-major.
pub fn write_png_grey8(path: impl AsRef<Path>, width: u32, height: u32, pixels: &[u8]) -> Result<()> {
    write_png(path.as_ref(), (width, height), GREY8, pixels)
}

/// Writes a 16-bit grey PNG, such as an id map; `pixels` is row-major.
pub fn write_png_grey16(path: impl AsRef<Path>, width: u32, height: u32, pixels: &[u16]) -> Result<()> {
    write_png(path.as_ref(), (width, height), GREY16, &big_endian(pixels))
}

fn write_png(path: &Path, size: (u32, u32), layout: Layout, bytes: &[u8]) -> Result<()> {
    atomic::write(path, |out| Ok(encode_png(out, size, layout, Compression::default(), bytes)?))
}

/// Encodes 8-bit RGB as a PNG, compressed as fast as possible.
pub fn png_rgb8(size: (u32, u32), pixels: &[[u8; 3]]) -> Result<Vec<u8>> {
    fast_png(size, RGB8, pixels.as_flattened())
}

/// Encodes 8-bit RGB with opacity as a PNG, compressed as fast as possible.
pub fn png_rgba8(size: (u32, u32), pixels: &[[u8; 4]]) -> Result<Vec<u8>> {
    fast_png(size, RGBA8, pixels.as_flattened())
}

/// Encodes 16-bit grey as a PNG, compressed as fast as possible.
pub fn png_grey16(size: (u32, u32), pixels: &[u16]) -> Result<Vec<u8>> {
    fast_png(size, GREY16, &big_endian(pixels))
}

fn fast_png(size: (u32, u32), layout: Layout, bytes: &[u8]) -> Result<Vec<u8>> {
    let mut out = Vec::with_capacity(bytes.len() / 2 + 256);
    let written = encode_png(&mut out, size, layout, Compression::Fastest, bytes);
    written.map(|()| out).map_err(|error| Error::Bug(format!("PNG in memory: {error}")))
}

fn encode_png(
    out: &mut dyn Write,
    (width, height): (u32, u32),
    (colour, depth): Layout,
    compression: Compression,
    bytes: &[u8],
) -> Result<(), EncodingError> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.set_compression(compression);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()
}

fn big_endian(pixels: &[u16]) -> Vec<u8> {
    pixels.iter().flat_map(|value| value.to_be_bytes()).collect()
}

/// Encodes 8-bit RGB as a JPEG, for slow connections.
pub fn jpeg_rgb8((width, height): (u32, u32), pixels: &[[u8; 3]], quality: u8) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    let written = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut out, quality).encode(
        pixels.as_flattened(),
        width,
        height,
        image::ExtendedColorType::Rgb8,
    );
    written.map(|()| out).map_err(|error| Error::Bug(format!("JPEG in memory: {error}")))
}

/// Writes an EXR with 32-bit floats in the channels R, G and B; `pixels` is row-major.
pub fn write_exr_rgb(path: impl AsRef<Path>, width: u32, height: u32, pixels: &[[f32; 3]]) -> Result<()> {
    let channel =
        |name: &'static str, index: usize| (name, FlatSamples::F32(pixels.iter().map(|pixel| pixel[index]).collect()));
    write_exr(path.as_ref(), (width, height), vec![channel("R", 0), channel("G", 1), channel("B", 2)])
}

/// Writes an EXR with 32-bit floats in the single channel Y; `pixels` is row-major.
pub fn write_exr_y(path: impl AsRef<Path>, width: u32, height: u32, pixels: &[f32]) -> Result<()> {
    write_exr(path.as_ref(), (width, height), vec![("Y", FlatSamples::F32(pixels.to_vec()))])
}

/// Writes 32-bit unsigned integers as an EXR with one channel `Y`.
pub fn write_exr_uint(path: impl AsRef<Path>, width: u32, height: u32, pixels: &[u32]) -> Result<()> {
    write_exr(path.as_ref(), (width, height), vec![("Y", FlatSamples::U32(pixels.to_vec()))])
}

fn write_exr(path: &Path, (width, height): (u32, u32), channels: Vec<(&'static str, FlatSamples)>) -> Result<()> {
    let expected = u64::from(width) * u64::from(height);
    if channels.iter().any(|(_, samples)| samples.len() as u64 != expected) {
        return Err(Error::Bug(format!("{} gets the wrong number of pixels for {width} x {height}", path.display())));
    }
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples));
    let layer = Layer::new(
        (width as usize, height as usize),
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    );
    // The crate needs a seekable writer; the atomic writer is a stream.
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| Error::write(path)(std::io::Error::other(error.to_string())))?;
    atomic::write(path, |out| out.write_all(bytes.get_ref()))
}
