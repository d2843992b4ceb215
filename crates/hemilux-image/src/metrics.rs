//! How far a picture is from its reference.
//!
//! The figure to quote is relMSE: the mean over pixels and channels of (p - r)² / (r² + 0.01 m²), with m the mean of
//! the whole reference over pixels and channels. Where two independent halves a, b of the reference are given, the
//! numerator is (p - a)(p - b), whose expectation is free of the reference's own noise; it can be negative in a
//! pixel. A larger reference is box-filtered by whole factors first. Non-finite values of the picture are counted and
//! then taken as 0.

use crate::buffer::Image;
use crate::error::ImageError;

/// What a picture is compared with.
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    /// The best estimate of the truth.
    pub image: &'a Image,
    /// Two independent estimates of the same truth.
    pub halves: Option<[&'a Image; 2]>,
    /// Pixels to use: those whose first channel, box-filtered like the rest, is above 254/255.
    pub mask: Option<&'a Image>,
}

impl<'a> Reference<'a> {
    /// A reference without halves and mask.
    #[must_use]
    pub fn new(image: &'a Image) -> Self {
        Self { image, halves: None, mask: None }
    }
}

/// The figures of one comparison; all over the pixels of the mask unless said otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// relMSE, with the halves in the numerator where given.
    pub relmse: f64,
    /// The same without the thousandth of pixels that are worst by `relmse_plain`.
    pub relmse_trimmed: f64,
    /// relMSE with the reference itself in the numerator.
    pub relmse_plain: f64,
    /// Mean of the picture over the mean of the reference, for red, green, blue.
    pub mean_ratio: [f64; 3],
    /// Non-finite values in the three channels of the whole picture.
    pub nonfinite: usize,
    /// Negative values there.
    pub negative: usize,
    /// Pixels the mask leaves out.
    pub left_out: usize,
    /// Mean squared error over pixels and channels.
    pub mse: f64,
    /// Its root.
    pub rmse: f64,
    /// Mean absolute error.
    pub mae: f64,
    /// 10 log₁₀(peak² / mse) in decibels; the peak is the largest value of the reference. Infinite for equal pictures.
    pub psnr: f64,
    /// Mean of |p - r| / (|p| + |r|), in 0..1; 0 where both are 0.
    pub smape: f64,
}

/// Which share of the pixels the trimmed figure keeps.
const KEPT: f64 = 0.999;

/// Compares a picture with its reference. Both are taken as linear; sRGB pictures are decoded first.
///
/// # Errors
/// A picture without colour, a reference whose size is no whole multiple of the picture's, or a mask that leaves
/// nothing.
pub fn compare(image: &Image, reference: &Reference) -> Result<Comparison, ImageError> {
    let size = (image.width, image.height);
    let mut picture = colour(image, size, "picture")?;
    let truth = colour(reference.image, size, "reference")?;
    let halves = match reference.halves {
        Some([a, b]) => Some((colour(a, size, "first half")?, colour(b, size, "second half")?)),
        None => None,
    };
    let used = used_pixels(reference.mask, size)?;

    let nonfinite = picture.iter().flatten().filter(|v| !v.is_finite()).count();
    picture.iter_mut().flatten().filter(|v| !v.is_finite()).for_each(|v| *v = 0.0);
    let negative = picture.iter().flatten().filter(|v| **v < 0.0).count();

    let mean = truth.iter().flatten().sum::<f64>() / (3 * truth.len()) as f64;
    let floor = 0.01 * mean * mean;
    let errors: Vec<(f64, f64)> = used
        .iter()
        .map(|&i| {
            let (mut plain, mut fair) = (0.0, 0.0);
            for c in 0..3 {
                let (p, r) = (picture[i][c], truth[i][c]);
                let weight = 1.0 / (r * r + floor);
                let numerator = (p - r) * (p - r);
                plain += numerator * weight;
                fair += halves.as_ref().map_or(numerator, |(a, b)| (p - a[i][c]) * (p - b[i][c])) * weight;
            }
            (plain / 3.0, fair / 3.0)
        })
        .collect();
    let n = errors.len() as f64;
    let mut sorted = errors.clone();
    sorted.sort_by(|x, y| x.0.total_cmp(&y.0));
    let kept = &sorted[..((n * KEPT) as usize).max(1)];

    let over = |f: &dyn Fn(f64, f64) -> f64| {
        let sum: f64 = used
            .iter()
            .flat_map(|&i| (0..3).map(move |c| (i, c)))
            .map(|(i, c)| f(picture[i][c], truth[i][c]))
            .sum();
        sum / (3.0 * n)
    };
    let total = |planes: &[[f64; 3]], c: usize| used.iter().map(|&i| planes[i][c]).sum::<f64>();
    let mse = over(&|p, r| (p - r) * (p - r));
    let peak = used.iter().flat_map(|&i| truth[i]).fold(f64::NEG_INFINITY, f64::max);
    Ok(Comparison {
        relmse: errors.iter().map(|e| e.1).sum::<f64>() / n,
        relmse_trimmed: kept.iter().map(|e| e.1).sum::<f64>() / kept.len() as f64,
        relmse_plain: errors.iter().map(|e| e.0).sum::<f64>() / n,
        mean_ratio: std::array::from_fn(|c| total(&picture, c) / total(&truth, c)),
        nonfinite,
        negative,
        left_out: image.len() - used.len(),
        mse,
        rmse: mse.sqrt(),
        mae: over(&|p, r| (p - r).abs()),
        psnr: 10.0 * (peak * peak / mse).log10(),
        smape: over(&|p, r| if p == r { 0.0 } else { (p - r).abs() / (p.abs() + r.abs()) }),
    })
}

