//! `hemilux image tonemap` and `falsecolor`: PNG files to look at.

use super::open;
use crate::args::{FalsecolorArgs, PaletteName, TonemapArgs};
use crate::failure::Failure;
use crate::{output, talk};
use hemilux_image::falsecolor::{FalseColor, Palette, Scale};
use hemilux_image::tone::Rgb8;
use hemilux_image::{Format, Image, ImageError, atomic, png};
use std::path::Path;

/// A picture as it would look on a screen.
pub fn tonemap(args: &TonemapArgs) -> Result<(), Failure> {
    check(&args.output)?;
    let image = open(&args.image)?;
    let (pixels, words) = output::on_screen(&image, &args.screen)?;
    save(&args.output, &pixels, &image, ("exposure", &words))?;
    if !args.talk.quiet {
        talk::line(&format!("wrote {} (exposure {words})", args.output.display()));
    }
    Ok(())
}

/// One quantity as colours.
pub fn falsecolor(args: &FalsecolorArgs) -> Result<(), Failure> {
    check(&args.output)?;
    let image = open(&args.image)?;
    let show = FalseColor {
        channel: args.channel.clone(),
        factor: args.factor,
        palette: match args.palette {
            PaletteName::Perceptual => Palette::Perceptual,
            PaletteName::Spectral => Palette::Spectral,
        },
        scale: if args.log { Scale::Log { decades: args.decades } } else { Scale::Linear },
        max: args.max,
        units: args.unit.clone(),
        legend: !args.no_legend,
    };
    let mut linear = image.clone();
    linear.to_linear();
    let pixels = show.render(&linear)?;
    let shown = args.channel.as_deref().unwrap_or("luminance");
    save(&args.output, &pixels, &image, ("falsecolor", &format!("{shown} x{}", args.factor)))?;
    if !args.talk.quiet {
        talk::line(&format!("wrote {}", args.output.display()));
    }
    Ok(())
}

fn check(path: &Path) -> Result<(), Failure> {
    if Format::from_path(path) != Some(Format::Png) {
        return Err(Failure::usage(format!("{}: this makes .png files", path.display())));
    }
    output::check_writable(path)
}

fn save(path: &Path, pixels: &Rgb8, image: &Image, done: (&str, &str)) -> Result<(), Failure> {
    let mut metadata = image.metadata.clone();
    metadata.push((done.0.to_owned(), done.1.to_owned()));
    atomic::write(path, |out| png::encode_rgb8(pixels, &metadata, out))
        .map_err(|e: ImageError| e.at(path))?;
    Ok(())
}
