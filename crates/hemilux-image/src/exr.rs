//! OpenEXR: one part of 32-bit floats out; any flat file in (half, float or unsigned, any layer or channel names).
//!
//! Written files have plain channel names (`R`, `G`, `B`, `stderr.R`, `Z`, …), sorted as the format asks, the display
//! window equal to the data window, and the metadata as text attributes in their order. The same picture gives the
//! same bytes.
//!
//! Read files may have several parts: the first that holds a picture (`R`, `G`, `B`, or `Y`, also with a layer name)
//! is taken with all its channels; those of other parts that cover the same pixels follow, named `part.channel`. The
//! picture is the display window: pixels without data are 0. Deep and subsampled files are refused.

mod attributes;

use std::collections::HashSet;
use std::io::{Cursor, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};

use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression as ExrCompression, Encoding as ExrEncoding,
    FlatImage, FlatSamples, Image as ExrImage, IntegerBounds, Layer, LayerAttributes, LineOrder, MetaData,
    ReadChannels, ReadLayers, Text, Vec2, WritableImage,
};

use crate::buffer::{Channel, Image, picture_channels};
use crate::error::{ImageError, Reason, checked_size};

const FORMAT: &str = "OpenEXR";

/// How the pixels are packed; all are lossless.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Compression {
    /// As they are: for files that are written often, while rendering.
    None,
    /// Wavelet and Huffman code: a tenth smaller than `Zip` on pure noise, but slow to read.
    Piz,
    /// Deflate in blocks of 16 rows: the smallest where some channels are smooth or empty, and quick to read.
    #[default]
    Zip,
}

/// Attribute names the format gives a meaning and mostly another type; metadata with such a key is written as
/// `metadata.key`.
const RESERVED: [&str; 46] = [
    "adoptedNeutral",
    "altitude",
    "aperture",
    "capDate",
    "channels",
    "chromaticities",
    "chunkCount",
    "compression",
    "dataWindow",
    "deepImageState",
    "displayWindow",
    "dwaCompressionLevel",
    "envmap",
    "expTime",
    "far",
    "fieldOfViewHorizontal",
    "fieldOfViewVertical",
    "focus",
    "framesPerSecond",
    "isoSpeed",
    "keyCode",
    "latitude",
    "lineOrder",
    "longitude",
    "lookModTransform",
    "maxSamplesPerPixel",
    "multiView",
    "name",
    "near",
    "originalDataWindow",
    "pixelAspectRatio",
    "preview",
    "renderingTransform",
    "screenWindowCenter",
    "screenWindowWidth",
    "tiles",
    "timeCode",
    "type",
    "utcOffset",
    "version",
    "view",
    "whiteLuminance",
    "worldToCamera",
    "worldToNDC",
    "wrapmodes",
    "xDensity",
];

/// Writes all channels as 32-bit floats, with the default compression.
///
/// # Errors
/// See [`encode_with`].
pub fn encode(image: &Image, out: &mut impl Write) -> Result<(), ImageError> {
    encode_with(image, Compression::default(), out)
}

/// Writes all channels as 32-bit floats, and the metadata as text attributes.
///
/// # Errors
/// A channel that does not fit, two of the same name, a name or key that is empty or longer than 255 bytes, or the
/// writer fails.
pub fn encode_with(image: &Image, compression: Compression, out: &mut impl Write) -> Result<(), ImageError> {
    image.check()?;
    let mut names = HashSet::new();
    for channel in &image.channels {
        valid_name("channel", &channel.name)?;
        if !names.insert(channel.name.as_str()) {
            return Err(ImageError::unfit(format!("two channels are called {}", channel.name)));
        }
    }
    let bytes = catch_unwind(AssertUnwindSafe(|| pack(image, compression)));
    let bytes = bytes.map_err(|_| ImageError::unfit("the EXR encoder failed"))??;
    out.write_all(&bytes)?;
    out.flush()?;
    Ok(())
}

fn valid_name(what: &str, name: &str) -> Result<(), ImageError> {
    if name.is_empty() || name.len() > 255 || name.contains('\0') {
        return Err(ImageError::unfit(format!("{what} name {name:?} is empty, too long or has a NUL")));
    }
    Ok(())
}

fn text(s: &str) -> Text {
    Text::from_slice_unchecked(s.as_bytes())
}

