//! `hemilux image info`: format, size, channels, metadata, and what the values are like.

use super::open_with_format;
use crate::args::ImageInfoArgs;
use crate::failure::Failure;
use crate::talk;
use hemilux_image::{Encoding, Format, Image};
use serde_json::{Value, json};
use std::path::Path;

/// Print it for every picture.
pub fn run(args: &ImageInfoArgs) -> Result<(), Failure> {
    let mut list = Vec::new();
    for path in &args.images {
        let (image, format) = open_with_format(path)?;
        list.push(facts(path, &image, format));
    }
    let text = if args.json {
        let all = if list.len() == 1 { list.remove(0) } else { Value::Array(list) };
        format!("{all:#}\n")
    } else {
        list.iter().map(describe).collect::<Vec<_>>().join("\n")
    };
    talk::data(&text)
}

fn facts(path: &Path, image: &Image, format: Option<Format>) -> Value {
    let channels: Vec<Value> = image.channels.iter().map(|c| statistics(&c.name, &c.data)).collect();
    json!({
        "file": path.display().to_string(),
        "format": format.map(|f| format!("{f:?}").to_uppercase()),
        "width": image.width,
        "height": image.height,
        "encoding": if image.encoding == Encoding::Srgb { "sRGB" } else { "linear" },
        "channels": channels,
        "metadata": image.metadata.iter().map(|(k, v)| json!([k, v])).collect::<Vec<_>>(),
    })
}

/// Least, mean and largest finite value, and how many are not finite.
fn statistics(name: &str, data: &[f32]) -> Value {
    let (mut low, mut high, mut sum, mut n) = (f32::INFINITY, f32::NEG_INFINITY, 0f64, 0u64);
    for v in data.iter().filter(|v| v.is_finite()) {
        (low, high) = (low.min(*v), high.max(*v));
        sum += *v as f64;
        n += 1;
    }
    let some = |v: f64| (n > 0).then_some(v);
    json!({
        "name": name, "min": some(low as f64), "mean": some(sum / n.max(1) as f64), "max": some(high as f64),
        "nonfinite": data.len() as u64 - n,
    })
}

fn describe(facts: &Value) -> String {
    let text = |v: &Value| v.as_str().unwrap_or("?").to_owned();
    let mut out = format!(
        "{}: {}, {} x {} pixels, {}\n",
        text(&facts["file"]),
        text(&facts["format"]),
        facts["width"],
        facts["height"],
        text(&facts["encoding"])
    );
    out += &format!("  {:<16} {:>12} {:>12} {:>12}  not finite\n", "channel", "min", "mean", "max");
    for c in facts["channels"].as_array().into_iter().flatten() {
        let n = |key: &str| c[key].as_f64().map_or("-".to_owned(), |v| format!("{:>12}", short(v)));
        let (low, mean, high) = (n("min"), n("mean"), n("max"));
        out += &format!("  {:<16} {low:>12} {mean:>12} {high:>12}  {}\n", text(&c["name"]), c["nonfinite"]);
    }
    for entry in facts["metadata"].as_array().into_iter().flatten() {
        out += &format!("  {}: {}\n", text(&entry[0]), text(&entry[1]).replace('\n', "\n    "));
    }
    out
}

/// Six significant digits.
fn short(v: f64) -> String {
    let rounded: f64 = format!("{v:.5e}").parse().unwrap_or(v);
    if rounded != 0.0 && !(1e-4..1e7).contains(&rounded.abs()) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}
