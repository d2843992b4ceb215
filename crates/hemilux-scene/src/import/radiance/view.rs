//! Views: `rvu -vtv -vp 0 0 0 ...` lines, of `.vf` files and of picture headers (`VIEW= ...`). Later options replace
//! earlier ones.

use super::super::Env;
use super::words::{Word, Words};
use crate::geom::{DAffine3, DVec3};
use crate::{Camera, Projection, Span, View, ViewKind};
use glam::DMat3;

/// What the view options said so far. Radiance's defaults.
#[derive(Clone, Debug)]
pub struct ViewState {
    kind: ViewKind,
    point: DVec3,
    direction: DVec3,
    up: DVec3,
    horizontal: f64,
    vertical: f64,
    fore: f64,
    aft: f64,
    shift: f64,
    lift: f64,
    /// Where the view was given, if it was.
    pub span: Option<Span>,
}

impl Default for ViewState {
    fn default() -> Self {
        ViewState {
            kind: ViewKind::Perspective,
            point: DVec3::ZERO,
            direction: DVec3::Y,
            up: DVec3::Z,
            horizontal: 45.0,
            vertical: 45.0,
            fore: 0.0,
            aft: 0.0,
            shift: 0.0,
            lift: 0.0,
            span: None,
        }
    }
}

/// Programs whose command lines are views.
const PROGRAMS: &[&str] = &["rvu", "rview", "rpict", "rtpict", "rpiece", "pinterp", "vwrays", "xview"];

const OPTIONS: &[&str] = &[
    "-vtv", "-vtl", "-vth", "-vta", "-vtc", "-vts", "-vp", "-vd", "-vu", "-vh", "-vv", "-vo", "-va", "-vs",
    "-vl", "-vf",
];

fn is_view_line(line: &str) -> bool {
    let first = line.split_whitespace().next().unwrap_or("");
    let program = first.rsplit('/').next().unwrap_or("");
    first.starts_with("VIEW=") || PROGRAMS.contains(&program)
}

/// Whether a text begins like a view file.
pub fn is_view(text: &str) -> bool {
    text.lines().find(|l| !l.trim().is_empty() && !l.starts_with('#')).is_some_and(is_view_line)
}

/// Read every view line of a text.
pub fn read(env: &Env, state: &mut ViewState, text: &str, file: u32) {
    let mut words = Words::new(text.into(), file);
    let mut found = false;
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        if is_view_line(line) {
            found = true;
            let end = offset + line.len();
            if read_line(env, state, &mut words, offset, end).is_none() {
                return;
            }
        }
        offset += line.len();
    }
    if !found {
        let span = Span { file, ..Span::default() };
        env.log.error(span, "no view: no line begins with rvu or VIEW=");
    }
}

/// The words of one line.
fn words_of(text: &str, start: usize, end: usize) -> Vec<Word> {
    let bytes = text.as_bytes();
    let mut list = Vec::new();
    let mut i = start;
    while i < end {
        if bytes[i].is_ascii_whitespace() {
            i += 1;
            continue;
        }
        let begin = i;
        while i < end && !bytes[i].is_ascii_whitespace() {
            i += 1;
        }
        // VIEW=-vtv may stand together.
        let begin = if text[begin..i].starts_with("VIEW=") { begin + 5 } else { begin };
        if begin < i {
            list.push(Word { start: begin, end: i });
        }
    }
    list
}

fn read_line(env: &Env, state: &mut ViewState, words: &mut Words, start: usize, end: usize) -> Option<()> {
    let whole = Word { start: 0, end };
    let list = words_of(words.raw(whole), start, end);
    let mut i = 0;
    while i < list.len() {
        let option = words.raw(list[i]).to_owned();
        if !option.starts_with("-v") {
            i += 1;
            continue;
        }
        let span = words.span(list[i]);
        state.span.get_or_insert(span);
        let wanted = match option.as_str() {
            "-vp" | "-vd" | "-vu" => 3,
            "-vh" | "-vv" | "-vo" | "-va" | "-vs" | "-vl" => 1,
            "-vtv" | "-vtl" | "-vth" | "-vta" | "-vtc" | "-vts" => 0,
            "-vf" => {
                env.log.unknown(span, "option -vf within a view is not supported");
                i += 2;
                continue;
            }
            _ => {
                let message = format!("unknown view option \"{option}\"");
                env.log.unknown_among(span, message, &option, OPTIONS.iter().copied());
                i += 1;
                continue;
            }
        };
        let mut values = Vec::new();
        for k in 0..wanted {
            let Some(&word) = list.get(i + 1 + k) else {
                let numbers = if wanted == 1 { "number" } else { "numbers" };
                env.log.error(span, format!("view option {option} takes {wanted} {numbers}, not {k}"));
                return None;
            };
            let text = words.raw(word);
            match text.parse::<f64>() {
                Ok(v) if v.is_finite() => values.push(v),
                _ => {
                    let message = format!("view option {option}: \"{text}\" is not a finite number");
                    let span = words.span(word);
                    env.log.error(span, message);
                    return None;
                }
            }
        }
        state.set(&option, &values);
        i += 1 + wanted;
    }
    Some(())
}