fn pack(image: &Image, compression: Compression) -> Result<Vec<u8>, ImageError> {
    let size = Vec2(image.width, image.height);
    let channels = image.channels.iter().map(|c| AnyChannel {
        name: text(&c.name),
        sample_data: FlatSamples::F32(c.data.clone()),
        // A hint for lossy codes only; false is what OpenEXR writes.
        quantize_linearly: false,
        sampling: Vec2(1, 1),
    });
    let attributes = text_attributes(&image.metadata)?;
    let mut own = LayerAttributes::default();
    for (key, value) in &attributes {
        match key.as_str() {
            "owner" => own.owner = Some(text(value)),
            "comments" => own.comments = Some(text(value)),
            "software" => own.software_name = Some(text(value)),
            _ => {
                own.other.insert(text(key), AttributeValue::Text(text(value)));
            }
        }
    }
    let encoding = ExrEncoding {
        compression: match compression {
            Compression::None => ExrCompression::Uncompressed,
            Compression::Piz => ExrCompression::PIZ,
            Compression::Zip => ExrCompression::ZIP16,
        },
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new(size, own, encoding, AnyChannels::sort(channels.collect()));
    let mut bytes = Cursor::new(Vec::new());
    ExrImage::from_layer(layer).write().to_buffered(&mut bytes).map_err(|e| match e {
        ::exr::error::Error::Io(e) => ImageError::from(Reason::Io(e)),
        other => ImageError::unfit(other.to_string()),
    })?;
    let mut bytes = bytes.into_inner();
    let order: Vec<&str> = attributes.iter().map(|(k, _)| k.as_str()).collect();
    attributes::reorder(&mut bytes, &order);
    Ok(bytes)
}

/// Metadata with one entry per key (values of the same key are joined by line ends) and no reserved key.
fn text_attributes(metadata: &[(String, String)]) -> Result<Vec<(String, String)>, ImageError> {
    let mut attributes: Vec<(String, String)> = Vec::new();
    for (key, value) in metadata {
        let key = if RESERVED.contains(&key.as_str()) { format!("metadata.{key}") } else { key.clone() };
        valid_name("metadata", &key)?;
        match attributes.iter_mut().find(|(k, _)| *k == key) {
            Some((_, old)) => {
                old.push('\n');
                old.push_str(value);
            }
            None => attributes.push((key, value.clone())),
        }
    }
    Ok(attributes)
}

fn malformed(error: &::exr::error::Error) -> ImageError {
    match error {
        ::exr::error::Error::NotSupported(what) => {
            ImageError::unsupported(format!("OpenEXR: {what} is not supported"))
        }
        other => ImageError::malformed(FORMAT, other.to_string()),
    }
}

/// Runs a decoder that is not ours; a panic in it becomes an error.
fn guarded<T>(body: impl FnOnce() -> Result<T, ImageError>) -> Result<T, ImageError> {
    catch_unwind(AssertUnwindSafe(body))
        .unwrap_or_else(|_| Err(ImageError::malformed(FORMAT, "the decoder failed")))
}

/// The headers, checked against the limits before anything is allocated for pixels.
fn headers(bytes: &[u8]) -> Result<MetaData, ImageError> {
    let meta =
        guarded(|| MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| malformed(&e)))?;
    let (mut chunks, mut values, mut least) = (0_u64, 0_u64, 0_u64);
    for header in &meta.headers {
        let count = header.channels.list.len() as u64;
        let size = header.layer_size;
        checked_size(FORMAT, size.0 as u64, size.1 as u64, count)?;
        values = values.saturating_add(count * (size.0 * size.1) as u64);
        least += size.0 as u64 * size.1 as u64 * count * 2 / densest(header.compression);
        chunks = chunks.saturating_add(header.chunk_count as u64);
        let window = header.shared_attributes.display_window.size;
        checked_size(FORMAT, window.0 as u64, window.1 as u64, count)?;
        if header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1)) {
            return Err(ImageError::unsupported("OpenEXR: subsampled channels are not supported"));
        }
    }
    if values > crate::MAX_VALUES as u64 {
        return Err(ImageError::malformed(FORMAT, format!("{values} values are more than the limit")));
    }
    // Each chunk has an offset of 8 bytes, and at least a head of 8.
    if chunks.saturating_mul(16) > bytes.len() as u64 {
        return Err(ImageError::malformed(FORMAT, format!("{chunks} blocks do not fit in the file")));
    }
    if least > bytes.len() as u64 {
        return Err(ImageError::malformed(
            FORMAT,
            format!("{} bytes cannot hold {values} values", bytes.len()),
        ));
    }
    Ok(meta)
}

