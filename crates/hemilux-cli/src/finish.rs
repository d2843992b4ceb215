//! The last part of a time budget, too short for a whole pass: one more pass over as many rows of tiles as fit.
//!
//! Every tile still ends at a pass boundary, and its samples are those of the whole pass, so such a film can be
//! continued or merged like any other.

use hemilux::film::{Film, TILE};
use hemilux::render::Renderer;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Do rows of tiles of pass `pass` until `deadline` or `cancel`; `per_pass` is what a whole pass takes.
/// Returns the rays traced, or `None` if no row was done.
pub fn rows(
    renderer: &Renderer,
    film: &mut Film,
    pass: u32,
    per_pass: Duration,
    deadline: Instant,
    cancel: &AtomicBool,
) -> Option<u64> {
    let rays = AtomicU64::new(0);
    let [x0, x1, y0, y1] = film.region();
    let (mut y, mut any) = (y0, false);
    while y < y1 {
        let end = ((y / TILE + 1) * TILE).min(y1);
        let expected = per_pass.mul_f64((end - y) as f64 / (y1 - y0) as f64);
        if cancel.load(Ordering::Relaxed) || Instant::now() + expected > deadline {
            break;
        }
        let mut row = Film::new(film.width(), film.height(), [x0, x1, y, end]);
        let here = film.tiles_mut().iter_mut().filter(|t| (y..end).contains(&t.y0));
        for (own, tile) in row.tiles_mut().iter_mut().zip(here) {
            std::mem::swap(own, tile);
        }
        renderer.passes(&mut row, pass..pass + 1, &rays);
        let here = film.tiles_mut().iter_mut().filter(|t| (y..end).contains(&t.y0));
        for (own, tile) in row.tiles_mut().iter_mut().zip(here) {
            std::mem::swap(own, tile);
        }
        (y, any) = (end, true);
    }
    any.then(|| rays.into_inner())
}
