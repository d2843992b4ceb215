//! `hemilux image diff`: how far a picture is from its reference.

use super::open;
use crate::args::{DiffArgs, Metric};
use crate::failure::{Failure, Kind};
use crate::{output, talk};
use hemilux_image::falsecolor::{FalseColor, Scale};
use hemilux_image::flip::{Flip, PIXELS_PER_DEGREE, hdr_flip, ldr_flip};
use hemilux_image::metrics::{Comparison, Reference, compare};
use hemilux_image::{Encoding, Format, Image, ImageError, atomic, png, write};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Compare and print; over the tolerance is exit code 5.
pub fn run(args: &DiffArgs) -> Result<(), Failure> {
    let output = args.output.as_deref().map(checked).transpose()?;
    let image = open(&args.image)?;
    let reference = open(&args.reference)?;
    let companions = Companions::find(args)?;
    let halves = companions.halves.as_ref();
    let whole =
        Reference { image: &reference, halves: halves.map(|h| [&h.0, &h.1]), mask: companions.mask.as_ref() };
    let figures = compare(&image, &whole)?;
    let mut truth = reference.clone();
    truth.to_linear();
    let truth = truth.box_filtered(image.width, image.height)?;
    let flip = flip(&image, &reference, &truth)?;
    if let Some((path, format)) = output {
        draw(path, format, &image, &truth, &flip)?;
    }
    let value = value(args.metric, &figures, &flip);
    let text = if args.json {
        as_json(args, &figures, &flip, value)
    } else {
        as_text(args, &companions, &figures, &flip)
    };
    talk::data(&text)?;
    within(args, value, figures.nonfinite)
}

/// Halves and mask: those named, else those that lie beside a file called reference.exr.
struct Companions {
    halves: Option<(Image, Image)>,
    mask: Option<Image>,
}

impl Companions {
    fn find(args: &DiffArgs) -> Result<Companions, Failure> {
        let beside = args.reference.file_name().is_some_and(|n| n == "reference.exr") && !args.no_companions;
        let folder = args.reference.parent().unwrap_or(Path::new(""));
        let exists = |name: &str| Some(folder.join(name)).filter(|p| beside && p.exists());
        let halves: Option<(PathBuf, PathBuf)> = match &args.halves {
            Some(list) => match list.as_slice() {
                [a, b] => Some((a.clone(), b.clone())),
                _ => return Err(Failure::usage("--halves wants two pictures: A,B")),
            },
            None => exists("reference_a.exr").zip(exists("reference_b.exr")),
        };
        let mask = args.mask.clone().or_else(|| exists("valid.png"));
        Ok(Companions {
            halves: halves.map(|(a, b)| Ok::<_, Failure>((open(&a)?, open(&b)?))).transpose()?,
            mask: mask.map(|m| open(&m)).transpose()?,
        })
    }
}

/// Pictures of 8 bits are compared as on a screen, others under a range of exposures.
fn flip(image: &Image, reference: &Image, truth: &Image) -> Result<Flip, Failure> {
    let on_screen = image.encoding == Encoding::Srgb && reference.encoding == Encoding::Srgb;
    let flip = if on_screen {
        ldr_flip(truth, image, PIXELS_PER_DEGREE)
    } else {
        let mut linear = image.clone();
        linear.to_linear();
        hdr_flip(truth, &linear, PIXELS_PER_DEGREE)
    };
    Ok(flip?)
}

fn value(metric: Metric, c: &Comparison, flip: &Flip) -> f64 {
    match metric {
        Metric::Relmse => c.relmse,
        Metric::Trimmed => c.relmse_trimmed,
        Metric::Plain => c.relmse_plain,
        Metric::Mse => c.mse,
        Metric::Rmse => c.rmse,
        Metric::Mae => c.mae,
        Metric::Smape => c.smape,
        Metric::Psnr => c.psnr,
        Metric::Flip => flip.mean,
    }
}

