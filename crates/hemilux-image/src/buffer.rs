//! The picture in memory: planar `f32` channels with names, and text metadata in order.
//!
//! Invariant kept by every constructor and reader: each channel holds `width * height` values, row by row from the
//! top left. The fields are public, so functions that take an image check it ([`Image::check`]) instead of trusting.

use crate::error::ImageError;
use crate::srgb;

/// One named plane of values.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name as in OpenEXR: `R`, `G`, `B`, `A`, `Y`, `Z`, or with a layer before a dot: `albedo.R`.
    pub name: String,
    /// `width * height` values, row by row from the top left.
    pub data: Vec<f32>,
}

/// How the values of `R`, `G`, `B` and `Y` are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Encoding {
    /// Proportional to light.
    #[default]
    Linear,
    /// Code values (0..1) of the sRGB transfer function, as 8-bit files hold them.
    Srgb,
}

/// Planar `f32` picture with named channels and ordered metadata.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Image {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// The channels, in any order.
    pub channels: Vec<Channel>,
    /// Text by key, in order; keys may repeat.
    pub metadata: Vec<(String, String)>,
    /// How colour is coded.
    pub encoding: Encoding,
}

/// Layers that hold the picture itself when there is no plain `R`, `G`, `B`; lower case, in order of preference.
const PICTURE_LAYERS: [&str; 8] =
    ["combined", "beauty", "rgba", "rgb", "color", "colour", "image", "default"];

impl Image {
    /// A picture without channels.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// A linear picture of `R`, `G`, `B` from interleaved pixels; missing pixels are black, surplus ones dropped.
    #[must_use]
    pub fn from_rgb(width: usize, height: usize, pixels: &[[f32; 3]]) -> Self {
        let mut image = Self::new(width, height);
        for (i, name) in ["R", "G", "B"].into_iter().enumerate() {
            let mut data: Vec<f32> = pixels.iter().take(width * height).map(|p| p[i]).collect();
            data.resize(width * height, 0.0);
            image.channels.push(Channel { name: name.to_owned(), data });
        }
        image
    }

    /// A linear picture of one channel; the data are cut or filled with zeros to fit.
    #[must_use]
    pub fn from_channel(width: usize, height: usize, name: &str, mut data: Vec<f32>) -> Self {
        data.resize(width * height, 0.0);
        let mut image = Self::new(width, height);
        image.channels.push(Channel { name: name.to_owned(), data });
        image
    }

