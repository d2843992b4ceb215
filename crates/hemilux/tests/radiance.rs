//! Radiance scenes in light: which side emits, what glass absorbs, where views look.

use hemilux::film::Film;
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::render::{Mode, RenderOptions, Renderer, Stop};
use hemilux::sampler::Sampler;
use hemilux::transport::{Arrival, Start, Tally, Walker};
use hemilux::world::World;
use hemilux::world::camera::Lens;
use hemilux_scene::geom::Vec3;
use hemilux_scene::{LoadOptions, Rgb, load_radiance_str};
use std::path::Path;
use std::sync::atomic::AtomicBool;

fn world(text: &str, view: Option<&str>) -> World {
    let loaded = load_radiance_str(text, view, Path::new("."), &LoadOptions::default());
    World::new(loaded.unwrap_or_else(|e| panic!("{e}\n{text}")).scene)
}

/// Mean radiance along a ray.
fn along(world: &World, origin: [f32; 3], dir: [f32; 3], n: u64) -> Rgb {
    let walker = Walker::path(world);
    let (origin, dir) = (Vec3::from(origin), Vec3::from(dir).normalize());
    let start = Start { origin, dir, arrival: Arrival::Full, depth: 0, worth: 0.0 };
    let mut sum = Rgb::BLACK;
    for i in 0..n {
        sum += walker.field_radiance(start, &mut Sampler::new(3, i, 0), &mut Tally::default());
    }
    sum / n as f32
}

/// Every surface, seen from outside and from within (or from its front and its back): only one of them shines.
#[test]
fn surfaces_emit_on_the_side_that_the_manual_names() {
    let light = "void light l 0 0 3 2 2 2\n";
    // Surface; a ray from outside or in front, one from within or behind; whether the first sees it shine.
    let cases = [
        ("l polygon p 0 0 12 -1 -1 0 1 -1 0 1 1 0 -1 1 0", [0.1, 0.2, 5.0], [0.1, 0.2, -5.0], true),
        ("l polygon p 0 0 12 -1 1 0 1 1 0 1 -1 0 -1 -1 0", [0.1, 0.2, 5.0], [0.1, 0.2, -5.0], false),
        ("l ring p 0 0 8 0 0 0 0 0 1 0 1", [0.1, 0.2, 5.0], [0.1, 0.2, -5.0], true),
        ("l ring p 0 0 8 0 0 0 0 0 -1 1 0", [0.1, 0.2, 5.0], [0.1, 0.2, -5.0], false),
        ("l sphere p 0 0 4 0 0 0 1", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], true),
        ("l bubble p 0 0 4 0 0 0 1", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], false),
        ("l cylinder p 0 0 7 0 -2 0 0 2 0 1", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], true),
        ("l tube p 0 0 7 0 -2 0 0 2 0 1", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], false),
        ("l cone p 0 0 8 0 -2 0 0 2 0 1 .6", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], true),
        ("l cup p 0 0 8 0 -2 0 0 2 0 1 .6", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], false),
        ("!genbox l b 2 2 2 | xform -t -1 -1 -1", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], true),
        ("!genbox l b 2 2 2 -i | xform -t -1 -1 -1", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], false),
        ("!genbox l b 2 2 2 -r .2 | xform -t -1 -1 -1 -mx", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], true),
        ("!genrev l b '-cos(PI*t)' 'sin(PI*t)' 9 | xform -mz -s 1.1", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], true),
        ("!genrev l b 'cos(PI*t)' 'sin(PI*t)' 9", [0.1, 0.2, 5.0], [0.1, 0.2, 0.3], false),
        ("!genrev l b 0 t 2", [0.1, 0.2, 5.0], [0.1, 0.2, -5.0], false),
        ("!gensurf l b 2*s-1 2*t-1 0 3 3", [0.1, 0.2, 5.0], [0.1, 0.2, -5.0], true),
    ];
    for (text, first, second, first_shines) in cases {
        let world = world(&format!("{light}{text}"), None);
        let towards = |from: [f32; 3]| {
            let down = if from[2] > 0.5 { -1.0 } else { 1.0 };
            along(&world, from, [0.0, 0.0, down], 1)[0]
        };
        let expected = if first_shines { [2.0, 0.0] } else { [0.0, 2.0] };
        assert_eq!([towards(first), towards(second)], expected, "{text}");
    }
}

