//! The end of a load: meshes are closed, the camera is chosen, the film fits the view.

use super::Reader;
use super::view::ViewState;
use crate::geom::{DVec3, Vec2};
use crate::import::builder::Builder;
use crate::{Film, Filter, Geometry, Photometry, Quadric, Scene, Span};

/// The longer side of a film whose size nobody gave, pixels.
const FILM: u32 = 512;

impl Reader {
    /// The scene, or errors in the log.
    pub(super) fn finish(mut self) -> Option<Scene> {
        let env = self.env.clone();
        self.build.close_meshes();
        if env.log.errors() > 0 {
            return None;
        }
        self.report();
        let empty = self.build.shapes.is_empty() && self.build.environments.is_empty();
        if empty && self.build.surfaces == 0 {
            env.log.warning(Span::default(), "the scene has no surface");
        }
        if self.view.span.is_none() {
            let (centre, radius) = self.ball();
            self.view = ViewState::of_ball(centre, radius);
            env.log.note(Span::default(), "no view given: one that shows everything is taken");
        }
        let camera = self.view.camera(&env)?;
        let film = film(self.view.aspect());
        let mut builder = Builder::new(env);
        builder.camera = Some(camera);
        builder.film = Some((film, Span::default()));
        builder.filter = Some(Filter::Box { radius: Vec2::splat(0.5) });
        builder.max_depth = None;
        builder.materials = self.build.materials;
        builder.images = self.build.images;
        builder.meshes = self.build.meshes;
        builder.shapes = self.build.shapes;
        builder.environments = self.build.environments;
        let mut scene = builder.finish()?;
        scene.photometry = Photometry::RADIANCE;
        Some(scene)
    }

    fn report(&self) {
        let log = &self.env.log;
        let b = &self.build;
        if b.degenerate > 0 {
            log.warning(b.degenerate_span, format!("{} polygons without area were left out", b.degenerate));
        }
        if b.invisible > 0 {
            log.note(Span::default(), format!("{} surfaces of void were left out", b.invisible));
        }
        let h = &self.hints;
        let mut parts = Vec::new();
        for (n, what) in [(h.illums, "illum"), (h.mirrors, "mirror"), (h.glow_radii, "glow radius")] {
            if n > 0 {
                parts.push(format!("{n} {what}"));
            }
        }
        if !parts.is_empty() {
            let message = format!("hints to a direct calculation are not needed here: {}", parts.join(", "));
            log.note(Span::default(), message);
        }
    }

    /// A ball around all geometry.
    fn ball(&self) -> (DVec3, f64) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut add = |p: DVec3| {
            low = low.min(p);
            high = high.max(p);
        };
        for mesh in &self.build.meshes {
            mesh.positions.iter().for_each(|p| add(p.as_dvec3()));
        }
        for shape in &self.build.shapes {
            if let Geometry::Quadric(q, m) = &shape.geometry {
                let (r, z0, z1) = match *q {
                    Quadric::Sphere { radius, .. } => (radius, -radius, radius),
                    Quadric::Disk { radius, height, .. } => (radius, height, height),
                    Quadric::Cylinder { radius, z_min, z_max, .. } => (radius, z_min, z_max),
                };
                for i in 0..8 {
                    let pick = |bit: usize, a: f64, b: f64| if i >> bit & 1 == 0 { a } else { b };
                    add(m.transform_point3(DVec3::new(pick(0, -r, r), pick(1, -r, r), pick(2, z0, z1))));
                }
            }
        }
        if low.x > high.x {
            (DVec3::ZERO, 1.0)
        } else {
            ((low + high) * 0.5, ((high - low).length() * 0.5).max(1e-6))
        }
    }
}

/// A film of square pixels.
fn film(aspect: f64) -> Film {
    let side = |v: f64| (f64::from(FILM) * v).round().clamp(1.0, f64::from(FILM)) as u32;
    let (width, height) = if aspect > 1.0 { (side(1.0 / aspect), FILM) } else { (FILM, side(aspect)) };
    Film { width, height, crop: [0.0, 1.0, 0.0, 1.0], scale: 1.0, filename: None }
}