    /// Number of pixels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.width * self.height
    }

    /// Whether there is no pixel or no channel.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0 || self.channels.is_empty()
    }

    /// That there are pixels and channels, and every channel has one value per pixel.
    ///
    /// # Errors
    /// [`Reason::Unfit`](crate::Reason::Unfit) naming the channel that does not fit.
    pub fn check(&self) -> Result<(), ImageError> {
        if self.is_empty() {
            return Err(ImageError::unfit("the picture is empty"));
        }
        let pixels = self.width.checked_mul(self.height);
        match self.channels.iter().find(|c| Some(c.data.len()) != pixels) {
            Some(c) => Err(ImageError::unfit(format!(
                "channel {} has {} values, not {} x {}",
                c.name,
                c.data.len(),
                self.width,
                self.height
            ))),
            None => Ok(()),
        }
    }

    /// The values of the channel with exactly this name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.data.as_slice())
    }

    /// Adds or replaces a channel; the data are cut or filled with zeros to fit.
    pub fn set_channel(&mut self, name: &str, mut data: Vec<f32>) {
        data.resize(self.len(), 0.0);
        match self.channels.iter_mut().find(|c| c.name == name) {
            Some(channel) => channel.data = data,
            None => self.channels.push(Channel { name: name.to_owned(), data }),
        }
    }

    /// One value; none outside or without the channel.
    #[must_use]
    pub fn get(&self, name: &str, x: usize, y: usize) -> Option<f32> {
        if x >= self.width {
            return None;
        }
        self.channel(name)?.get(y * self.width + x).copied()
    }

    /// Sets one value; false outside or without the channel.
    pub fn set(&mut self, name: &str, x: usize, y: usize, value: f32) -> bool {
        if x >= self.width {
            return false;
        }
        let index = y * self.width + x;
        let slot = self.channels.iter_mut().find(|c| c.name == name).and_then(|c| c.data.get_mut(index));
        slot.map(|v| *v = value).is_some()
    }

    /// The three planes of the picture: `R`, `G`, `B`; or a grey plane three times (`Y`, or the only channel); or the
    /// `R`, `G`, `B` of a layer, preferably one called combined, beauty, rgba, rgb, color, image or default.
    #[must_use]
    pub fn rgb(&self) -> Option<[&[f32]; 3]> {
        let names: Vec<&str> = self.channels.iter().map(|c| c.name.as_str()).collect();
        let indices = picture_channels(&names)?;
        Some(indices.map(|i| self.channels[i].data.as_slice()))
    }

    /// Red, green and blue of one pixel, by the rules of [`Image::rgb`].
    #[must_use]
    pub fn rgb_at(&self, x: usize, y: usize) -> Option<[f32; 3]> {
        if x >= self.width {
            return None;
        }
        let i = y * self.width + x;
        let [r, g, b] = self.rgb()?;
        Some([*r.get(i)?, *g.get(i)?, *b.get(i)?])
    }

    /// Luminance with the Rec. 709 weights, of the values as they are (decode sRGB first).
    #[must_use]
    pub fn luminance(&self) -> Option<Vec<f32>> {
        let [r, g, b] = self.rgb()?;
        let [wr, wg, wb] = srgb::LUMINANCE;
        Some(r.iter().zip(g).zip(b).map(|((r, g), b)| wr * r + wg * g + wb * b).collect())
    }

    /// The value of the first metadata entry with this key.
    #[must_use]
    pub fn metadata_value(&self, key: &str) -> Option<&str> {
        self.metadata.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    /// Replaces the first entry with this key, or appends one.
    pub fn set_metadata(&mut self, key: &str, value: impl Into<String>) {
        match self.metadata.iter_mut().find(|(k, _)| k == key) {
            Some((_, old)) => *old = value.into(),
            None => self.metadata.push((key.to_owned(), value.into())),
        }
    }

    /// Decodes sRGB code values to light, in colour and grey channels but not in alpha; a linear picture stays.
    pub fn to_linear(&mut self) {
        if self.encoding == Encoding::Srgb {
            for channel in self.channels.iter_mut().filter(|c| is_colour(&c.name)) {
                channel.data.iter_mut().for_each(|v| *v = srgb::decode(*v));
            }
            self.encoding = Encoding::Linear;
        }
    }

    /// The picture shrunk to `width` × `height` by the mean of whole blocks, summed in `f64`.
    ///
    /// # Errors
    /// When the new size does not divide the old one, or a channel does not fit.
    pub fn box_filtered(&self, width: usize, height: usize) -> Result<Self, ImageError> {
        self.check()?;
        if width == 0
            || height == 0
            || !self.width.is_multiple_of(width)
            || !self.height.is_multiple_of(height)
        {
            return Err(ImageError::unfit(format!(
                "sizes do not fit: {} x {} is no whole multiple of {width} x {height}",
                self.width, self.height
            )));
        }
        let (fx, fy) = (self.width / width, self.height / height);
        if (fx, fy) == (1, 1) {
            return Ok(self.clone());
        }
        let shrink = |data: &[f32]| {
            let mut out = Vec::with_capacity(width * height);
            for y in 0..height {
                for x in 0..width {
                    let rows = (y * fy..(y + 1) * fy).map(|row| row * self.width + x * fx);
                    let sum: f64 = rows.flat_map(|i| &data[i..i + fx]).map(|&v| f64::from(v)).sum();
                    out.push((sum / (fx * fy) as f64) as f32);
                }
            }
            out
        };
        let channels =
            self.channels.iter().map(|c| Channel { name: c.name.clone(), data: shrink(&c.data) }).collect();
        Ok(Self { width, height, channels, metadata: self.metadata.clone(), encoding: self.encoding })
    }
}

/// Whether a channel holds colour or grey, by the last part of its name.
fn is_colour(name: &str) -> bool {
    matches!(name.rsplit('.').next().unwrap_or(name), "R" | "G" | "B" | "Y")
}