/// A ray through a ball of index 1 that absorbs: L t^(2r), whatever the side it enters by; a smaller index of absorption is seen.
#[test]
fn dielectrics_absorb_by_the_length_of_the_way() {
    let sky = "void glow g 0 0 4 10 10 10 0\ng source s 0 0 4 0 0 1 360\n";
    for (r, t) in [(0.5f32, 0.5f32), (2.0, 0.9)] {
        let text = format!("{sky}void dielectric d 0 0 5 {t} 1 .25 1 0\nd sphere b 0 0 4 0 0 0 {r}");
        let world = world(&text, None);
        let got = along(&world, [0.0, 0.0, 9.0], [0.0, 0.0, -1.0], 4);
        let expected = Rgb::new(10.0 * t.powf(2.0 * r), 10.0, 10.0 * 0.25f32.powf(2.0 * r));
        for band in 0..3 {
            assert!((got[band] / expected[band] - 1.0).abs() < 1e-4, "{got:?} {expected:?}");
        }
        // Off its middle: the chord, 2 √(r² − b²).
        let b = 0.6 * r;
        let got = along(&world, [b, 0.0, 9.0], [0.0, 0.0, -1.0], 4)[0];
        assert!((got / (10.0 * t.powf(1.6 * r)) - 1.0).abs() < 1e-4);
        assert!((got / expected[0] - 1.0).abs() > 1e-2, "the chord makes no difference");
    }
}

/// Radiance along rays as rtrace 6.0a has it in a uniform surrounding of 1: polished things over nothing, at three angles.
#[test]
fn materials_reflect_and_pass_what_rtrace_says() {
    let sky = "void glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 360\n";
    let square = "m polygon p 0 0 12 -1 -1 1 1 -1 1 1 1 1 -1 1 1";
    let rays = [
        ([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]),
        ([3.0, 0.0, 3.0], [-1.0, 0.0, -1.0]),
        ([4.0, 0.0, 1.75], [-4.0, 0.0, -0.75]),
    ];
    let cases: [(&str, [f32; 3]); 2] = [
        ("void glass m 0 0 3 .9 .8 .7", [0.9004427, 0.8885123, 0.8812802]),
        ("void mirror m 0 0 3 .5 .4 .3", [0.5, 0.5, 0.5]),
    ];
    for (text, expected) in cases {
        let world = world(&format!("{sky}{text}\n{square}"), None);
        for ((origin, dir), value) in rays.iter().zip(expected) {
            // Both branches weigh the same in the mean band: the first needs many to settle.
            let got = along(&world, *origin, *dir, 40_000)[0];
            assert!((got - value).abs() < 3e-3, "{text} from {origin:?}: {got}, not {value}");
        }
    }
}

/// A fisheye of 180° sees the circle and nothing around it; a uniform sky fills π/4 of the picture.
#[test]
fn a_fisheye_has_a_circle() {
    let sky = "void glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 360\n";
    for (view, expected) in [
        ("-vth -vh 180 -vv 180", 0.25 * std::f64::consts::PI),
        ("-vts -vh 180 -vv 180", 1.0),
        ("-vtc -vh 360 -vv 60", 1.0),
    ] {
        let world = world(sky, Some(&format!("rvu {view} -vp 0 0 0 -vd 0 1 0 -vu 0 0 1")));
        let plan = GatherPlan { rays: 1, shadow_rays: 1, strategy: Strategy::Jittered };
        let options = RenderOptions { mode: Mode::Path, plan, seed: 1, max_depth: 4 };
        let renderer = Renderer::new(&world, None, 64, 64, options);
        let mut film = Film::new(64, 64, [0, 64, 0, 64]);
        renderer.run(&mut film, Stop { passes: 16, deadline: None }, &AtomicBool::new(false), |_| ());
        let mut sum = 0.0;
        film.for_each(|_, _, p| sum += p.mean()[0] as f64 / 4096.0);
        // 65,536 jittered points on the rim's pixels: 3e-4.
        assert!((sum - expected).abs() < 2e-3, "{view}: {sum}, not {expected}");
    }
}

