//! Films on disk: read back bit for bit, joined in any order, refused when damaged or foreign.

mod common;
use common::*;
use hemilux::checkpoint::{FilmFile, FilmFileError, JoinError, Origin, Source, ZoneSource, join, write};
use hemilux::film::{Film, Sample};
use hemilux::render::{Mode, RenderOptions};
use hemilux_scene::Rgb;
use hemiquad::points::Key;

const WHOLE: [u32; 4] = [0, 50, 0, 40];

fn origin() -> Origin {
    let options = RenderOptions { mode: Mode::Zonal, plan: PLAN, seed: 0, max_depth: u32::MAX };
    Origin { scene: 7, view: 8, size: [50, 40], options, residual: 0.0 }
}

fn source(seed: u64) -> Source {
    let zones = ZoneSource::Solved {
        budget: 100,
        planned: 1 << 18,
        particles: 1 << 17,
        seed,
        fingerprint: 99 + seed,
    };
    Source { seed, zones, prologue: vec![1, 2, 3] }
}

/// Passes of a picture whose samples are a function of seed, pixel and pass, as a renderer's are.
fn rendered(seed: u64, region: [u32; 4], passes: std::ops::Range<u32>) -> FilmFile {
    let mut film = Film::new(50, 40, region);
    for tile in film.tiles_mut() {
        for i in 0..tile.pixels.len() as u32 {
            let (x, y) = (tile.x0 + i % tile.width, tile.y0 + i / tile.width);
            for pass in passes.clone() {
                let key = Key::new(seed).with((y * 50 + x) as u64).with(pass as u64);
                let radiance = Rgb([0, 1, 2].map(|c| key.uniform(c) * 1e3f32.powf(key.uniform(9))));
                tile.pixels[i as usize].add(&Sample { radiance, ..Sample::default() });
            }
        }
        tile.cover(passes.clone()).unwrap();
    }
    let notes = vec![("scene".to_owned(), "room".to_owned())];
    FilmFile::read(&bytes_of(&film, &notes, seed)).unwrap()
}

fn bytes_of(film: &Film, notes: &[(String, String)], seed: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(&origin(), notes, &source(seed), film, &mut bytes).unwrap();
    bytes
}

fn bytes(file: &FilmFile) -> Vec<u8> {
    let mut bytes = Vec::new();
    file.write(&mut bytes).unwrap();
    bytes
}

fn named(files: &[&FilmFile]) -> Vec<(String, FilmFile)> {
    files.iter().enumerate().map(|(i, f)| (format!("film {i}"), (*f).clone())).collect()
}

#[test]
fn a_film_is_read_back_as_it_was_written() {
    let file = rendered(3, [3, 47, 5, 36], 2..6);
    let again = FilmFile::read(&bytes(&file)).unwrap();
    assert_eq!(file, again);
    assert_eq!(again.film.first_missing(2), 6);
    assert_eq!(again.sources[0].0, source(3));
    assert_eq!(again.origin, origin());
}

/// Every byte altered, every cut: an error, and no panic. The last bytes of the file are its checksum.
#[test]
fn damage_is_refused() {
    let good = bytes(&rendered(3, [0, 6, 0, 5], 0..2));
    for cut in 0..good.len() {
        assert!(FilmFile::read(&good[..cut]).is_err(), "cut at {cut}");
    }
    for i in 0..good.len() {
        let mut bad = good.clone();
        bad[i] ^= 0x10;
        let error = FilmFile::read(&bad).unwrap_err();
        match i {
            0..8 => assert!(matches!(error, FilmFileError::Magic), "{i}: {error}"),
            8..12 => assert!(matches!(error, FilmFileError::Version(_)), "{i}: {error}"),
            _ => assert!(matches!(error, FilmFileError::Damaged(_)), "{i}: {error}"),
        }
    }
    assert!(FilmFile::read(&good).is_ok(), "negative control");
    // Damage behind a checksum that fits: what a careless or malicious writer makes.
    let body = good.len() - 4;
    for i in 12..body {
        for flip in [0x01, 0x80, 0xff] {
            let mut bad = good.clone();
            bad[i] ^= flip;
            let crc = crc32fast::hash(&bad[..body]);
            bad[body..].copy_from_slice(&crc.to_le_bytes());
            // Most are refused; some are other films. None panics.
            let _ = FilmFile::read(&bad);
        }
    }
    let mut other = good.clone();
    other[16] = b'9';
    let crc = crc32fast::hash(&other[..body]);
    other[body..].copy_from_slice(&crc.to_le_bytes());
    let text = FilmFile::read(&other).unwrap_err().to_string();
    assert!(text.starts_with("written by hemilux 9"), "{text}");
}

