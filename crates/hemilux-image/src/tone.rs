//! From radiance to something a screen can show: exposure, tone curve, sRGB transfer, 8 bits.
//!
//! Curves: `Clamp`; `Reinhard` (Reinhard et al., "Photographic tone reproduction for digital images", 2002, equation 4,
//! on luminance); `Hable` (Hable, "Uncharted 2: HDR lighting", GDC 2010); `Aces` (Narkowicz's fit of 2015 to the ACES
//! reference rendering transform). All map 0 to 0 and rise.

use crate::buffer::{Encoding, Image};
use crate::error::ImageError;
use crate::png::to_rgb8;
use crate::srgb::LUMINANCE;

/// Interleaved 8-bit pixels, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Rgb8 {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Red, green, blue of each pixel.
    pub data: Vec<u8>,
}

/// How bright the picture is made before the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Multiply by 2 to this power.
    Stops(f32),
    /// Bring the logarithmic mean of the positive luminances to this value (0.18 is a mid grey).
    LogAverage {
        /// The luminance the mean is brought to.
        key: f32,
    },
    /// Bring a percentile of the luminances to this value.
    Percentile {
        /// 0..100; 99 leaves out the brightest hundredth.
        percent: f32,
        /// The luminance it is brought to (1 is white).
        target: f32,
    },
}

/// How scene luminance becomes screen luminance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// Cut at 1.
    Clamp,
    /// L (1 + L/white²) / (1 + L): luminance `white` becomes 1; infinite white never quite does.
    Reinhard {
        /// The smallest luminance that is shown as white; must be positive.
        white: f32,
    },
    /// A film-like curve with toe and shoulder, white at 11.2.
    Hable,
    /// A film-like curve of strong contrast.
    Aces,
}

/// Exposure, curve and dithering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneMap {
    /// Before the curve.
    pub exposure: Exposure,
    /// The curve.
    pub curve: Curve,
    /// Adds a fixed pattern of half a code value before rounding, so that slow gradients do not band.
    pub dithered: bool,
}

impl Default for ToneMap {
    fn default() -> Self {
        Self { exposure: Exposure::Stops(0.0), curve: Curve::Clamp, dithered: false }
    }
}

impl Exposure {
    /// The factor this exposure means for a linear picture; 1 where the picture has no positive luminance.
    ///
    /// # Errors
    /// The picture has no colour, or a parameter is not usable.
    pub fn factor(self, image: &Image) -> Result<f32, ImageError> {
        if let Self::Stops(stops) = self {
            return Ok(stops.exp2());
        }
        image.check()?;
        let luminance = image.luminance().ok_or_else(|| ImageError::unfit("no R, G, B or Y to expose"))?;
        let mut positive: Vec<f32> = luminance.into_iter().filter(|v| *v > 0.0 && v.is_finite()).collect();
        let (level, target) = match self {
            Self::Stops(stops) => (1.0, stops.exp2()),
            Self::LogAverage { key } => {
                let sum: f64 = positive.iter().map(|v| f64::from(*v).ln()).sum();
                ((sum / positive.len().max(1) as f64).exp() as f32, key)
            }
            Self::Percentile { percent, target } => {
                if !(0.0..=100.0).contains(&percent) {
                    return Err(ImageError::unfit(format!("percentile {percent} is not in 0..100")));
                }
                positive.sort_unstable_by(f32::total_cmp);
                let index = (f64::from(percent) / 100.0 * positive.len().saturating_sub(1) as f64).round();
                (positive.get(index as usize).copied().unwrap_or(target), target)
            }
        };
        if !(target > 0.0 && target.is_finite()) {
            return Err(ImageError::unfit(format!("the exposure target {target} is not positive")));
        }
        Ok(if positive.is_empty() { 1.0 } else { target / level })
    }
}

fn hable(x: f32) -> f32 {
    let (a, b, c, d, e, f) = (0.15, 0.50, 0.10, 0.20, 0.02, 0.30);
    ((x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f)) - e / f
}

impl Curve {
    /// One pixel, linear in and linear out, not yet cut at 1; negative and NaN become 0.
    #[must_use]
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        // Far above any white all curves are flat; the bound keeps their squares finite.
        let rgb = rgb.map(|v| if v > 0.0 { v.min(1e15) } else { 0.0 });
        match self {
            Self::Clamp => rgb,
            Self::Reinhard { white } => {
                let l: f32 = rgb.iter().zip(LUMINANCE).map(|(v, w)| v * w).sum();
                let scale = (1.0 + l / (white * white)) / (1.0 + l);
                rgb.map(|v| v * scale)
            }
            Self::Hable => rgb.map(|v| hable(v.min(1e6)) / hable(11.2)),
            Self::Aces => {
                let fit = |x: f32| (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
                rgb.map(fit)
            }
        }
    }
}

impl ToneMap {
    /// The picture ready for [`crate::png::encode_rgb8`]. A picture in sRGB code values is decoded first.
    ///
    /// # Errors
    /// No picture among the channels, or a parameter is not usable.
    pub fn apply(&self, image: &Image) -> Result<Rgb8, ImageError> {
        image.check()?;
        if let Curve::Reinhard { white } = self.curve
            && (white.is_nan() || white <= 0.0)
        {
            return Err(ImageError::unfit(format!("Reinhard white {white} is not positive")));
        }
        let mut linear = image.clone();
        linear.to_linear();
        let factor = self.exposure.factor(&linear)?;
        let [r, g, b] = linear.rgb().ok_or_else(|| ImageError::unfit("no R, G, B or Y to tone map"))?;
        let map = |i: usize| self.curve.apply([r[i] * factor, g[i] * factor, b[i] * factor]);
        let pixels: Vec<[f32; 3]> = (0..linear.len()).map(map).collect();
        let mut shown = Image::from_rgb(image.width, image.height, &pixels);
        shown.encoding = Encoding::Linear;
        to_rgb8(&shown, self.dithered)
    }
}

/// A fixed pattern in (-1/2, 1/2) whose mean over any 8×8 block is 0: the Bayer matrix, from the bits of x⊕y and y
/// interleaved.
#[must_use]
pub fn dither(x: usize, y: usize) -> f32 {
    let mixed = x ^ y;
    let rank = (0..3).fold(0, |rank, bit| rank << 2 | (mixed >> bit & 1) << 1 | (y >> bit & 1));
    (rank as f32 + 0.5) / 64.0 - 0.5
}
