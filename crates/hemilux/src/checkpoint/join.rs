//! Joining films of one picture: of disjoint regions, passes or seeds, in any order.
//!
//! Tiles are joined one by one. What was made twice and is the very same counts once; pieces of the same rectangle add up;
//! pieces with the same passes are a layer, which must fill its tile; layers add up. Sums are exact, so order does not show.

use super::{Coverage, FilmFile, FilmFileError, Source};
use crate::film::{Film, TILE, Tile, united};
use std::collections::BTreeMap;
use std::ops::Range;

/// Why films cannot be joined.
#[derive(Debug, thiserror::Error)]
pub enum JoinError {
    /// Nothing was given.
    #[error("no films to join")]
    Nothing,
    /// They are not of one picture.
    #[error("{name}: {error}")]
    Other {
        /// The film that differs from the first.
        name: String,
        /// In what.
        error: FilmFileError,
    },
    /// One seed with two zonal solutions.
    #[error("{0} and {1} have the same seed and different zonal solutions: give them seeds of their own")]
    Zones(String, String),
    /// The same pass of the same tile twice.
    #[error("{names} both hold pass {pass} at ({x}, {y}), and not the same samples in all")]
    Overlap {
        /// The films.
        names: String,
        /// First pass in common.
        pass: u32,
        /// Left edge of the tile.
        x: u32,
        /// Top edge of the tile.
        y: u32,
    },
    /// A tile was cut by regions, and its pieces do not fit.
    #[error(
        "the films cut the tile at ({x}, {y}) into pieces with different passes: cut pictures at multiples of {TILE} pixels"
    )]
    Pieces {
        /// Left edge of the tile.
        x: u32,
        /// Top edge of the tile.
        y: u32,
    },
    /// Something is missing.
    #[error("no film has the tile at ({x}, {y}) whole: a part of the picture is missing")]
    Gap {
        /// Left edge of the tile.
        x: u32,
        /// Top edge of the tile.
        y: u32,
    },
}

/// A tile of one of the films, with its passes in the sources of the joined film.
struct Piece<'a> {
    name: &'a str,
    tile: &'a Tile,
    /// By source of the joined film.
    passes: Vec<&'a [Range<u32>]>,
}

/// Join films of one picture: of disjoint regions, passes or seeds, in any order. What two films hold in common must be
/// the very same (a repeated part), and counts once.
///
/// # Errors
/// The films are not of one picture, overlap in part, or leave a gap.
pub fn join(films: &[(String, FilmFile)]) -> Result<FilmFile, JoinError> {
    let (_, first) = films.first().ok_or(JoinError::Nothing)?;
    for (name, film) in films {
        film.origin.check(&first.origin).map_err(|error| JoinError::Other { name: name.clone(), error })?;
    }
    let sources = joined_sources(films)?;
    let regions = || films.iter().map(|(_, f)| f.film.region());
    let region = [
        regions().map(|r| r[0]).min().unwrap_or(0),
        regions().map(|r| r[1]).max().unwrap_or(0),
        regions().map(|r| r[2]).min().unwrap_or(0),
        regions().map(|r| r[3]).max().unwrap_or(0),
    ];
    let cell = |t: &Tile| (t.y0 / TILE, t.x0 / TILE);
    let mut pieces: BTreeMap<(u32, u32), Vec<Piece>> = BTreeMap::new();
    for (name, f) in films {
        for (i, tile) in f.film.tiles().iter().enumerate() {
            let of = |source: &Source| f.sources.iter().find(|(s, _)| s == source);
            let passes = sources.iter().map(|s| of(s).map_or(&[][..], |(_, c)| &c[i])).collect();
            pieces.entry(cell(tile)).or_default().push(Piece { name, tile, passes });
        }
    }
    let [width, height] = first.origin.size;
    let mut film = Film::new(width, height, region);
    let mut coverage: Vec<Coverage> = vec![Vec::new(); sources.len()];
    for tile in film.tiles_mut() {
        let joined = join_tile(tile, pieces.remove(&cell(tile)).unwrap_or_default(), sources.len())?;
        coverage.iter_mut().zip(joined).for_each(|(c, passes)| c.push(passes));
    }
    if let [only] = coverage.as_slice() {
        for (tile, passes) in film.tiles_mut().iter_mut().zip(only) {
            passes.iter().cloned().for_each(|r| {
                let _ = tile.cover(r);
            });
        }
    }
    let mut notes: Vec<_> = films.iter().flat_map(|(_, f)| f.notes.iter().cloned()).collect();
    notes.sort();
    notes.dedup();
    Ok(FilmFile {
        origin: first.origin.clone(),
        notes,
        sources: sources.into_iter().zip(coverage).collect(),
        film,
    })
}