#[test]
fn another_origin_is_refused_by_name() {
    let theirs = origin();
    assert!(theirs.check(&origin()).is_ok());
    let changed = |change: fn(&mut Origin)| {
        let mut ours = origin();
        change(&mut ours);
        theirs.check(&ours).unwrap_err().to_string()
    };
    for (text, word) in [
        (changed(|o| o.scene = 9), "another scene"),
        (changed(|o| o.view = 9), "another view"),
        (changed(|o| o.size = [50, 41]), "picture size: 50x40 in the file, 50x41 here"),
        (changed(|o| o.options.mode = Mode::Path), "mode: zonal in the file, path here"),
        (changed(|o| o.options.plan.rays = 9), "gather rays: 16 in the file, 9 here"),
        (changed(|o| o.options.max_depth = 5), "max depth: none in the file, 5 here"),
        (changed(|o| o.residual = 0.5), "share of residuals"),
    ] {
        assert!(text.contains(word), "{word} is not in {text}");
    }
    // The seed is each source's own affair.
    let mut seeded = origin();
    seeded.options.seed = 12;
    assert!(theirs.check(&seeded).is_ok());
}

/// Parts of a picture by region, passes and seed, in every order and grouping: the same bytes, and those of the whole.
#[test]
fn joining_does_not_depend_on_order() {
    let whole = rendered(0, WHOLE, 0..6);
    let parts = [
        rendered(0, [0, 32, 0, 40], 0..2),
        // Cut within a tile: its pieces have the same passes.
        rendered(0, [32, 41, 0, 40], 0..2),
        rendered(0, [41, 50, 0, 40], 0..2),
        rendered(0, WHOLE, 2..5),
        rendered(0, WHOLE, 5..6),
    ];
    let [a, b, c, d, e] = &parts;
    let tiles = |f: &FilmFile| (f.film.clone(), f.sources.clone());
    let strips = join(&named(&[c, a, b])).unwrap();
    let reference = join(&named(&[&strips, d, e])).unwrap();
    assert_eq!(tiles(&reference), tiles(&whole));
    // All at once: strips and whole tiles in layers.
    assert_eq!(bytes(&join(&named(&[d, c, a, e, b])).unwrap()), bytes(&reference));
    for order in [[&strips, e, d], [d, &strips, e], [e, d, &strips]] {
        assert_eq!(bytes(&join(&named(&order)).unwrap()), bytes(&reference));
    }
    let grouped = join(&named(&[&join(&named(&[e, d])).unwrap(), &strips])).unwrap();
    assert_eq!(bytes(&grouped), bytes(&reference));
    // A part twice counts once.
    assert_eq!(bytes(&join(&named(&[d, &strips, e, d])).unwrap()), bytes(&reference));
    // Seeds add up, in any order, and the joined film can be read.
    let other = rendered(5, WHOLE, 0..3);
    let both = join(&named(&[&other, &whole])).unwrap();
    assert_eq!(bytes(&both), bytes(&join(&named(&[&whole, &other])).unwrap()));
    assert_eq!(both.film.samples(), (9, 9));
    assert_eq!(FilmFile::read(&bytes(&both)).unwrap(), both);
    let third = rendered(4, WHOLE, 0..1);
    let (left, right) = (join(&named(&[&both, &third])), join(&named(&[&third, &other, &whole])));
    assert_eq!(bytes(&left.unwrap()), bytes(&right.unwrap()));
}

#[test]
fn films_that_do_not_fit_are_refused() {
    let whole = rendered(0, WHOLE, 0..4);
    let refused = |files: &[&FilmFile]| join(&named(files)).unwrap_err();
    assert!(matches!(refused(&[]), JoinError::Nothing));
    let error = refused(&[&whole, &rendered(0, WHOLE, 3..6)]);
    assert!(matches!(error, JoinError::Overlap { pass: 3, x: 0, y: 0, .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("film 0 and film 1 both hold pass 3"), "{text}");
    // The same passes with other sums are not a repetition.
    let mut forged = whole.clone();
    forged.film.tiles_mut()[2].pixels[7] = whole.film.tiles()[2].pixels[8];
    assert!(matches!(refused(&[&whole, &forged]), JoinError::Overlap { pass: 0, .. }));
    let error = refused(&[&rendered(0, [0, 20, 0, 40], 0..2), &rendered(0, [20, 50, 0, 40], 0..3)]);
    assert!(matches!(error, JoinError::Pieces { x: 16, y: 0 }), "{error}");
    let error = refused(&[&rendered(0, [0, 20, 0, 40], 0..2), &rendered(0, [10, 50, 0, 40], 0..2)]);
    assert!(matches!(error, JoinError::Pieces { x: 0, y: 0 } | JoinError::Gap { .. }), "{error}");
    let error = refused(&[&rendered(0, [0, 16, 0, 40], 0..2), &rendered(0, [32, 50, 0, 40], 0..2)]);
    assert!(matches!(error, JoinError::Gap { x: 16, y: 0 }), "{error}");
    let mut foreign = rendered(1, WHOLE, 0..2);
    foreign.origin.scene = 1;
    assert!(refused(&[&whole, &foreign]).to_string().contains("film 1: made with another scene"));
    let mut zones = rendered(0, WHOLE, 4..6);
    zones.sources[0].0.zones = ZoneSource::Given { fingerprint: 1 };
    assert!(matches!(refused(&[&whole, &zones]), JoinError::Zones(..)));
}