/// North is up in the picture's middle, east on the right when one looks north from below the sky.
#[test]
fn views_look_where_they_are_told_to() {
    let text = "void light l 0 0 3 1 1 1\nl sphere s 0 0 4 0 9 0 1\n";
    let world = world(text, Some("rvu -vtv -vp 0 0 0 -vd 0 1 0 -vu 0 0 1 -vh 90 -vv 90"));
    let lens = Lens::new(&world.scene, 100, 100);
    let ray = |x, y| lens.ray(x, y, [0.5, 0.5], [0.5, 0.5]).dir;
    assert!(ray(50, 50).y > 0.999 && ray(99, 50).x > 0.69 && ray(50, 0).z > 0.69 && ray(0, 99).x < -0.5);
}

/// Rays of `vwrays` (Radiance 6.0a) through pixels (1, 0) and (3, 2) of 4 x 3: origin and direction; zero outside the image.
#[test]
fn views_are_those_of_vwrays() {
    let cases: [(&str, [[f32; 6]; 2]); 8] = [
        (
            "-vtv -vh 60 -vv 40 -vs .1 -vl -.2 -vo .5",
            [
                [1.20452, 2.43117, 3.15757, 0.406956, 0.857955, 0.313528],
                [1.46779, 2.36498, 2.89581, 0.776535, 0.605868, -0.172965],
            ],
        ),
        (
            "-vtl -vh 4 -vv 3 -vs .1 -vo .5",
            [
                [1.11353, 2.24359, 4.08985, 0.436436, 0.872872, 0.218218],
                [2.94221, 1.86011, 1.96644, 0.436436, 0.872872, 0.218218],
            ],
        ),
        (
            "-vth -vh 180 -vv 180",
            [[1.0, 2.0, 3.0, 0.0717368, 0.562692, 0.823548], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]],
        ),
        (
            "-vth -vh 120 -vv 90 -vs .1",
            [[1.0, 2.0, 3.0, 0.338541, 0.676324, 0.654198], [1.0, 2.0, 3.0, 0.88571, 0.0367562, -0.462781]],
        ),
        (
            "-vta -vh 180 -vv 180",
            [[1.0, 2.0, 3.0, -0.105727, 0.318107, 0.942141], [1.0, 2.0, 3.0, 0.679776, -0.167624, -0.714008]],
        ),
        (
            "-vta -vh 360 -vv 300 -vl .05",
            [
                [1.0, 2.0, 3.0, -0.525654, -0.534748, 0.661614],
                [1.0, 2.0, 3.0, -0.139909, -0.900321, -0.412126],
            ],
        ),
        (
            "-vtc -vh 300 -vv 60 -vs .1",
            [[1.0, 2.0, 3.0, 0.288947, 0.775076, 0.561931], [1.0, 2.0, 3.0, 0.19325, -0.804427, -0.56174]],
        ),
        (
            "-vts -vh 200 -vv 120 -vl .1",
            [[1.0, 2.0, 3.0, -0.195925, 0.444859, 0.873907], [1.0, 2.0, 3.0, 0.893506, -0.280405, -0.350741]],
        ),
    ];
    for (options, expected) in cases {
        let view = format!("rvu -vp 1 2 3 -vd 1 2 .5 -vu .1 0 1 {options}");
        let world = world("void light l 0 0 3 1 1 1\nl sphere s 0 0 4 0 9 0 1\n", Some(&view));
        let lens = Lens::new(&world.scene, 4, 3);
        for ((x, y), e) in [(1, 0), (3, 2)].into_iter().zip(expected) {
            let ray = lens.ray(x, y, [0.5, 0.5], [0.5, 0.5]);
            let dir = Vec3::new(e[3], e[4], e[5]);
            assert_eq!(ray.weight != 0.0, dir != Vec3::ZERO, "{options} {x} {y}");
            if ray.weight != 0.0 {
                assert!((ray.dir - dir).length() < 1e-5, "{options}: {} {dir}", ray.dir);
                assert!(
                    (ray.origin - Vec3::new(e[0], e[1], e[2])).length() < 2e-5,
                    "{options}: {}",
                    ray.origin
                );
            }
        }
    }
}