/// Which channels make the picture, by the rules of [`Image::rgb`].
pub(crate) fn picture_channels(names: &[&str]) -> Option<[usize; 3]> {
    let find = |name: &str| {
        let exact = names.iter().position(|n| *n == name);
        exact.or_else(|| names.iter().position(|n| n.eq_ignore_ascii_case(name)))
    };
    let triple = |prefix: &str| -> Option<[usize; 3]> {
        Some([find(&format!("{prefix}R"))?, find(&format!("{prefix}G"))?, find(&format!("{prefix}B"))?])
    };
    if let Some(found) = triple("") {
        return Some(found);
    }
    if let Some(y) = find("Y").or((names.len() == 1).then_some(0)) {
        return Some([y; 3]);
    }
    let layers: Vec<&str> = names
        .iter()
        .filter_map(|n| n.strip_suffix('R').or(n.strip_suffix('r')))
        .filter(|p| p.ends_with('.') && triple(p).is_some())
        .collect();
    let rank = |prefix: &str| {
        let last = prefix.trim_end_matches('.').rsplit('.').next().unwrap_or("").to_ascii_lowercase();
        PICTURE_LAYERS.iter().position(|l| *l == last).unwrap_or(PICTURE_LAYERS.len())
    };
    layers.into_iter().min_by_key(|p| rank(p)).and_then(triple)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_is_found_under_many_names() {
        assert_eq!(picture_channels(&["B", "G", "R", "albedo.R"]), Some([2, 1, 0]));
        assert_eq!(picture_channels(&["b", "g", "r"]), Some([2, 1, 0]));
        assert_eq!(picture_channels(&["A", "Y"]), Some([1, 1, 1]));
        assert_eq!(picture_channels(&["depth"]), Some([0, 0, 0]));
        assert_eq!(picture_channels(&["N.X", "N.Y"]), None);
        let blender =
            ["V.Albedo.B", "V.Albedo.G", "V.Albedo.R", "V.Combined.B", "V.Combined.G", "V.Combined.R"];
        assert_eq!(picture_channels(&blender), Some([5, 4, 3]));
        assert_eq!(picture_channels(&blender[..3]), Some([2, 1, 0]));
    }

    #[test]
    fn box_filter_takes_means_of_whole_blocks() {
        let image = Image::from_channel(4, 2, "Y", vec![1.0, 3.0, 0.0, 0.0, 5.0, 7.0, 0.0, 8.0]);
        let small = image.box_filtered(2, 1).unwrap();
        assert_eq!(small.channels[0].data, [4.0, 2.0]);
        assert!(image.box_filtered(3, 1).is_err());
        assert!(image.box_filtered(8, 2).is_err());
        assert!(image.box_filtered(0, 1).is_err());
    }

    #[test]
    fn pixels_outside_are_none_and_short_channels_are_errors() {
        let mut image = Image::from_rgb(2, 2, &[[1.0, 2.0, 3.0]; 3]);
        assert_eq!(image.rgb_at(1, 1), Some([0.0; 3]));
        assert_eq!(image.rgb_at(2, 0), None);
        assert_eq!(image.get("R", 0, 2), None);
        assert!(image.set("G", 1, 1, 9.0) && !image.set("G", 2, 0, 9.0) && !image.set("Q", 0, 0, 9.0));
        assert_eq!(image.get("G", 1, 1), Some(9.0));
        let white = image.luminance().unwrap();
        assert!((white[3] - 9.0 * 0.715_169).abs() < 1e-5);
        image.channels[1].data.pop();
        assert!(image.check().unwrap_err().to_string().contains("channel G has 3 values"));
        assert!(Image::new(0, 3).check().is_err());
    }

    #[test]
    fn alpha_is_not_decoded() {
        let mut image = Image::from_channel(1, 1, "Y", vec![0.5]);
        image.set_channel("A", vec![0.5]);
        image.encoding = Encoding::Srgb;
        image.to_linear();
        assert!((image.channels[0].data[0] - 0.214).abs() < 1e-3);
        assert_eq!(image.channels[1].data, [0.5]);
        image.to_linear();
        assert!((image.channels[0].data[0] - 0.214).abs() < 1e-3);
    }
}
