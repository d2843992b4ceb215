//! Every writer with its reader, the traps of the headers, and damaged files.

use hemilux_image::exr::Compression;
use hemilux_image::{Encoding, Format, Image, Reason, encode, exr, hdr, probe, read, read_bytes};
use proptest::prelude::*;

/// A picture with values over many magnitudes, from a fixed formula.
fn sample(width: usize, height: usize) -> Image {
    let value = |i: usize, c: usize| {
        let h = ((i * 3 + c) as u32).wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(0x9e37_79b9);
        (h as f32 / u32::MAX as f32) * 2.0_f32.powi((h % 17) as i32 - 8)
    };
    let pixels: Vec<[f32; 3]> = (0..width * height).map(|i| std::array::from_fn(|c| value(i, c))).collect();
    Image::from_rgb(width, height, &pixels)
}

fn with_aovs(width: usize, height: usize) -> Image {
    let mut image = sample(width, height);
    let n = image.len();
    image.set_channel("samples", (0..n).map(|i| i as f32).collect());
    image.set_channel("stderr.R", (0..n).map(|i| 1.0 / (i + 1) as f32).collect());
    image.set_channel("N.X", vec![f32::NEG_INFINITY; n]);
    image.set_channel("Z", (0..n).map(|i| -(i as f32)).collect());
    image.set_metadata("command line", "render box.pbrt --seed 7");
    image.set_metadata("zzz", "first");
    image.set_metadata("aaa", "Größe 3 µm");
    image
}

#[test]
fn exr_keeps_every_bit_name_and_text_with_every_compression() {
    let image = with_aovs(37, 19);
    for compression in [Compression::None, Compression::Piz, Compression::Zip] {
        let mut bytes = Vec::new();
        exr::encode_with(&image, compression, &mut bytes).unwrap();
        let back = read_bytes(&bytes, None).unwrap();
        assert_eq!((back.width, back.height, back.channels.len()), (37, 19, 7));
        let names: Vec<&str> = back.channels.iter().map(|c| c.name.as_str()).collect();
        assert!(names.is_sorted(), "{names:?}");
        for channel in &image.channels {
            let got = back.channel(&channel.name).unwrap();
            assert!(
                got.iter().zip(&channel.data).all(|(a, b)| a.to_bits() == b.to_bits()),
                "{}",
                channel.name
            );
        }
        assert_eq!(back.metadata, image.metadata);
        let mut again = Vec::new();
        exr::encode_with(&image, compression, &mut again).unwrap();
        assert!(bytes == again, "the same picture must give the same bytes");
    }
}

#[test]
fn exr_metadata_with_reserved_or_repeated_keys_stays_readable() {
    let mut image = sample(4, 3);
    for (k, v) in [("channels", "x"), ("view", "y"), ("owner", "me"), ("VIEW", "a"), ("VIEW", "b")] {
        image.metadata.push((k.into(), v.into()));
    }
    for (k, v) in [("comments", "c"), ("software", "s"), ("empty", "")] {
        image.metadata.push((k.into(), v.into()));
    }
    let back = read_bytes(&encode(&image, Format::Exr).unwrap(), None).unwrap();
    let pairs: Vec<(&str, &str)> = back.metadata.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect();
    let want = [("metadata.channels", "x"), ("metadata.view", "y"), ("owner", "me"), ("VIEW", "a\nb")];
    assert_eq!(pairs[..4], want);
    assert_eq!(pairs[4..], [("comments", "c"), ("software", "s"), ("empty", "")]);
    image.metadata = vec![("k".repeat(256), "v".into())];
    assert!(matches!(encode(&image, Format::Exr).unwrap_err().reason, Reason::Unfit(_)));
    image.metadata = vec![("k".repeat(200), "v".into())];
    assert_eq!(read_bytes(&encode(&image, Format::Exr).unwrap(), None).unwrap().metadata, image.metadata);
}

