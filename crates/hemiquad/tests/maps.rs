//! The maps: inverse, density, area, distortion, the appendix, the cut.

use hemiquad::map::{
    Concentric, Cone, Cosine, GgxVisible, Map, Octant, Polar, Sphere, disk_to_square, square_to_disk,
};
use hemiquad::{Dir, Key, Real, Uv};
use std::f64::consts::PI;

fn point<T: Real>(i: u64) -> Uv<T> {
    let p = Key::new(11).with(i).uniform2_f64(0);
    Uv::new(T::of(p.u).min(T::BELOW_ONE), T::of(p.v).min(T::BELOW_ONE))
}

/// Awkward places: corners, edges, diagonals, the centre.
fn awkward<T: Real>() -> Vec<Uv<T>> {
    let k = [0.0, 0.25, 0.5, 0.75, 1.0 - 1e-6, 0.5 + 1e-7, 0.5 - 1e-7, 1e-9];
    k.iter().flat_map(|&a| k.iter().map(move |&b| Uv::new(T::of(a), T::of(b)))).collect()
}

fn angle<T: Real>(a: Dir<T>, b: Dir<T>) -> f64 {
    let d = |f: fn(&Dir<T>) -> T| f(&a).to_f64() - f(&b).to_f64();
    (d(|p| p.x).powi(2) + d(|p| p.y).powi(2) + d(|p| p.z).powi(2)).sqrt()
}

/// Greatest error of uv(dir(p)) in the square (as a distance of directions when `by_direction`) and of unit length.
fn inverse_error<T: Real, M: Map<T>>(map: &M, by_direction: bool) -> (f64, f64) {
    let (mut worst, mut length): (f64, f64) = (0.0, 0.0);
    for p in (0..200_000).map(point::<T>).chain(awkward()) {
        let d = map.dir(p);
        length = length.max((d.dot(d).to_f64() - 1.0).abs());
        let q = map.uv(d).expect("a direction of the map is in its domain");
        assert!(q.u >= T::ZERO && q.u < T::ONE && q.v >= T::ZERO && q.v < T::ONE, "{p:?} {q:?}");
        let e = if by_direction {
            angle(map.dir(q), d)
        } else {
            (p.u.to_f64() - q.u.to_f64()).abs().max((p.v.to_f64() - q.v.to_f64()).abs())
        };
        worst = worst.max(e);
    }
    (worst, length)
}

#[test]
fn inverses_are_exact_in_both_precisions() {
    macro_rules! both {
        ($m32:expr, $m64:expr, $by:expr) => {{
            let (e, l) = inverse_error::<f64, _>(&$m64, $by);
            assert!(e < 1e-12 && l < 1e-14, "{} f64: {e:e} {l:e}", stringify!($m64));
            let (e, l) = inverse_error::<f32, _>(&$m32, $by);
            assert!(e < 1e-6 && l < 1e-6, "{} f32: {e:e} {l:e}", stringify!($m32));
        }};
    }
    both!(Concentric, Concentric, false);
    both!(Sphere, Sphere, true);
    both!(Cone::from_half_angle(0.3f32).unwrap(), Cone::from_half_angle(0.3f64).unwrap(), false);
    both!(Cone::from_half_angle(8.7e-5f32).unwrap(), Cone::from_half_angle(8.7e-5f64).unwrap(), false);
    both!(Cone::from_half_angle(2.5f32).unwrap(), Cone::from_half_angle(2.5f64).unwrap(), true);
    // At the horizon r loses no digits, at the pole z loses none.
    both!(Cosine, Cosine, false);
    // The edge u = 0 is one point, where v cannot be told: compare directions.
    both!(Polar, Polar, true);
}

