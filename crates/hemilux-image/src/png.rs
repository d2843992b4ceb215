//! PNG: 8 or 16 bits in, grey, colour, palette, with or without alpha; 8-bit sRGB out, with text metadata.

use std::io::{Cursor, Write};

use crate::buffer::{Encoding, Image};
use crate::error::{ImageError, Reason, checked_size};
use crate::raster::{channel_names, planar};
use crate::srgb;
use crate::tone::{Rgb8, dither};

const FORMAT: &str = "PNG";

fn malformed(error: ::png::DecodingError) -> ImageError {
    ImageError::malformed(FORMAT, error.to_string())
}

fn reader(bytes: &[u8]) -> Result<::png::Reader<Cursor<&[u8]>>, ImageError> {
    let limits = ::png::Limits { bytes: crate::MAX_VALUES * 2 };
    let mut decoder = ::png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(::png::Transformations::EXPAND);
    let reader = decoder.read_info().map_err(malformed)?;
    let (width, height) = reader.info().size();
    let channels = reader.output_color_type().0.samples();
    checked_size(FORMAT, width.into(), height.into(), channels as u64)?;
    Ok(reader)
}

/// Width, height and channel names from the header.
pub(crate) fn probe(bytes: &[u8]) -> Result<(usize, usize, Vec<String>), ImageError> {
    let reader = reader(bytes)?;
    let (width, height) = reader.info().size();
    let names = channel_names(reader.output_color_type().0.samples());
    Ok((width as usize, height as usize, names.iter().map(|n| (*n).to_owned()).collect()))
}

/// Reads a PNG: code values scaled to 0..1 and flagged as sRGB, or as linear where the file says gamma 1.
///
/// # Errors
/// A damaged file, or too large a picture.
pub fn decode(bytes: &[u8]) -> Result<Image, ImageError> {
    let mut reader = reader(bytes)?;
    let (width, height) = reader.info().size();
    let (width, height) = (width as usize, height as usize);
    let (color, depth) = reader.output_color_type();
    let count = color.samples();
    let size = reader.output_buffer_size().filter(|n| *n <= crate::MAX_VALUES * 2);
    let mut buffer = vec![0; size.ok_or_else(|| ImageError::malformed(FORMAT, "too large"))?];
    reader.next_frame(&mut buffer).map_err(malformed)?;
    let mut image = if depth == ::png::BitDepth::Sixteen {
        let values: Vec<u16> = buffer.as_chunks().0.iter().map(|v| u16::from_be_bytes(*v)).collect();
        planar(width, height, &values, count, 65535.0)
    } else {
        planar(width, height, &buffer, count, 255.0)
    };
    // Texts may follow the pixels; a file cut off there still has its picture.
    let _ = reader.finish();
    let info = reader.info();
    if info.srgb.is_none() && info.gama_chunk.is_some_and(|g| g.into_scaled() == 100_000) {
        image.encoding = Encoding::Linear;
    }
    let latin = info.uncompressed_latin1_text.iter().map(|t| (t.keyword.clone(), t.text.clone()));
    let packed =
        info.compressed_latin1_text.iter().filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?)));
    let utf8 = info.utf8_text.iter().filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?)));
    image.metadata = latin.chain(packed).chain(utf8).collect();
    image.check().map_err(|_| ImageError::malformed(FORMAT, "fewer pixels than promised"))?;
    Ok(image)
}

/// Writes 8-bit RGB pixels, fast compression, as sRGB; metadata as text (keys are cut to 79 characters).
///
/// # Errors
/// The pixels do not fit the size, or the writer fails.
pub fn encode_rgb8(
    pixels: &Rgb8,
    metadata: &[(String, String)],
    out: &mut impl Write,
) -> Result<(), ImageError> {
    let size = u32::try_from(pixels.width).ok().zip(u32::try_from(pixels.height).ok());
    let fits = pixels.data.len() == pixels.width * pixels.height * 3 && !pixels.data.is_empty();
    let (width, height) =
        size.filter(|_| fits).ok_or_else(|| ImageError::unfit("pixels do not fit the size"))?;
    let failed = |error: ::png::EncodingError| match error {
        ::png::EncodingError::IoError(e) => ImageError::from(Reason::Io(e)),
        other => ImageError::unfit(other.to_string()),
    };
    let mut encoder = ::png::Encoder::new(&mut *out, width, height);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_compression(::png::Compression::Fast);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::RelativeColorimetric);
    for (key, value) in metadata {
        let key = keyword(key);
        let value = value.replace('\0', " ");
        if value.chars().all(|c| u32::from(c) < 256) {
            encoder.add_text_chunk(key, value).map_err(failed)?;
        } else {
            encoder.add_itxt_chunk(key, value).map_err(failed)?;
        }
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&pixels.data).map_err(failed)?;
    writer.finish().map_err(failed)?;
    out.flush()?;
    Ok(())
}

/// A valid PNG keyword: 1 to 79 printable Latin-1 characters, no space at the ends and no two in a row.
fn keyword(key: &str) -> String {
    let good = |c: char| matches!(u32::from(c), 0x21..=0x7e | 0xa1..=0xff);
    let key: String = key.chars().map(|c| if good(c) { c } else { ' ' }).collect();
    let key = key.split_whitespace().collect::<Vec<_>>().join(" ");
    let key: String = key.chars().take(79).collect();
    let key = key.trim().to_owned();
    if key.is_empty() { "Comment".to_owned() } else { key }
}

/// Writes the picture (see [`Image::rgb`]) as 8-bit sRGB: linear light is clamped to 0..1 and encoded, sRGB code values
/// are kept. Tone curves come before, from [`crate::tone`].
///
/// # Errors
/// No picture among the channels, or the writer fails.
pub fn encode(image: &Image, out: &mut impl Write) -> Result<(), ImageError> {
    encode_rgb8(&to_rgb8(image, false)?, &image.metadata, out)
}

/// The picture as 8-bit sRGB, clamped; `dithered` adds the fixed pattern of [`crate::tone::dither`] before rounding.
///
/// # Errors
/// No picture among the channels.
pub fn to_rgb8(image: &Image, dithered: bool) -> Result<Rgb8, ImageError> {
    image.check()?;
    let planes = image.rgb().ok_or_else(|| ImageError::unfit("no R, G, B or Y to write as PNG"))?;
    let mut data = Vec::with_capacity(image.len() * 3);
    for i in 0..image.len() {
        let offset = if dithered { dither(i % image.width, i / image.width) } else { 0.0 };
        for plane in planes {
            let v = plane[i].clamp(0.0, 1.0);
            let code = if image.encoding == Encoding::Srgb { v } else { srgb::encode(v) };
            data.push((code * 255.0 + 0.5 + offset).clamp(0.0, 255.0) as u8);
        }
    }
    Ok(Rgb8 { width: image.width, height: image.height, data })
}