#[test]
fn exr_of_several_parts_and_kinds_of_numbers_shows_its_picture() {
    use ::exr::prelude::*;
    let channel = |name: &str, data: FlatSamples| AnyChannel::new(name, data);
    let ramp = |k: f32| (0..6).map(|i| i as f32 * k).collect::<Vec<f32>>();
    let half = |k: f32| FlatSamples::F16(ramp(k).into_iter().map(f16::from_f32).collect());
    let layer = |name: &str, list: Vec<AnyChannel<FlatSamples>>| {
        let encoding = ::exr::image::Encoding::SMALL_LOSSLESS;
        Layer::new((3, 2), LayerAttributes::named(name), encoding, AnyChannels::sort(list.into()))
    };
    let bytes = |layers: Vec<Layer<AnyChannels<FlatSamples>>>, window: IntegerBounds| {
        let mut out = std::io::Cursor::new(Vec::new());
        ::exr::image::Image::from_layers(ImageAttributes::new(window), layers)
            .write()
            .to_buffered(&mut out)
            .unwrap();
        out.into_inner()
    };
    let normals = layer("normals", vec![channel("X", FlatSamples::F32(ramp(1.0))), channel("Q", half(0.5))]);
    let names = ["V.Combined.R", "V.Combined.G", "V.Combined.B"];
    let mut list: Vec<_> = names.iter().zip([0.5, 1.0, 2.0]).map(|(n, k)| channel(n, half(k))).collect();
    list.push(channel("id", FlatSamples::U32(vec![7; 6])));
    let mut picture = layer("picture", list);
    picture.attributes.other.insert(Text::from("note"), AttributeValue::Text(Text::from("of the picture")));
    let file = bytes(vec![normals, picture], IntegerBounds::from_dimensions((3, 2)));
    let image = read_bytes(&file, None).unwrap();
    assert_eq!(image.rgb_at(2, 1), Some([2.5, 5.0, 10.0]));
    assert_eq!((image.get("id", 0, 0), image.get("normals.X", 1, 1)), (Some(7.0), Some(4.0)));
    assert_eq!(image.metadata_value("note"), Some("of the picture"));
    assert_eq!(hemilux_image::read::probe_bytes(&file, None).unwrap().channels.len(), 4);

    // The data at (-1, 1) of a display window of 3 × 4 that begins at (0, 0): two columns are seen, two rows are empty.
    let mut cropped = layer("Y", vec![channel("Y", FlatSamples::F32(ramp(1.0)))]);
    cropped.attributes.layer_position = Vec2(-1, 1);
    let image = read_bytes(&bytes(vec![cropped], IntegerBounds::from_dimensions((3, 4))), None).unwrap();
    let rows = [0.0, 0.0, 0.0, 1.0, 2.0, 0.0, 4.0, 5.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!((image.width, image.height, image.channel("Y")), (3, 4, Some(&rows[..])));
}

#[test]
fn what_cannot_be_written_is_refused() {
    let mut twice = sample(2, 2);
    twice.channels.push(twice.channels[0].clone());
    assert!(encode(&twice, Format::Exr).unwrap_err().to_string().contains("two channels are called R"));
    let mut short = sample(2, 2);
    short.channels[2].data.clear();
    let no_picture = {
        let mut image = Image::from_channel(2, 2, "N.X", vec![0.0; 4]);
        image.set_channel("N.Y", vec![0.0; 4]);
        image
    };
    for format in [Format::Exr, Format::Hdr, Format::Pfm, Format::Png] {
        assert!(encode(&short, format).is_err());
        assert!(encode(&Image::new(0, 0), format).is_err());
        assert_eq!(encode(&no_picture, format).is_ok(), format == Format::Exr);
    }
    assert!(encode(&sample(2, 2), Format::Jpeg).is_err());
}

#[test]
fn png_gives_back_the_nearest_code_and_the_text() {
    let mut image = Image::from_rgb(3, 1, &[[0.0, 0.5, 1.0], [-1.0, 2.0, f32::NAN], [0.2, 0.02, 0.002]]);
    image.set_metadata("seed", "7");
    image.set_metadata("title", "λ = 555 nm");
    image.set_metadata("  bad\u{7}key  ", "x");
    let mut back = read_bytes(&encode(&image, Format::Png).unwrap(), None).unwrap();
    assert_eq!(back.encoding, Encoding::Srgb);
    assert_eq!(back.metadata_value("seed"), Some("7"));
    assert_eq!(back.metadata_value("title"), Some("λ = 555 nm"));
    assert_eq!(back.metadata_value("bad key"), Some("x"));
    assert_eq!(back.rgb_at(0, 0), Some([0.0, 188.0 / 255.0, 1.0]));
    assert_eq!(back.rgb_at(1, 0), Some([0.0, 1.0, 0.0]));
    // Code values survive another round as they are.
    let again = read_bytes(&encode(&back, Format::Png).unwrap(), None).unwrap();
    assert_eq!(again.channels, back.channels);
    back.to_linear();
    assert!((back.rgb_at(2, 0).unwrap()[0] - 0.2).abs() < 0.004);
}

/// A PNG of any colour type and depth, by the encoder of the `png` crate.
fn raw_png(color: png::ColorType, depth: png::BitDepth, data: &[u8], linear: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![255, 0, 0, 0, 51, 255]);
        encoder.set_trns(vec![255, 0]);
    }
    if linear {
        encoder.set_source_gamma(png::ScaledFloat::from_scaled(100_000));
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn png_of_every_kind_is_read() {
    use png::BitDepth::{Eight, One, Sixteen};
    use png::ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgba};
    let grey = read_bytes(&raw_png(Grayscale, One, &[0b0100_0000], false), None).unwrap();
    assert_eq!(grey.channel("Y"), Some(&[0.0, 1.0][..]));
    let wide =
        read_bytes(&raw_png(GrayscaleAlpha, Sixteen, &[0x80, 0, 255, 255, 0, 1, 0, 0], true), None).unwrap();
    assert_eq!(wide.channel("Y"), Some(&[32768.0 / 65535.0, 1.0 / 65535.0][..]));
    assert_eq!(wide.channel("A"), Some(&[1.0, 0.0][..]));
    assert_eq!((wide.encoding, grey.encoding), (Encoding::Linear, Encoding::Srgb));
    let palette = read_bytes(&raw_png(Indexed, Eight, &[1, 0], false), None).unwrap();
    assert_eq!(palette.rgb_at(0, 0), Some([0.0, 0.2, 1.0]));
    assert_eq!(palette.channel("A"), Some(&[0.0, 1.0][..]));
    let rgba = read_bytes(&raw_png(Rgba, Eight, &[1, 2, 3, 4, 5, 6, 7, 8], false), None).unwrap();
    assert_eq!(rgba.channels.len(), 4);
    assert_eq!(rgba.get("A", 1, 0), Some(8.0 / 255.0));
}