/// All sources, in order, one per seed.
fn joined_sources(films: &[(String, FilmFile)]) -> Result<Vec<Source>, JoinError> {
    let mut by_seed: BTreeMap<u64, (&String, &Source)> = BTreeMap::new();
    for (name, film) in films {
        for (source, _) in &film.sources {
            let (other, known) = *by_seed.entry(source.seed).or_insert((name, source));
            if known != source {
                return Err(JoinError::Zones(other.clone(), name.clone()));
            }
        }
    }
    Ok(by_seed.into_values().map(|(_, s)| s.clone()).collect())
}

/// Add the pieces of one tile to `tile`; its passes by source.
fn join_tile(tile: &mut Tile, mut pieces: Vec<Piece>, sources: usize) -> Result<Coverage, JoinError> {
    let (x, y) = (tile.x0, tile.y0);
    let rectangle = |t: &Tile| (t.x0, t.y0, t.width, t.height);
    // Whatever was made twice counts once.
    let mut distinct: Vec<Piece> = Vec::new();
    pieces.retain(|p| p.passes.iter().any(|r| !r.is_empty()));
    for piece in pieces {
        let same = |d: &Piece| {
            rectangle(d.tile) == rectangle(piece.tile)
                && d.passes == piece.passes
                && d.tile.pixels == piece.tile.pixels
        };
        if !distinct.iter().any(same) {
            distinct.push(piece);
        }
    }
    // Films of the same rectangle add up.
    let mut sides: BTreeMap<_, (Coverage, &str)> = BTreeMap::new();
    for piece in &distinct {
        let (held, name) =
            sides.entry(rectangle(piece.tile)).or_insert((vec![Vec::new(); sources], piece.name));
        for (held, more) in held.iter_mut().zip(&piece.passes) {
            let overlap =
                |pass| JoinError::Overlap { names: format!("{name} and {}", piece.name), pass, x, y };
            *held = united(held, more).map_err(overlap)?;
        }
        *name = piece.name;
    }
    // Rectangles with the same passes are a layer, which must fill the tile; layers add up.
    let mut layers: Vec<(Coverage, Vec<Rectangle>)> = Vec::new();
    for (rectangle, (passes, _)) in sides {
        match layers.iter_mut().find(|l| l.0 == passes) {
            Some(layer) => layer.1.push(rectangle),
            None => layers.push((passes, vec![rectangle])),
        }
    }
    let mut all = vec![Vec::new(); sources];
    for (passes, rectangles) in &layers {
        if rectangles.iter().enumerate().any(|(i, a)| rectangles[i + 1..].iter().any(|b| meet(a, b))) {
            return Err(JoinError::Pieces { x, y });
        }
        let area: u64 = rectangles.iter().map(|r| r.2 as u64 * r.3 as u64).sum();
        if area != tile.width as u64 * tile.height as u64 {
            let gap = layers.len() == 1;
            return Err(if gap { JoinError::Gap { x, y } } else { JoinError::Pieces { x, y } });
        }
        for (all, passes) in all.iter_mut().zip(passes) {
            *all = united(all, passes).map_err(|_| JoinError::Pieces { x, y })?;
        }
    }
    if layers.is_empty() {
        return Err(JoinError::Gap { x, y });
    }
    for piece in &distinct {
        let (left, top) = (piece.tile.x0 - tile.x0, piece.tile.y0 - tile.y0);
        for (i, pixel) in piece.tile.pixels.iter().enumerate() {
            let (px, py) = (left + i as u32 % piece.tile.width, top + i as u32 / piece.tile.width);
            tile.pixels[(py * tile.width + px) as usize].merge(pixel);
        }
    }
    Ok(all)
}

type Rectangle = (u32, u32, u32, u32);

/// Whether two rectangles overlap.
fn meet(a: &Rectangle, b: &Rectangle) -> bool {
    let apart = a.0 + a.2 <= b.0 || b.0 + b.2 <= a.0 || a.1 + a.3 <= b.1 || b.1 + b.3 <= a.1;
    !apart
}
