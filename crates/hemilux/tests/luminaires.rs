//! Direct light: directions against densities for every kind of luminaire (χ²), irradiance near large luminaires and
//! under a thousand lamps against closed forms, and the shares of glossy lobes and shadow rays.
//!
//! False alarms: every χ² test accepts p > 1e-5, every z-test |z| < 4.4 (1e-5). Each has a negative control.

mod common;
use common::*;
use hemilux::bsdf::Bsdf;
use hemilux::gather::{GatherPlan, Strategy, gather};
use hemilux::sampler::Sampler;
use hemilux::sensor::sensor_surface;
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux::world::luminaire::{NO_LUMINAIRE, Receiver};
use hemilux_scene::geom::{DAffine3, DVec3, Frame, Vec3};
use hemilux_scene::*;
use std::f64::consts::{PI, TAU};

const RINGS: usize = 12;
const SECTORS: usize = 12;

/// A cone of directions in cells of equal solid angle, and one cell for the rest.
struct Cells {
    frame: Frame,
    height: f64,
}

impl Cells {
    fn new(axis: [f32; 3], half_angle: f64) -> Cells {
        Cells { frame: Frame::from_normal(Vec3::from(axis).normalize()), height: 1.0 - half_angle.cos() }
    }

    fn cell(&self, w: Vec3) -> usize {
        let l = self.frame.to_local(w);
        let ring = (1.0 - l.z as f64) / self.height * RINGS as f64;
        let sector = ((l.y as f64).atan2(l.x as f64) / TAU + 1.0).fract() * SECTORS as f64;
        if ring >= RINGS as f64 {
            return RINGS * SECTORS;
        }
        ring as usize * SECTORS + (sector as usize).min(SECTORS - 1)
    }

    fn direction(&self, u: f32, v: f32) -> Vec3 {
        let z = 1.0 - u as f64 * self.height;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (s, c) = (TAU * v as f64).sin_cos();
        self.frame.to_world(Vec3::new((r * c) as f32, (r * s) as f32, z as f32)).normalize()
    }

    fn solid_angle(&self) -> f64 {
        TAU * self.height
    }
}

/// Density of luminaire samples for `at` along `w`: the sum over everything that emits towards the receiver there.
fn density(world: &World, at: &Receiver, w: Vec3) -> f64 {
    let lights = &world.luminaires;
    let (mut origin, mut sum) = (at.p, 0.0);
    while let Some(s) = world.closest(origin, w, f32::INFINITY) {
        if s.luminaire != NO_LUMINAIRE
            && !lights.radiance(&world.scene, s.luminaire, s.ng, s.uv, s.wo).is_black()
        {
            let t = (s.p - at.p).length();
            sum += lights.pdf_solid_angle(s.luminaire, at, w, t, s.ng) as f64;
        }
        origin = s.leave(w);
    }
    let skies = lights.sky_radiance(&world.scene, at.p, w).filter(|(l, _)| !l.is_black());
    sum + skies.map(|(_, i)| lights.sky_pdf(&world.scene, i, at, w) as f64).sum::<f64>()
}

/// χ² per degree of freedom as a normal deviate (Wilson and Hilferty), of samples for `at` against the density for
/// `supposed`. Expected counts are Monte Carlo integrals themselves: their variance is added.
fn deviate(world: &World, at: &Receiver, supposed: &Receiver, cells: &Cells) -> f64 {
    let (n, m) = (40_000u32, 400_000u32);
    let mut counts = vec![0.0; RINGS * SECTORS + 1];
    let mut expected = vec![(0.0, 0.0); RINGS * SECTORS];
    let mut below = 0;
    for i in 0..n {
        let mut sampler = Sampler::new(3, i as u64, 0);
        if let Some(l) = world.luminaires.sample(&world.scene, at, sampler.next1(), sampler.next2()) {
            counts[cells.cell(l.wi)] += 1.0;
            // Told of a direction, the density is at least that of the sample: luminaires behind add theirs.
            let p = density(world, at, l.wi);
            below += (p < 0.98 * l.pdf_solid_angle as f64) as u32;
        }
    }
    for i in 0..m {
        let u = hemiquad::points::sobol(i, hemiquad::points::Key::new(11));
        let w = cells.direction(u.u, u.v);
        let cell = cells.cell(w).min(RINGS * SECTORS - 1);
        let p = density(world, supposed, w) * cells.solid_angle() * n as f64 / m as f64;
        expected[cell].0 += p;
        expected[cell].1 += p * p;
    }
    // Rays may miss an edge, and grazing densities lose digits.
    assert!(below as f64 <= 2e-3 * n as f64, "{below} densities are less than what was sampled with");
    // Directions outside of the cone would go unseen.
    assert!(counts[RINGS * SECTORS] <= 1e-3 * n as f64, "{} outside", counts[RINGS * SECTORS]);
    let (mut chi2, mut freedom) = (0.0, 0.0);
    for (&count, &(mean, square)) in counts.iter().zip(&expected) {
        if mean > 10.0 {
            chi2 += (count - mean) * (count - mean) / (mean + square);
            freedom += 1.0;
        } else {
            assert!(count < 60.0, "{count} samples where {mean} were expected");
        }
    }
    assert!(freedom >= 1.0);
    let k = 2.0 / (9.0 * freedom);
    ((chi2 / freedom).cbrt() - (1.0 - k)) / k.sqrt()
}