/// JPEG and TGA from the encoders of the `image` crate.
fn raster_bytes(format: image::ImageFormat) -> Vec<u8> {
    let picture = image::RgbImage::from_fn(16, 8, |x, _| image::Rgb([200, 100, (x * 2) as u8]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

#[test]
fn jpeg_and_tga_are_read_as_srgb() {
    let jpeg = read_bytes(&raster_bytes(image::ImageFormat::Jpeg), None).unwrap();
    let tga_bytes = raster_bytes(image::ImageFormat::Tga);
    let tga = read_bytes(&tga_bytes, Some(Format::Tga)).unwrap();
    assert!(matches!(read_bytes(&tga_bytes, None).unwrap_err().reason, Reason::UnknownFormat));
    for image in [&jpeg, &tga] {
        assert_eq!((image.width, image.height, image.encoding), (16, 8, Encoding::Srgb));
        let [r, g, b] = image.rgb_at(5, 3).unwrap().map(|v| v * 255.0);
        assert!((r - 200.0).abs() < 8.0 && (g - 100.0).abs() < 8.0 && (b - 10.0).abs() < 12.0, "{r} {g} {b}");
    }
    assert_eq!(tga.rgb_at(5, 3).map(|p| p.map(|v| (v * 255.0).round())), Some([200.0, 100.0, 10.0]));
}

fn hdr_file(header: &str, pixels: &[u8]) -> Vec<u8> {
    [b"#?RADIANCE\n", header.as_bytes(), pixels].concat()
}

#[test]
fn hdr_headers_are_understood() {
    let text = "rpict -vf a.vf box.oct\nSOFTWARE= RADIANCE\nVIEW= -vp 1 2 3\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\
                VIEW= -vh 40\nEXPOSURE=0.25\nCOLORCORR=1 2 4\nPRIMARIES= .64 .33 .3 .6 .15 .06 .3127 .329\n\n-Y 1 +X 2\n";
    let mut image = read_bytes(&hdr_file(text, &[128, 64, 0, 129, 128, 128, 128, 128]), None).unwrap();
    let find =
        |k: &str| image.metadata.iter().filter(|(n, _)| n == k).map(|(_, v)| v.as_str()).collect::<Vec<_>>();
    assert_eq!(find("VIEW"), ["-vp 1 2 3", "-vh 40"]);
    assert_eq!(find("EXPOSURE"), ["0.5"]);
    assert_eq!(find("COMMAND"), ["rpict -vf a.vf box.oct"]);
    // Mantissa 128 of 256 at exponent 129 - 128 is 1, in the middle of a step of 1/128.
    let half = 0.5 / 128.0;
    assert_eq!(image.rgb_at(0, 0), Some([1.0 + half, 0.5 + half, half]));
    hdr::undo_exposure(&mut image);
    assert_eq!(image.rgb_at(0, 0), Some([(1.0 + half) / 0.5, 0.5 + half, half / 2.0]));
    assert_eq!(image.metadata_value("EXPOSURE"), None);
}

#[test]
fn hdr_traps() {
    let flat = [1_u8, 2, 3, 128, 4, 5, 6, 128];
    let good = read_bytes(&hdr_file("\n-Y 1 +X 2\n", &flat), None);
    assert!(good.is_ok(), "a header without FORMAT is common");
    for bad in [
        "\n-Y 1 +Y 2\n",
        "\n-Y 1 +X\n",
        "\n-Y -1 +X 2\n",
        "\n-Y 0 +X 2\n",
        "\n1 2\n",
        "\n-Y 1 +X 2 -Z 3\n",
        "EXPOSURE=x\n\n-Y 1 +X 2\n",
        "EXPOSURE=0\n\n-Y 1 +X 2\n",
        "EXPOSURE=nan\n\n-Y 1 +X 2\n",
        "FORMAT=ascii\n\n-Y 1 +X 2\n",
        "-Y 1 +X 2\n",
        "\n-Y 1 +X 3\n",
        "\n-Y 99999 +X 99999\n",
        "\n-Y 18446744073709551615 +X 2\n",
    ] {
        assert!(read_bytes(&hdr_file(bad, &flat), None).is_err(), "{bad:?}");
    }
    // New-style scanlines: a run over the end, a count of 0, another length than the header's.
    let head = "\n-Y 1 +X 8\n";
    for bad in [&[2, 2, 0, 8, 137, 5][..], &[2, 2, 0, 8, 0, 5], &[2, 2, 0, 9, 136, 5], &[2, 2, 0, 8, 9]] {
        let bytes = [bad, &[136, 5, 136, 5, 136, 128, 0, 0]].concat();
        assert!(read_bytes(&hdr_file(head, &bytes), None).is_err(), "{bad:?}");
    }
    // Old-style runs: 1,1,1,n then shifted by 8; a run without a pixel before it.
    let run = [9_u8, 9, 9, 130, 1, 1, 1, 2, 1, 1, 1, 1];
    let image = read_bytes(&hdr_file("\n-Y 1 +X 259\n", &run), None).unwrap();
    let first = image.rgb_at(0, 0);
    assert!(first.unwrap()[0] > 0.0 && (0..259).all(|x| image.rgb_at(x, 0) == first));
    assert!(read_bytes(&hdr_file("\n-Y 1 +X 258\n", &run), None).is_err());
    assert!(read_bytes(&hdr_file("\n-Y 1 +X 2\n", &[1, 1, 1, 2, 9, 9, 9, 130]), None).is_err());
}

#[test]
fn hdr_in_all_eight_orders() {
    // Pixel (x, y) of 3 × 2 has mantissa 10 x + y + 128.
    let code = |x: usize, y: usize| (128 + 10 * x + y) as u8;
    for (y_sign, x_sign, columns) in [
        ('-', '+', false),
        ('-', '-', false),
        ('+', '+', false),
        ('+', '-', false),
        ('-', '+', true),
        ('-', '-', true),
        ('+', '+', true),
        ('+', '-', true),
    ] {
        let mut xs: Vec<usize> = (0..3).collect();
        let mut ys: Vec<usize> = (0..2).collect();
        if x_sign == '-' {
            xs.reverse();
        }
        if y_sign == '+' {
            ys.reverse();
        }
        let mut pixels = Vec::new();
        if columns {
            xs.iter().for_each(|&x| ys.iter().for_each(|&y| pixels.extend([code(x, y), 0, 0, 136])));
        } else {
            ys.iter().for_each(|&y| xs.iter().for_each(|&x| pixels.extend([code(x, y), 0, 0, 136])));
        }
        let size =
            if columns { format!("{x_sign}X 3 {y_sign}Y 2") } else { format!("{y_sign}Y 2 {x_sign}X 3") };
        let image = read_bytes(&hdr_file(&format!("\n{size}\n"), &pixels), None).unwrap();
        assert_eq!((image.width, image.height), (3, 2));
        for (x, y) in (0..6).map(|i| (i % 3, i / 3)) {
            assert_eq!(image.get("R", x, y), Some(f32::from(code(x, y)) + 0.5), "{size}");
        }
    }
}

#[test]
fn xyze_white_becomes_grey_in_watts() {
    // 179 cd/m² of equal-energy white is 1 W/(sr m²) of each Radiance primary.
    let [m, _, _, e] = hdr::pack([179.0; 3]);
    let text = "FORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n";
    let [r, g, b] = read_bytes(&hdr_file(text, &[m, m, m, e]), None).unwrap().rgb_at(0, 0).unwrap();
    for v in [r, g, b] {
        assert!((v - 1.0).abs() < 0.005, "{r} {g} {b}");
    }
    let bad = "FORMAT=32-bit_rle_xyze\nPRIMARIES=.3 .3 .3 .3 .3 .3 .3 .3\n\n-Y 1 +X 1\n";
    assert!(read_bytes(&hdr_file(bad, &[m, m, m, e]), None).is_err());
}

#[test]
fn pfm_by_hand_in_both_orders_of_bytes() {
    let values = [1.0_f32, 2.0, 3.0, 4.0];
    let big: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    let little: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    for bytes in [[b"Pf\n2 2\n1.0\n", &big[..]].concat(), [b"Pf 2\t2\n-2.5\n", &little[..]].concat()] {
        let image = read_bytes(&bytes, None).unwrap();
        assert_eq!(image.channel("Y"), Some(&[3.0, 4.0, 1.0, 2.0][..]), "the bottom row comes first");
    }
    let scaled = read_bytes(&[b"Pf 2 2 -2.5\n", &little[..]].concat(), None).unwrap();
    assert_eq!(scaled.metadata_value("PFM_SCALE"), Some("2.5"));
    for bad in [
        "PF\n2 2\n0\n",
        "PF\n2 -2\n1\n",
        "PF\n2\n",
        "P6\n2 2\n1\n",
        "PF\n99999999 99999999\n1\n",
        "PF\n2 2\nnan\n",
    ] {
        assert!(read_bytes(&[bad.as_bytes(), &little].concat(), Some(Format::Pfm)).is_err(), "{bad:?}");
    }
}

#[test]
fn probe_and_read_name_the_file() {
    let directory = std::env::temp_dir().join(format!("hemilux-image-probe-{}", std::process::id()));
    std::fs::create_dir_all(&directory).unwrap();
    let image = with_aovs(5, 4);
    for (name, count) in [("a.exr", 7), ("a.hdr", 3), ("a.pfm", 3), ("a.png", 3)] {
        let path = directory.join(name);
        hemilux_image::write(&path, &image).unwrap();
        let summary = probe(&path).unwrap();
        assert_eq!((summary.width, summary.height, summary.channels.len()), (5, 4, count), "{name}");
        let back = read(&path).unwrap();
        let names: Vec<String> = back.channels.iter().map(|c| c.name.clone()).collect();
        assert_eq!(names, summary.channels);
    }
    let missing = read(directory.join("none.exr")).unwrap_err();
    assert!(missing.to_string().contains("none.exr") && matches!(missing.reason, Reason::Io(_)));
    std::fs::write(directory.join("text.exr"), "no picture").unwrap();
    assert!(
        read(directory.join("text.exr")).unwrap_err().to_string().contains("text.exr: not a valid OpenEXR")
    );
    assert!(hemilux_image::write(directory.join("a.gif"), &image).unwrap_err().to_string().contains("a.gif"));
    std::fs::remove_dir_all(&directory).unwrap();
}

/// One small valid file of each kind.
fn small_files() -> Vec<(Format, Vec<u8>)> {
    let image = with_aovs(9, 3);
    let mut files: Vec<(Format, Vec<u8>)> = [Format::Exr, Format::Hdr, Format::Pfm, Format::Png]
        .into_iter()
        .map(|f| (f, encode(&image, f).unwrap()))
        .collect();
    let mut zip = Vec::new();
    exr::encode_with(&image, Compression::Zip, &mut zip).unwrap();
    files.push((Format::Exr, zip));
    files.push((Format::Hdr, hdr_file("\n+X 3 -Y 2\n", &[9, 9, 9, 130].repeat(6))));
    files.push((Format::Jpeg, raster_bytes(image::ImageFormat::Jpeg)));
    files.push((Format::Tga, raster_bytes(image::ImageFormat::Tga)));
    files.push((Format::Png, raw_png(png::ColorType::Indexed, png::BitDepth::Eight, &[1, 0], false)));
    files
}

#[test]
fn every_prefix_is_an_error_or_a_picture() {
    for (format, bytes) in small_files() {
        assert!(read_bytes(&bytes, Some(format)).is_ok(), "{format:?}");
        let mut errors = 0;
        for end in 0..bytes.len() {
            match read_bytes(&bytes[..end], Some(format)) {
                Ok(image) => image.check().unwrap(),
                Err(_) => errors += 1,
            }
            let _ = hemilux_image::read::probe_bytes(&bytes[..end], Some(format));
        }
        assert!(
            errors * 2 > bytes.len(),
            "{format:?}: only {errors} of {} prefixes are refused",
            bytes.len()
        );
    }
}

#[test]
fn flipped_bytes_are_an_error_or_a_picture() {
    let mut state = 0x1234_5678_9abc_def1_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    for (format, bytes) in small_files() {
        for _ in 0..300 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random() % 3 {
                let at = (random() % damaged.len() as u64) as usize;
                damaged[at] ^= 1 << (random() % 8);
            }
            if let Ok(image) = read_bytes(&damaged, Some(format)) {
                image.check().unwrap();
                assert!(image.len() <= hemilux_image::MAX_PIXELS);
            }
        }
    }
}

fn picture() -> impl Strategy<Value = Image> {
    (1_usize..40, 1_usize..12, any::<bool>()).prop_flat_map(|(w, h, grey)| {
        let n = w * h * if grey { 1 } else { 3 };
        let value = prop_oneof![4 => -40..40_i32, 1 => Just(0)];
        prop::collection::vec((value, 1.0..2.0_f32, any::<bool>()), n).prop_map(move |v| {
            // Repeats make runs.
            let v: Vec<f32> =
                v.into_iter().map(|(e, m, same)| if same { 0.75 } else { m * 2.0_f32.powi(e) }).collect();
            if grey {
                return Image::from_channel(w, h, "Y", v);
            }
            Image::from_rgb(w, h, v.as_chunks::<3>().0)
        })
    })
}

const CASES: u32 = 64;

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(411),
        ..ProptestConfig::with_cases(CASES)
    })]

    #[test]
    fn lossless_formats_give_back_every_bit(image in picture()) {
        for format in [Format::Exr, Format::Pfm] {
            let back = read_bytes(&encode(&image, format).unwrap(), None).unwrap();
            prop_assert_eq!((back.width, back.height), (image.width, image.height));
            prop_assert_eq!(back.channels.len(), image.channels.len());
            for channel in &image.channels {
                prop_assert_eq!(back.channel(&channel.name), Some(channel.data.as_slice()));
            }
        }
    }

    #[test]
    fn hdr_is_within_a_256th_of_the_largest_component(image in picture()) {
        let back = read_bytes(&encode(&image, Format::Hdr).unwrap(), None).unwrap();
        for (x, y) in (0..image.len()).map(|i| (i % image.width, i / image.width)) {
            let (want, got) = (image.rgb_at(x, y).unwrap(), back.rgb_at(x, y).unwrap());
            let largest = want.into_iter().fold(0.0, f32::max);
            for c in 0..3 {
                prop_assert!((want[c] - got[c]).abs() <= largest / 256.0, "{:?} {:?}", want, got);
            }
        }
        // What was stored once is stored the same again.
        let again = read_bytes(&encode(&back, Format::Hdr).unwrap(), None).unwrap();
        prop_assert_eq!(again.channels, back.channels);
    }

    #[test]
    fn packing_takes_any_bits(bits in any::<[u32; 3]>()) {
        let rgb = bits.map(f32::from_bits);
        let back = hdr::unpack(hdr::pack(rgb));
        prop_assert!(back.iter().all(|v| v.is_finite() && *v >= 0.0));
        // All mantissas at their end, read in the middle of the last step.
        let largest_stored = 255.5 / 256.0 * 2.0_f32.powi(127);
        let clean = rgb.map(|v| if v.is_nan() { 0.0 } else { v.clamp(0.0, largest_stored) });
        let largest = clean.into_iter().fold(0.0, f32::max);
        for (want, got) in clean.into_iter().zip(back) {
            prop_assert!((want - got).abs() <= (largest / 256.0).max(1e-38));
        }
    }
}