/// No file of this compression has more bytes of pixels per byte than this: deflate reaches 1032, the run codes of
/// the others are bounded by their counters; rounded up generously.
fn densest(compression: ExrCompression) -> u64 {
    match compression {
        ExrCompression::Uncompressed => 1,
        ExrCompression::RLE => 64,
        ExrCompression::DWAA(_) | ExrCompression::DWAB(_) => 100_000,
        _ => 4000,
    }
}

fn string(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// Which part holds the picture: the first one with colour or grey, else the first.
fn picture_part(names: &[Vec<String>]) -> usize {
    let has = |part: &Vec<String>| {
        let names: Vec<&str> = part.iter().map(String::as_str).collect();
        picture_channels(&names).is_some()
    };
    names.iter().position(has).unwrap_or(0)
}

/// Width, height and channel names of the picture's part, from the headers.
pub(crate) fn probe(bytes: &[u8]) -> Result<(usize, usize, Vec<String>), ImageError> {
    let meta = headers(bytes)?;
    let names: Vec<Vec<String>> =
        meta.headers.iter().map(|h| h.channels.list.iter().map(|c| string(&c.name)).collect()).collect();
    let header = meta.headers.first().ok_or_else(|| ImageError::malformed(FORMAT, "no part"))?;
    let window = header.shared_attributes.display_window.size;
    Ok((window.0, window.1, names.get(picture_part(&names)).cloned().unwrap_or_default()))
}

/// Reads an OpenEXR file.
///
/// # Errors
/// A damaged file, too large a picture, deep or subsampled data.
pub fn decode(bytes: &[u8]) -> Result<Image, ImageError> {
    headers(bytes)?;
    // One thread: a panic in a pool's thread would end the process instead of becoming an error.
    let read = || {
        let reader = ::exr::prelude::read().no_deep_data().largest_resolution_level();
        let reader = reader.all_channels().all_layers().all_attributes().non_parallel();
        reader.from_buffered(Cursor::new(bytes)).map_err(|e| malformed(&e))
    };
    let file: FlatImage = guarded(read)?;
    guarded(|| assemble(file, bytes))
}

fn assemble(file: FlatImage, bytes: &[u8]) -> Result<Image, ImageError> {
    let display = file.attributes.display_window;
    let names: Vec<Vec<String>> = file
        .layer_data
        .iter()
        .map(|l| l.channel_data.list.iter().map(|c| string(&c.name)).collect())
        .collect();
    let picture = picture_part(&names);
    let mut image = Image::new(display.size.0, display.size.1);
    let mut parts: Vec<(usize, _)> = file.layer_data.into_iter().enumerate().collect();
    parts.sort_by_key(|(i, _)| (*i != picture, *i));
    let window = parts.first().map(|(_, l)| (l.attributes.layer_position, l.size));
    for (i, layer) in parts {
        if window != Some((layer.attributes.layer_position, layer.size)) {
            continue;
        }
        let part = layer.attributes.layer_name.as_ref().map(string).filter(|_| i != picture);
        for channel in layer.channel_data.list {
            let mut name = string(&channel.name);
            if let Some(part) = part.as_ref().filter(|p| !name.starts_with(p.as_str())) {
                name = format!("{part}.{name}");
            }
            if image.channel(&name).is_none() {
                let data: Vec<f32> = channel.sample_data.values_as_f32().collect();
                let data = place(data, layer.attributes.layer_position, layer.size, &display);
                image.channels.push(Channel { name, data });
            }
        }
    }
    image.metadata = attributes::texts(bytes, picture);
    image.check().map_err(|_| ImageError::malformed(FORMAT, "it has no channel"))?;
    Ok(image)
}

/// The data window's values in the display window.
fn place(data: Vec<f32>, position: Vec2<i32>, size: Vec2<usize>, display: &IntegerBounds) -> Vec<f32> {
    if position == display.position && size == display.size {
        return data;
    }
    let mut out = vec![0.0; display.size.0 * display.size.1];
    let dx = i64::from(position.0) - i64::from(display.position.0);
    let dy = i64::from(position.1) - i64::from(display.position.1);
    for (y, row) in data.chunks_exact(size.0).enumerate() {
        let Ok(to) = usize::try_from(y as i64 + dy) else { continue };
        if to >= display.size.1 {
            break;
        }
        let skip = usize::try_from(-dx).unwrap_or(0).min(row.len());
        let start = usize::try_from(dx).unwrap_or(0).min(display.size.0);
        let count = (row.len() - skip).min(display.size.0 - start);
        let at = to * display.size.0 + start;
        out[at..at + count].copy_from_slice(&row[skip..skip + count]);
    }
    out
}