fn assert_density(what: &str, world: &World, at: Receiver, cells: Cells) {
    let d = deviate(world, &at, &at, &cells);
    println!("{what}: deviate {d:.2}");
    assert!(d < Z_LIMIT, "{what}: {d}");
}

fn panel(scene: &mut Scene) -> MaterialId {
    diffuse(scene, 0.0)
}

#[test]
fn near_rectangles_and_triangles() {
    let mut scene = empty();
    let m = panel(&mut scene);
    quad(&mut scene, [-1.0, -0.5, 0.4], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], m, emission(1.0));
    let world = World::new(scene);
    for (p, half_angle) in [([0.0, 0.0, 0.0], 1.3), ([0.9, 0.6, 0.0], 1.5), ([3.0, 0.3, -1.0], 0.9)] {
        let p = Vec3::from(p);
        let axis = Vec3::new(0.0, 0.0, 0.4) - p;
        let cells = Cells::new(axis.to_array(), half_angle);
        assert_density(&format!("rectangle from {p}"), &world, Receiver::facing(p, Vec3::Z), cells);
    }
    for far in [1.0f32, 20.0] {
        let mut scene = empty();
        let m = panel(&mut scene);
        let positions = [[-0.3, 0.0, far], [0.2, 0.9, far], [1.1, -0.2, far * 1.1]].map(Vec3::from).to_vec();
        scene.meshes.push(Mesh { positions, indices: vec![[0, 1, 2]], ..Mesh::default() });
        shape(&mut scene, Geometry::Mesh(MeshId(0)), m, emission(1.0));
        let world = World::new(scene);
        let cells = Cells::new([0.3, 0.2, far], 1.0f64.atan2(far as f64));
        assert_density(&format!("triangle at {far}"), &world, Receiver::anywhere(Vec3::ZERO), cells);
    }
}

#[test]
fn quadrics() {
    let cases = [
        (Quadric::Sphere { radius: 0.3, z_min: -0.3, z_max: 0.3, phi_max: TAU }, 0.32),
        (Quadric::Sphere { radius: 0.3, z_min: -0.3, z_max: 0.1, phi_max: 5.0 }, 0.35),
        (Quadric::Disk { height: 0.0, radius: 0.4, inner_radius: 0.1, phi_max: TAU }, 0.42),
        (Quadric::Cylinder { radius: 0.1, z_min: -0.5, z_max: 0.5, phi_max: TAU }, 0.6),
    ];
    for (q, half_angle) in cases {
        let mut scene = empty();
        let m = panel(&mut scene);
        let placed = DAffine3::from_translation(DVec3::new(0.6, 0.0, 0.8)) * DAffine3::from_rotation_x(2.8);
        shape(&mut scene, Geometry::Quadric(q, placed), m, emission(1.0));
        let world = World::new(scene);
        let cells = Cells::new([0.6, 0.0, 0.8], half_angle);
        assert_density(&format!("{q:?}"), &world, Receiver::facing(Vec3::ZERO, Vec3::Z), cells);
    }
}

