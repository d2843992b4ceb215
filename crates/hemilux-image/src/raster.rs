//! JPEG and TGA, by way of the `image` crate: code values scaled to 0..1, flagged as sRGB.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use crate::buffer::{Channel, Encoding, Image};
use crate::error::{ImageError, checked_size};

fn name(format: ImageFormat) -> &'static str {
    if format == ImageFormat::Tga { "TGA" } else { "JPEG" }
}

/// Width, height and channels from the header.
pub(crate) fn probe(bytes: &[u8], format: ImageFormat) -> Result<(usize, usize, Vec<String>), ImageError> {
    let bad = |e: image::ImageError| ImageError::malformed(name(format), e.to_string());
    let decoder = ImageReader::with_format(Cursor::new(bytes), format).into_decoder().map_err(bad)?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    checked_size(name(format), width.into(), height.into(), color.channel_count().into())?;
    let names = channel_names(color.channel_count().into());
    Ok((width as usize, height as usize, names.iter().map(|n| (*n).to_owned()).collect()))
}

pub(crate) fn channel_names(count: usize) -> &'static [&'static str] {
    match count {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        _ => &["R", "G", "B", "A"],
    }
}

pub(crate) fn decode(bytes: &[u8], format: ImageFormat) -> Result<Image, ImageError> {
    let (width, height, names) = probe(bytes, format)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(crate::MAX_VALUES as u64 * 4);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| ImageError::malformed(name(format), e.to_string()))?;
    if (picture.width() as usize, picture.height() as usize) != (width, height) {
        return Err(ImageError::malformed(name(format), "header and pixels disagree about the size"));
    }
    let (values, count) = match (picture, names.len()) {
        (DynamicImage::ImageLuma8(p), _) => (p.into_raw(), 1),
        (DynamicImage::ImageLumaA8(p), _) => (p.into_raw(), 2),
        (DynamicImage::ImageRgba8(p), _) => (p.into_raw(), 4),
        (p, 4) => (p.into_rgba8().into_raw(), 4),
        (p, _) => (p.into_rgb8().into_raw(), 3),
    };
    Ok(planar(width, height, &values, count, 255.0))
}

/// Interleaved code values to planes of 0..1, flagged as sRGB.
pub(crate) fn planar<T: Copy + Into<f32>>(
    width: usize,
    height: usize,
    values: &[T],
    count: usize,
    max: f32,
) -> Image {
    let channels = channel_names(count).iter().enumerate().map(|(c, name)| Channel {
        name: (*name).to_owned(),
        data: values.iter().skip(c).step_by(count).map(|v| (*v).into() / max).collect(),
    });
    let mut image = Image::new(width, height);
    image.channels = channels.collect();
    image.encoding = Encoding::Srgb;
    image
}