#[test]
fn visible_normals_invert_and_integrate_to_one() {
    for (theta, ax, ay) in [(0.0, 0.5, 0.5), (0.7, 0.3, 0.1), (1.4, 0.1, 0.6), (1.5, 1.0, 1.0)] {
        let wo = Dir::from_unit(f64::sin(theta) * 0.6, f64::sin(theta) * 0.8, f64::cos(theta));
        let map = GgxVisible::new(wo, ax, ay).unwrap();
        let mut worst: f64 = 0.0;
        for i in 0..50_000 {
            let p = point::<f64>(i);
            let h = map.dir(p);
            let q = map.uv(h).unwrap_or(p);
            worst = worst.max(angle(map.dir(q), h));
        }
        assert!(worst < 1e-7, "{theta} {ax} {ay}: {worst:e}");
        // Its density against the directions that it gives: the mean of 1/pdf over a part is that part's solid angle, and the
        // integral of the density by the midpoint rule is 1.
        let n = 1500;
        let mut sum = 0.0;
        for i in 0..n * n {
            let at = Uv::new(((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64);
            sum += map.pdf_solid_angle(Concentric.dir(at));
        }
        let integral = sum * 2.0 * PI / (n * n) as f64;
        assert!((integral - 1.0).abs() < 2e-3, "{integral}");
    }
}

/// The density must be the reciprocal of the map's own Jacobian, by central differences.
fn density_error<M: Map<f64>>(map: &M) -> f64 {
    let h = 1e-6;
    let mut worst: f64 = 0.0;
    for i in 0..20_000 {
        let p = point::<f64>(i);
        let (a, b) = (2.0 * p.u - 1.0, 2.0 * p.v - 1.0);
        // Keep the differences inside one smooth piece.
        let d = 1.0 - a.abs() - b.abs();
        if [p.u, p.v, 1.0 - p.u, 1.0 - p.v, (a - b).abs(), (a + b).abs(), d.abs(), a.abs(), b.abs()]
            .iter()
            .any(|x| *x < 1e-3)
        {
            continue;
        }
        let diff = |du: f64, dv: f64| {
            let (p, q) = (map.dir(Uv::new(p.u + du, p.v + dv)), map.dir(Uv::new(p.u - du, p.v - dv)));
            [(p.x - q.x) / (2.0 * h), (p.y - q.y) / (2.0 * h), (p.z - q.z) / (2.0 * h)]
        };
        let (s, t) = (diff(h, 0.0), diff(0.0, h));
        let c = [s[1] * t[2] - s[2] * t[1], s[2] * t[0] - s[0] * t[2], s[0] * t[1] - s[1] * t[0]];
        let area = (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]).sqrt();
        worst = worst.max((area * map.pdf_solid_angle(map.dir(p)) - 1.0).abs());
    }
    worst
}

#[test]
fn densities_are_the_reciprocal_jacobians() {
    let wo = Dir::from_unit(0.6, 0.0, 0.8);
    let errors = [
        density_error(&Concentric),
        density_error(&Octant),
        density_error(&Sphere),
        density_error(&Cone::from_half_angle(0.2).unwrap()),
        density_error(&Cone::from_half_angle(2.0).unwrap()),
        density_error(&Polar),
    ];
    assert!(errors.iter().all(|e| *e < 1e-6), "{errors:?}");
    assert!(density_error(&Cosine) < 1e-3, "{:e}", density_error(&Cosine));
    let ggx = density_error(&GgxVisible::new(wo, 0.4, 0.2).unwrap());
    assert!(ggx < 1e-4, "{ggx:e}");
    // Negative control: a map with another one's density is found out.
    struct Wrong;
    impl Map<f64> for Wrong {
        fn dir(&self, at: Uv<f64>) -> Dir<f64> {
            Cosine.dir(at)
        }
        fn uv(&self, d: Dir<f64>) -> Option<Uv<f64>> {
            Cosine.uv(d)
        }
        fn pdf_solid_angle(&self, d: Dir<f64>) -> f64 {
            Concentric.pdf_solid_angle(d)
        }
    }
    assert!(density_error(&Wrong) > 0.5);
}

#[test]
fn the_appendix_and_the_short_form_agree() {
    let mut worst: f64 = 0.0;
    for p in (0..200_000).map(point::<f64>).chain(awkward()) {
        let (a, b): (Dir<f64>, Dir<f64>) = (Octant.dir(p), Concentric.dir(p));
        // acos loses half of the digits at the pole; away from it they agree to rounding.
        let limit = if b.z < 0.999_999 { 1e-13 } else { 1e-7 };
        let e = angle(a, b);
        assert!(e < limit, "{p:?}: {a:?} {b:?}");
        worst = worst.max(if b.z < 0.99 { e } else { 0.0 });
    }
    assert!(worst < 1e-14, "{worst:e}");
    // In single precision the printed form loses the pole altogether: the erratum that the short form repairs.
    let near = Uv::new(0.5f32 + 5e-5, 0.5);
    let (printed, short): (Dir, Dir) = (Octant.dir(near), Concentric.dir(near));
    assert!(printed.x == 0.0 && (short.x - 1e-4 * 2f32.sqrt()).abs() < 1e-6, "{printed:?} {short:?}");
}

#[test]
fn corners_centre_and_edges_are_where_they_belong() {
    let c: Dir<f64> = Concentric.dir(Uv::new(0.5, 0.5));
    assert_eq!((c.x, c.y, c.z), (0.0, 0.0, 1.0));
    let k = (0.5f64).sqrt();
    for (u, v, x, y) in [
        (1.0, 0.5, 1.0, 0.0),
        (0.5, 1.0, 0.0, 1.0),
        (0.0, 0.5, -1.0, 0.0),
        (0.5, 0.0, 0.0, -1.0),
        (1.0, 1.0, k, k),
        (0.0, 0.0, -k, -k),
    ] {
        let d: Dir<f64> = Concentric.dir(Uv::new(u, v));
        assert!((d.x - x).abs() < 1e-15 && (d.y - y).abs() < 1e-15 && d.z.abs() < 1e-15, "{u} {v} {d:?}");
        let (dx, dy) = square_to_disk(Uv::new(u, v));
        assert!((dx - x).abs() < 1e-15 && (dy - y).abs() < 1e-15);
    }
    assert!(disk_to_square(1.1, 0.0).is_none());
    assert!(Map::<f64>::uv(&Concentric, Dir::from_unit(0.6, 0.0, -0.8)).is_none());
    assert!(Cone::from_half_angle(0.1).unwrap().uv(Dir::from_unit(0.6, 0.0, 0.8)).is_none());
    assert!(GgxVisible::new(Dir::from_unit(0.6, 0.0, -0.8), 0.1, 0.1).is_none());
    assert!(
        Cone::from_half_angle(0.0).is_none()
            && Cone::from_cos(1.0).is_none()
            && Cone::about_sphere(2.0, 1.0).is_none()
    );
}

/// Largest and smallest singular value of the map's Jacobian.
fn singular<M: Map<f64>>(map: &M, p: Uv<f64>) -> (f64, f64) {
    let h = 1e-6;
    let diff = |du: f64, dv: f64| {
        let (p, q) = (map.dir(Uv::new(p.u + du, p.v + dv)), map.dir(Uv::new(p.u - du, p.v - dv)));
        [(p.x - q.x) / (2.0 * h), (p.y - q.y) / (2.0 * h), (p.z - q.z) / (2.0 * h)]
    };
    let (s, t) = (diff(h, 0.0), diff(0.0, h));
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (e, f, g) = (dot(s, s), dot(s, t), dot(t, t));
    let root = (((e - g) / 2.0).powi(2) + f * f).sqrt();
    (((e + g) / 2.0 + root).sqrt(), ((e + g) / 2.0 - root).max(0.0).sqrt())
}

#[test]
fn distortion_is_what_the_documentation_says() {
    let (mut ratio, mut least, mut stretch): (f64, f64, f64) = (0.0, 9.0, 0.0);
    let mut polar: f64 = 9.0;
    for i in 0..400 * 400 {
        let p = Uv::new(((i % 400) as f64 + 0.5) / 400.0, ((i / 400) as f64 + 0.25) / 400.0);
        let (big, small) = singular(&Concentric, p);
        ratio = ratio.max(big / small);
        least = least.min(big / small);
        stretch = stretch.max(big);
        let (big, small) = singular(&Polar, p);
        polar = polar.min(small / big);
    }
    // The corners are approached, not reached.
    assert!(
        (ratio - 3.00).abs() < 0.03 && (least - 1.27).abs() < 0.01 && (stretch - 4.34).abs() < 0.02,
        "{ratio} {least} {stretch}"
    );
    assert!(polar < 0.01, "(θ, φ) has no such bound: {polar}");
}

/// Directions a small angle apart: how far apart on the square at worst?
fn worst_separation<M: Map<f64>>(map: &M) -> f64 {
    let eps = 1e-3;
    (0..40_000u64)
        .map(|i| {
            let d = Concentric.dir(point::<f64>(i));
            let t = Concentric.dir(point::<f64>(i + 1_000_000));
            let e = Dir::normalize(d.x + eps * t.x, d.y + eps * t.y, d.z + eps * t.z).unwrap();
            let (a, b) = (map.uv(d).unwrap(), map.uv(e).unwrap());
            (a.u - b.u).hypot(a.v - b.v)
        })
        .fold(0.0, f64::max)
}

#[test]
fn the_concentric_map_has_no_cut_and_theta_phi_has_one() {
    // Smallest singular value 2π / 4.34 = 1.45: at most 0.69e-3 on the square for 1e-3 rad.
    assert!(worst_separation(&Concentric) < 0.8e-3);
    assert!(worst_separation(&Polar) > 0.9);
}

#[test]
fn blocks_of_eight_give_the_same_bits() {
    use hemiquad::map::blocks::{Uv8, concentric8, cosine8};
    for k in 0..1000u64 {
        let mut at = Uv8::default();
        for i in 0..8 {
            let p: Uv = point(8 * k + i as u64);
            (at.u[i], at.v[i]) = (p.u, p.v);
        }
        let (a, b) = (concentric8(&at), cosine8(&at));
        for i in 0..8 {
            let p = Uv::new(at.u[i], at.v[i]);
            let (c, d): (Dir, Dir) = (Concentric.dir(p), Cosine.dir(p));
            assert_eq!((a.x[i], a.y[i], a.z[i]), (c.x, c.y, c.z));
            assert_eq!((b.x[i], b.y[i], b.z[i]), (d.x, d.y, d.z));
        }
    }
}

#[test]
fn the_guaranteed_cap_is_the_largest_that_can_be_missed() {
    let degrees = |n| Concentric::guaranteed_cap(n).to_degrees();
    assert!(
        (degrees(10) - 23.8).abs() < 0.3 && (degrees(16) - 15.0).abs() < 0.3,
        "{} {}",
        degrees(10),
        degrees(16)
    );
    // By brute force for n = 10: the farthest point of every cell from many centres, horizon included.
    let n = 10;
    let mut worst: f64 = 0.0;
    for i in 0..3000u64 {
        let p = point::<f64>(i);
        let c = Concentric.dir(if i % 2 == 0 { p } else { Uv::new(p.u, 0.0) });
        let mut best = f64::INFINITY;
        for cell in 0..n * n {
            let (x, y) = ((cell % n) as f64, (cell / n) as f64);
            let mut far: f64 = 0.0;
            for k in 0..=6 {
                let t = k as f64 / 6.0;
                for (a, b) in [(t, 0.0), (t, 1.0), (0.0, t), (1.0, t)] {
                    let q: Dir<f64> = Concentric.dir(Uv::new((x + a) / n as f64, (y + b) / n as f64));
                    far = far.max(q.dot(c).clamp(-1.0, 1.0).acos());
                }
            }
            best = best.min(far);
        }
        worst = worst.max(best);
    }
    let claimed = Concentric::guaranteed_cap(n);
    assert!(
        worst <= claimed * 1.005 && worst > claimed * 0.97,
        "{} {}",
        worst.to_degrees(),
        claimed.to_degrees()
    );
}