/// Lamps of all kinds, some facing away, under a sky with a sun.
fn many_lamps(skies: bool) -> World {
    let mut scene = empty();
    let m = panel(&mut scene);
    for i in 0..24 {
        let angle = i as f64 * 2.399963;
        let r = 0.4 + 0.2 * (i as f64).sqrt();
        let (x, y, z) = (r * angle.cos(), r * angle.sin(), 0.5 + 0.03 * i as f64);
        let e = emission(1.0 + (i % 5) as f32 * 3.0);
        match i % 3 {
            0 => sphere(&mut scene, [x, y, z], 0.08, false, m, e),
            1 => {
                let (a, b) = ([0.0, 0.2, 0.05], [0.25, 0.0, 0.0]);
                let (a, b) = if i % 2 == 0 { (a, b) } else { (b, a) };
                quad(&mut scene, [x as f32, y as f32, z as f32], a, b, m, e);
            }
            _ => {
                let q = Quadric::Disk { height: 0.0, radius: 0.1, inner_radius: 0.0, phi_max: TAU };
                shape(
                    &mut scene,
                    Geometry::Quadric(q, DAffine3::from_translation(DVec3::new(x, y, z))),
                    m,
                    e,
                );
                scene.shapes.last_mut().unwrap().reverse_orientation = i % 2 == 0;
                if i % 4 == 0 {
                    scene.shapes.last_mut().unwrap().emission.as_mut().unwrap().two_sided = true;
                }
            }
        }
    }
    if skies {
        scene.environments.push(Environment::Constant { radiance: Rgb::splat(0.3) });
        let direction = Vec3::new(0.6, 0.0, 0.8);
        let cos_half_angle = 0.1f64.cos();
        scene.environments.push(Environment::Sun { direction, cos_half_angle, radiance: Rgb::splat(20.0) });
    }
    World::new(scene)
}

#[test]
fn many_lamps_under_a_sky_and_a_wrong_density() {
    let world = many_lamps(true);
    let up = Receiver::facing(Vec3::new(0.1, -0.2, 0.0), Vec3::new(0.1, 0.3, 1.0).normalize());
    let above = Receiver::facing(Vec3::new(0.5, 0.4, 3.0), -Vec3::Z);
    let sphere = || Cells::new([0.0, 0.0, 1.0], PI);
    assert_density("many lamps", &world, up, sphere());
    assert_density("many lamps from above", &world, above, sphere());
    assert_density("many lamps, anywhere", &world, Receiver::anywhere(up.p), sphere());
    assert_density("many lamps, both sides", &world, Receiver { both_sides: true, ..up }, sphere());
    // The density that forgets the receiver's normal is wrong, and seen to be.
    let d = deviate(&world, &up, &Receiver::anywhere(up.p), &sphere());
    assert!(d > Z_LIMIT, "the wrong density passes: {d}");
}

/// Lambert's formula: E = L / 2 Σ Θ Γ·n over the edges of a polygon wholly above the horizon.
fn lambert(corners: &[[f64; 3]], p: DVec3, n: DVec3) -> f64 {
    let to: Vec<DVec3> = corners.iter().map(|&c| (DVec3::from(c) - p).normalize()).collect();
    let mut sum = 0.0;
    for i in 0..to.len() {
        let (a, b) = (to[i], to[(i + 1) % to.len()]);
        sum += a.cross(b).length().atan2(a.dot(b)) * a.cross(b).normalize().dot(n);
    }
    0.5 * sum.abs()
}

/// Large luminaires close by: shadow rays by solid angle, shared with gather rays.
#[test]
fn irradiance_close_to_large_luminaires() {
    let square = [[-1.0, -1.0, 0.05], [1.0, -1.0, 0.05], [1.0, 1.0, 0.05], [-1.0, 1.0, 0.05]];
    let triangle = [[-0.5, 0.0, 0.1], [2.0, 0.5, 0.1], [0.0, 1.5, 0.3]];
    for (corners, p) in [
        (&square[..], [0.0, 0.0, 0.0]),
        (&square[..], [0.98, 0.9, 0.0]),
        (&square[..], [1.5, 0.2, 0.0]),
        (&triangle[..], [0.1, 0.3, 0.0]),
        (&triangle[..], [1.5, 1.0, 0.0]),
    ] {
        let mut scene = empty();
        let m = panel(&mut scene);
        let positions = corners.iter().map(|c| DVec3::from(*c).as_vec3()).collect();
        let indices = if corners.len() == 4 { vec![[0, 2, 1], [0, 3, 2]] } else { vec![[0, 2, 1]] };
        scene.meshes.push(Mesh { positions, indices, ..Mesh::default() });
        shape(&mut scene, Geometry::Mesh(MeshId(0)), m, emission(1.0));
        let world = World::new(scene);
        let truth = lambert(corners, DVec3::from(p), DVec3::Z);
        let e = path_irradiance(&world, p.map(|x| x as f32), [0.0, 0.0, 1.0], 3000);
        assert_is(&format!("{} corners from {p:?}", corners.len()), e, truth, truth * 1.03);
    }
}