/// Pixels whose luminance is above `times` the median of the 5 × 5 around them, and that are not so in the reference.
///
/// # Errors
/// As [`compare`].
pub fn fireflies(image: &Image, reference: &Image, times: f64) -> Result<Vec<[usize; 2]>, ImageError> {
    let size = (image.width, image.height);
    let stands_out = |image: &Image, what: &str| -> Result<Vec<bool>, ImageError> {
        let pixels = colour(image, size, what)?;
        let y: Vec<f64> = pixels.iter().map(|p| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]).collect();
        let around = |i: usize, n: usize| i.saturating_sub(2)..(i + 3).min(n);
        Ok((0..y.len())
            .map(|i| {
                let (column, row) = (i % size.0, i / size.0);
                let mut near: Vec<f64> = around(row, size.1)
                    .flat_map(|r| around(column, size.0).map(move |c| (r, c)))
                    .map(|(r, c)| y[r * size.0 + c])
                    .collect();
                let middle = near.len() / 2;
                y[i] > times * *near.select_nth_unstable_by(middle, f64::total_cmp).1
            })
            .collect())
    };
    let (picture, truth) = (stands_out(image, "picture")?, stands_out(reference, "reference")?);
    Ok((0..picture.len()).filter(|&i| picture[i] && !truth[i]).map(|i| [i % size.0, i / size.0]).collect())
}

/// The pixels of a picture at the given size, linear.
fn colour(image: &Image, size: (usize, usize), what: &str) -> Result<Vec<[f64; 3]>, ImageError> {
    let named = |e: ImageError| ImageError::unfit(format!("{what}: {}", e.reason));
    image.check().map_err(named)?;
    let mut linear = image.clone();
    linear.to_linear();
    let small = linear.box_filtered(size.0, size.1).map_err(named)?;
    let [r, g, b] = small.rgb().ok_or_else(|| ImageError::unfit(format!("{what}: no R, G, B or Y")))?;
    Ok((0..small.len()).map(|i| [r[i], g[i], b[i]].map(f64::from)).collect())
}

fn used_pixels(mask: Option<&Image>, size: (usize, usize)) -> Result<Vec<usize>, ImageError> {
    let Some(mask) = mask else { return Ok((0..size.0 * size.1).collect()) };
    let named = |e: ImageError| ImageError::unfit(format!("mask: {}", e.reason));
    mask.check().map_err(named)?;
    let first = mask.rgb().map_or(mask.channels[0].data.as_slice(), |planes| planes[0]);
    let codes = first.iter().map(|v| v * 255.0).collect();
    let small = Image::from_channel(mask.width, mask.height, "Y", codes)
        .box_filtered(size.0, size.1)
        .map_err(named)?;
    let used: Vec<usize> = (0..small.len()).filter(|&i| small.channels[0].data[i] > 254.0).collect();
    if used.is_empty() {
        return Err(ImageError::unfit("the mask leaves no pixel"));
    }
    Ok(used)
}
