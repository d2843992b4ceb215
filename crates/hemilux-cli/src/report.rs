//! `--report FILE`: what a render knows of its own errors, as JSON.

use crate::failure::Failure;
use hemilux::film::Film;
use hemilux_image::atomic;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::Path;

/// Noise of the picture: see `docs/cli.md` for the meaning of every key.
pub fn noise(film: &Film) -> Value {
    let (least, most) = film.samples();
    let (mut sum, mut variance, mut largest, mut dominated, mut pixels) = (0f64, 0f64, 0f64, 0u64, 0u64);
    film.for_each(|_, _, p| {
        let samples = p.samples() as f64;
        let (mean, error) = (p.mean().luminance() as f64, p.standard_error().luminance() as f64);
        pixels += 1;
        sum += mean;
        variance += error * error;
        let share = p.largest() as f64 / samples.max(1.0);
        largest = largest.max(share);
        dominated += (samples >= 4.0 && share > 0.5 * mean) as u64;
    });
    let of_mean = (sum > 0.0 && least >= 2).then(|| variance.sqrt() / sum);
    json!({
        "typical_relative_error_of_a_pixel": film.relative_error(),
        "relative_error_of_the_mean": of_mean,
        "firefly_index": if sum > 0.0 { json!(largest / sum) } else { Value::Null },
        "pixels_dominated_by_one_sample": dominated as f64 / pixels.max(1) as f64,
        "rejected_samples": film.rejected(),
        "samples_per_pixel": {"least": least, "most": most},
        "mean_luminance": sum / pixels.max(1) as f64,
    })
}

/// Write `report`, all or nothing.
pub fn write(path: &Path, report: &Value) -> Result<(), Failure> {
    let body = |out: &mut io::BufWriter<std::fs::File>| writeln!(out, "{report:#}");
    atomic::write(path, body).map_err(|e: io::Error| Failure::write(path, &e))
}