/// A hall of 32 × 32 small lamps: E = Σ π L (r / d)² cos θ.
#[test]
fn a_thousand_lamps() {
    let (r, h) = (0.02, 2.5);
    let mut scene = empty();
    let m = panel(&mut scene);
    let mut lamps = Vec::new();
    for i in 0..1024 {
        let at = [(i % 32) as f64, (i / 32) as f64, h];
        let radiance = 50.0 * (1.0 + (i % 7) as f32);
        sphere(&mut scene, at, r, false, m, emission(radiance));
        lamps.push((DVec3::from(at), radiance as f64));
    }
    let world = World::new(scene);
    for p in [[15.3f32, 14.1, 0.0], [0.2, 31.0, 1.0], [-20.0, 5.0, 0.0]] {
        let from = DVec3::from(p.map(|x| x as f64));
        let truth: f64 = lamps
            .iter()
            .map(|&(q, l)| {
                let to = q - from;
                PI * l * r * r * to.z / to.length().powi(3)
            })
            .sum();
        let e = path_irradiance(&world, p, [0.0, 0.0, 1.0], 3000);
        assert_is(&format!("hall at {p:?}"), e, truth, truth * 1.03);
        // Picks by power alone had a relative variance of 1.9 per gather in such a hall (examples/many_lamps): 2.5 %.
        assert!(e.1 < 0.01 * truth, "{e:?}");
    }
}

/// Glossy lobes and shadow rays share luminaires by counts: the sum must not depend on the counts. Weights with densities
/// of another receiver would not add up to one.
#[test]
fn glossy_lobes_share_lamps_with_shadow_rays() {
    let world = many_lamps(true);
    let walker = Walker::path(&world);
    let n = Vec3::new(0.1, 0.3, 1.0).normalize();
    let mut s = sensor_surface(Vec3::new(0.1, -0.2, 0.0), n);
    s.wo = (n + Vec3::new(0.6, 0.1, 0.0)).normalize();
    let glossy = Bsdf::coated_diffuse(Rgb::splat(0.3), 1.5, [0.15, 0.15]);
    let with = |rays: u32, shadow_rays: u32, count: u32, seed: u64| {
        let plan = GatherPlan { rays, shadow_rays, strategy: Strategy::Jittered };
        statistics(count, |i| {
            let mut sampler = Sampler::new(seed, i as u64, 0);
            gather(&walker, &s, &glossy, &plan, &mut sampler, &mut Tally::default())[1] as f64
        })
    };
    let (a, b, c) = (with(4, 16, 4000, 1), with(64, 1, 4000, 2), with(16, 4, 4000, 3));
    println!("{a:?} {b:?} {c:?}");
    for (x, y) in [(a, b), (b, c), (a, c)] {
        let z = (x.0 - y.0) / x.1.hypot(y.1);
        assert!(z.abs() < Z_LIMIT, "{x:?} {y:?}");
        let wrong = (x.0 * 1.05 - y.0) / x.1.hypot(y.1);
        assert!(wrong.abs() > Z_LIMIT, "cannot tell 5 %: {x:?} {y:?}");
    }
}

/// Behind every luminaire there is nothing to sample.
#[test]
fn nothing_from_behind() {
    let mut scene = empty();
    let m = panel(&mut scene);
    for x in 0..5 {
        quad(&mut scene, [x as f32, 0.0, 1.0], [0.0, 0.5, 0.0], [0.5, 0.0, 0.0], m, emission(1.0));
    }
    let world = World::new(scene);
    let at = Receiver::facing(Vec3::new(2.0, 0.0, 2.0), -Vec3::Z);
    for i in 0..100 {
        assert!(world.luminaires.sample(&world.scene, &at, i as f32 / 100.0, [0.3, 0.6]).is_none());
    }
}