impl ViewState {
    fn set(&mut self, option: &str, v: &[f64]) {
        let vector = || DVec3::new(v[0], v[1], v[2]);
        match option {
            "-vtv" => self.kind = ViewKind::Perspective,
            "-vtl" => self.kind = ViewKind::Parallel,
            "-vth" => self.kind = ViewKind::Hemispherical,
            "-vta" => self.kind = ViewKind::Angular,
            "-vtc" => self.kind = ViewKind::Cylindrical,
            "-vts" => self.kind = ViewKind::Planisphere,
            "-vp" => self.point = vector(),
            "-vd" => self.direction = vector(),
            "-vu" => self.up = vector(),
            "-vh" => self.horizontal = v[0],
            "-vv" => self.vertical = v[0],
            "-vo" => self.fore = v[0],
            "-va" => self.aft = v[0],
            "-vs" => self.shift = v[0],
            _ => self.lift = v[0],
        }
    }

    /// A view of everything within a ball.
    pub fn of_ball(centre: DVec3, radius: f64) -> ViewState {
        let half = 22.5f64.to_radians();
        let distance = 1.05 * radius / half.sin();
        let direction = DVec3::new(0.5, 0.75, -0.45).normalize();
        ViewState { point: centre - direction * distance, direction, ..ViewState::default() }
    }

    /// The camera, or an error.
    pub fn camera(&self, env: &Env) -> Option<Camera> {
        let span = self.span.unwrap_or_default();
        let wrong = |message: String| -> Option<Camera> {
            env.log.error(span, message);
            None
        };
        let limits = |kind| match kind {
            ViewKind::Perspective => (180.0, 180.0),
            ViewKind::Parallel => (f64::INFINITY, f64::INFINITY),
            ViewKind::Hemispherical => (180.000_001, 180.000_001),
            ViewKind::Angular => (360.000_001, 360.000_001),
            ViewKind::Cylindrical => (360.000_001, 180.0),
            ViewKind::Planisphere => (360.0, 360.0),
        };
        let (most_h, most_v) = limits(self.kind);
        for (option, size, most) in [("-vh", self.horizontal, most_h), ("-vv", self.vertical, most_v)] {
            if !(size > 0.0 && size < most) {
                return wrong(format!("view option {option}: a size of {size} is out of range"));
            }
        }
        let Some(z) = self.direction.try_normalize() else {
            return wrong("view option -vd: the direction is zero".into());
        };
        let right = self.up.normalize_or_zero();
        let Some(x) = z.cross(right).try_normalize().filter(|_| z.cross(right).length() > 1e-9) else {
            return wrong("view options -vd and -vu: up must not be in line with the direction".into());
        };
        if !self.point.as_vec3().is_finite() || self.fore < 0.0 {
            return wrong("view options -vp and -vo: out of range".into());
        }
        if self.aft > 0.0 {
            env.log.note(span, "view option -va: the aft clipping plane is ignored");
        }
        Some(Camera {
            projection: Projection::View(View {
                kind: self.kind,
                horizontal: self.horizontal,
                vertical: self.vertical,
                shift: self.shift,
                lift: self.lift,
                fore: self.fore,
            }),
            to_world: DAffine3 { matrix3: DMat3::from_cols(x, x.cross(z), z), translation: self.point },
            screen_window: None,
            lens_radius: 0.0,
            focal_distance: 1e6,
            span,
        })
    }

    /// Height over width of the picture's plane.
    pub fn aspect(&self) -> f64 {
        let plane = |degrees: f64| {
            let half = (0.5 * degrees).to_radians();
            match self.kind {
                ViewKind::Perspective => half.tan(),
                ViewKind::Parallel | ViewKind::Angular => degrees,
                ViewKind::Hemispherical => half.sin(),
                ViewKind::Planisphere => (0.5 * half).tan(),
                ViewKind::Cylindrical => half.tan(),
            }
        };
        let across = match self.kind {
            // Arc length at unit distance.
            ViewKind::Cylindrical => (0.5 * self.horizontal).to_radians(),
            _ => plane(self.horizontal),
        };
        plane(self.vertical) / across
    }
}