fn within(args: &DiffArgs, value: f64, nonfinite: usize) -> Result<(), Failure> {
    let Some(tolerance) = args.tolerance else { return Ok(()) };
    let good = if args.metric == Metric::Psnr { value >= tolerance } else { value <= tolerance };
    let name = format!("{:?}", args.metric).to_lowercase();
    if nonfinite > 0 {
        return Err(Failure::new(Kind::Tolerance, format!("{nonfinite} values are not finite")));
    }
    // A value that is no number is within no tolerance.
    if good {
        return Ok(());
    }
    let side = if args.metric == Metric::Psnr { "below" } else { "above" };
    Err(Failure::new(Kind::Tolerance, format!("{name} {value:.6e} is {side} the tolerance {tolerance}")))
}

fn as_json(args: &DiffArgs, c: &Comparison, flip: &Flip, value: f64) -> String {
    // JSON has no infinity: equal pictures have a psnr of null.
    let figures = json!({
        "relmse": c.relmse, "trimmed": c.relmse_trimmed, "plain": c.relmse_plain, "mean_ratio": c.mean_ratio,
        "mse": c.mse, "rmse": c.rmse, "mae": c.mae, "smape": c.smape, "psnr": c.psnr, "flip": flip.mean,
        "nonfinite": c.nonfinite, "negative": c.negative, "left_out": c.left_out,
        "metric": format!("{:?}", args.metric).to_lowercase(), "value": value, "tolerance": args.tolerance,
    });
    format!("{figures}\n")
}

fn as_text(args: &DiffArgs, companions: &Companions, c: &Comparison, flip: &Flip) -> String {
    let with = match (&companions.halves, &companions.mask) {
        (None, None) => "",
        (Some(_), None) => " (with halves)",
        (None, Some(_)) => " (with mask)",
        (Some(_), Some(_)) => " (with halves and mask)",
    };
    let [r, g, b] = c.mean_ratio;
    let kind = if flip.exposures.is_empty() { "screen" } else { "high range" };
    let mut out = format!(
        "{} against {}{with}\n\
         relMSE       {:.6e}  trimmed {:.6e}  plain {:.6e}\n\
         mean ratio   {r:.4} {g:.4} {b:.4}\n\
         FLIP         {:.5}  ({kind})\n\
         rmse         {:.6e}  mae {:.6e}  smape {:.5}  psnr {:.2} dB\n",
        args.image.display(),
        args.reference.display(),
        c.relmse,
        c.relmse_trimmed,
        c.relmse_plain,
        flip.mean,
        c.rmse,
        c.mae,
        c.smape,
        c.psnr
    );
    out += &format!(
        "counts       {} not finite, {} negative, {} left out\n",
        c.nonfinite, c.negative, c.left_out
    );
    out
}

fn checked(path: &Path) -> Result<(&Path, Format), Failure> {
    match Format::from_path(path) {
        Some(format @ (Format::Png | Format::Exr | Format::Hdr | Format::Pfm)) => {
            output::check_writable(path)?;
            Ok((path, format))
        }
        _ => Err(Failure::usage(format!(
            "{}: differences are written as .png, .exr, .hdr or .pfm",
            path.display()
        ))),
    }
}

fn draw(path: &Path, format: Format, image: &Image, truth: &Image, flip: &Flip) -> Result<(), Failure> {
    if format == Format::Png {
        let map = Image::from_channel(image.width, image.height, "Y", flip.map.clone());
        let show = FalseColor {
            max: Some(1.0),
            scale: Scale::Linear,
            units: "FLIP".into(),
            ..FalseColor::default()
        };
        let pixels = show.render(&map)?;
        atomic::write(path, |out| png::encode_rgb8(&pixels, &[], out)).map_err(|e: ImageError| e.at(path))?;
        return Ok(());
    }
    let mut linear = image.clone();
    linear.to_linear();
    let (Some(a), Some(b)) = (linear.rgb(), truth.rgb()) else {
        return Err(Failure::input("no R, G, B or Y to subtract"));
    };
    let mut difference = Image::new(image.width, image.height);
    for (name, (a, b)) in ["R", "G", "B"].into_iter().zip(a.into_iter().zip(b)) {
        difference.set_channel(name, a.iter().zip(b).map(|(a, b)| a - b).collect());
    }
    write(path, &difference)?;
    Ok(())
}
