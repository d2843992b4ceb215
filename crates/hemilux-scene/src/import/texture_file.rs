//! Image files as textures: linear bands of sRGB primaries, opacity beside them.

use crate::{Rgb, TextureImage};
use hemilux_image::{Format, Image, srgb};
use std::path::Path;

/// How 8- and 16-bit values encode light; files of floats are linear whatever is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    /// The sRGB curve.
    Srgb,
    /// None.
    Linear,
    /// A power.
    Gamma(f32),
}

impl Encoding {
    fn decode(self, v: f32) -> f32 {
        match self {
            Encoding::Srgb => srgb::decode(v),
            Encoding::Linear => v,
            Encoding::Gamma(g) => v.max(0.0).powf(g),
        }
    }
}

/// Decode an image; the error is half a sentence. Values must be finite; negative ones become 0.
pub fn decode(bytes: &[u8], path: &Path, encoding: Encoding) -> Result<TextureImage, String> {
    let image = hemilux_image::read_bytes(bytes, Format::from_path(path)).map_err(|e| e.to_string())?;
    from_image(&image, path, encoding)
}

fn from_image(image: &Image, path: &Path, encoding: Encoding) -> Result<TextureImage, String> {
    let [r, g, b] = image.rgb().ok_or("has neither R, G, B nor a single channel")?;
    let coded = image.encoding == hemilux_image::Encoding::Srgb;
    let band = |v: f32| if coded { encoding.decode(v) } else { v }.max(0.0);
    let texels: Vec<Rgb> =
        r.iter().zip(g).zip(b).map(|((&r, &g), &b)| Rgb::new(band(r), band(g), band(b))).collect();
    let finite = |v: &f32| v.is_finite();
    if ![r, g, b].iter().all(|c| c.iter().all(finite)) || !texels.iter().all(|t| t.is_finite()) {
        return Err("has values that are not finite".into());
    }
    let alpha = image.channel("A").filter(|a| a.iter().all(finite)).map(<[f32]>::to_vec);
    let size = |n: usize| u32::try_from(n).map_err(|_| "is too large".to_owned());
    Ok(TextureImage {
        width: size(image.width)?,
        height: size(image.height)?,
        texels,
        alpha,
        path: path.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemilux_image::Encoding as Coding;

    fn image(encoding: Coding, v: f32) -> Image {
        Image { encoding, ..Image::from_rgb(2, 1, &[[v, 0.0, 1.0], [0.25, -1.0, 2.0]]) }
    }

    #[test]
    fn coded_values_are_decoded_and_linear_ones_left_alone() {
        let first = |i: &Image, e| from_image(i, Path::new("x"), e).unwrap().texels[0][0];
        let coded = image(Coding::Srgb, 0.5);
        assert!((first(&coded, Encoding::Srgb) - 0.2140).abs() < 1e-4);
        assert_eq!(first(&coded, Encoding::Linear), 0.5);
        assert!((first(&coded, Encoding::Gamma(2.0)) - 0.25).abs() < 1e-6);
        assert_eq!(first(&image(Coding::Linear, 0.5), Encoding::Srgb), 0.5);
    }

    #[test]
    fn negative_values_are_cut_and_infinite_ones_refused() {
        let t = from_image(&image(Coding::Linear, 0.5), Path::new("x"), Encoding::Srgb).unwrap();
        assert_eq!((t.width, t.height, t.texels[1]), (2, 1, Rgb::new(0.25, 0.0, 2.0)));
        for v in [f32::NAN, f32::INFINITY] {
            assert!(from_image(&image(Coding::Linear, v), Path::new("x"), Encoding::Srgb).is_err());
        }
    }

    #[test]
    fn opacity_comes_along() {
        let mut i = image(Coding::Linear, 0.5);
        i.set_channel("A", vec![0.5, 1.0]);
        let t = from_image(&i, Path::new("x"), Encoding::Srgb).unwrap();
        assert_eq!(t.alpha, Some(vec![0.5, 1.0]));
    }
}
