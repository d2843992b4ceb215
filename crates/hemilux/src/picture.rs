//! From the film to an image: picture channels first, then the auxiliary ones, and what is to be known about them.

use crate::film::Film;
use hemilux_image::Image;

/// The image of a film's region. Channels: `R G B` (radiance times the film's scale), `stderr.R/G/B` (standard error of
/// the mean), `samples.N`, `albedo.R/G/B`, `N.X/Y/Z`, `depth.Z` (m). Only the picture itself has plain names: readers that take the unnamed layer for a picture
/// see nothing else there.
pub fn image(film: &Film, metadata: &[(String, String)]) -> Image {
    let [x0, x1, y0, y1] = film.region();
    let (width, height) = ((x1 - x0) as usize, (y1 - y0) as usize);
    const NAMES: [&str; 14] = [
        "R",
        "G",
        "B",
        "stderr.R",
        "stderr.G",
        "stderr.B",
        "samples.N",
        "albedo.R",
        "albedo.G",
        "albedo.B",
        "N.X",
        "N.Y",
        "N.Z",
        "depth.Z",
    ];
    let mut planes = vec![vec![0f32; width * height]; NAMES.len()];
    film.for_each(|x, y, pixel| {
        let i = (y - y0) as usize * width + (x - x0) as usize;
        let (mean, error, albedo) = (pixel.mean().0, pixel.standard_error().0, pixel.albedo().0);
        let values = mean
            .into_iter()
            .chain(error)
            .chain([pixel.samples() as f32])
            .chain(albedo)
            .chain(pixel.normal())
            .chain([pixel.depth()]);
        for (plane, v) in planes.iter_mut().zip(values) {
            plane[i] = v;
        }
    });
    let mut image = Image::new(width, height);
    for (name, data) in NAMES.iter().zip(planes) {
        image.set_channel(name, data);
    }
    for (key, value) in metadata {
        image.set_metadata(key, value.as_str());
    }
    image
}
