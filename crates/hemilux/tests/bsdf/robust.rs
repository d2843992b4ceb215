//! Random and extreme parameters and directions: nothing is ever infinite, negative or not a number, weights are bounded, and what
//! `sample` says agrees with `eval` and `pdf_solid_angle`.

use crate::stats::Random;
use crate::{direction, materials};
use hemilux::bsdf::{Bsdf, Lobe, LobeClass, MAX_LOBES, Transport};
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// A roughness from a few, extremes among them: each new one costs a coat its tables.
fn alpha(random: &mut Random) -> [f32; 2] {
    const SOME: [f32; 4] = [0.0, 0.0011, 0.37, 1.0];
    let mut one = || SOME[random.bits() as usize % SOME.len()];
    let (a, b) = (one(), one());
    if random.bits().is_multiple_of(3) { [a, b] } else { [a; 2] }
}

fn colour(random: &mut Random) -> Rgb {
    let mut one = || match random.bits() % 4 {
        0 => 0.0,
        1 => 1.0,
        _ => random.unit(),
    };
    Rgb::new(one(), one(), one())
}

fn material(random: &mut Random, depth: usize) -> Bsdf {
    let eta = [1.0, 1.0005, 1.01, 1.33, 1.5, 3.0, 0.5, 0.95][random.bits() as usize % 8];
    let a = alpha(random);
    match random.bits() % if depth < 4 { 10 } else { 8 } {
        0 => Bsdf::diffuse(colour(random)),
        1 => Bsdf::conductor(colour(random) * 5.0, colour(random) * 10.0, a),
        2 => Bsdf::conductor_reflectance(colour(random), a),
        3 => Bsdf::dielectric(eta, a),
        4 => Bsdf::thin_dielectric(eta),
        5 => Bsdf::coated_diffuse(colour(random), eta, a),
        6 => Bsdf::coated_conductor(eta, a, colour(random) * 3.0, colour(random) * 8.0, alpha(random)),
        7 => Bsdf::diffuse_transmission(colour(random), colour(random)),
        _ => {
            let (a, b) = (material(random, depth + 1), material(random, depth + 1));
            Bsdf::mix(&a, &b, random.unit())
        }
    }
}

fn view(random: &mut Random) -> Vec3 {
    let sign = if random.bits().is_multiple_of(2) { 1.0 } else { -1.0 };
    let phi = random.unit() * std::f32::consts::TAU;
    match random.bits() % 10 {
        0 => Vec3::Z * sign,
        1 => direction(0.0, phi),
        2 => direction(1e-20 * sign, phi),
        3 => direction(1e-7 * sign, phi),
        4 => direction(2e-6 * sign, phi),
        5 => direction(1e-3 * sign, phi),
        6 => Vec3::X * sign,
        _ => direction(random.unit() * sign, phi),
    }
}

fn coordinate(random: &mut Random) -> f32 {
    match random.bits() % 8 {
        0 => 0.0,
        1 => BELOW_ONE,
        2 => 0.5,
        _ => random.unit(),
    }
}

fn sound(value: Rgb) -> bool {
    value.is_finite() && value.0.iter().all(|&v| v >= 0.0)
}

#[test]
fn nothing_is_ever_infinite_or_negative() {
    let mut random = Random(2);
    let (mut heaviest, mut sampled) = (0f32, 0);
    for i in 0..40_000 {
        let bsdf = material(&mut random, 0);
        assert!(bsdf.lobes().len() <= MAX_LOBES);
        for _ in 0..12 {
            let (wo, wi) = (view(&mut random), view(&mut random));
            let context = || format!("material {i}: {bsdf:?}\nwo {wo} wi {wi}");
            for t in [Transport::Radiance, Transport::Flux] {
                assert!(sound(bsdf.eval(wo, wi, t)), "{}", context());
            }
            let pdf = bsdf.pdf_solid_angle(wo, wi);
            assert!(pdf.is_finite() && pdf >= 0.0, "{}", context());
            for albedo in [bsdf.albedo(wo), bsdf.diffuse_albedo(wo), bsdf.diffuse_transmission_albedo(wo)] {
                assert!(sound(albedo) && albedo.max() < 1.02, "{albedo:?} {}", context());
            }
            let u = [coordinate(&mut random), coordinate(&mut random)];
            let all = bsdf.sample(wo, coordinate(&mut random), u, Transport::Flux);
            for s in
                all.into_iter().chain(bsdf.lobes().iter().filter_map(|l| l.sample(wo, u, Transport::Flux)))
            {
                assert!(sound(s.weight) && s.pdf.is_finite() && s.pdf >= 0.0, "{s:?} {}", context());
                assert!((s.wi.length() - 1.0).abs() < 1e-4, "{s:?} {}", context());
                assert_eq!(s.transmitted, s.wi.z * wo.z < 0.0, "{s:?} {}", context());
                assert_eq!(s.delta, s.pdf == 0.0, "{s:?} {}", context());
                heaviest = heaviest.max(s.weight.max());
                sampled += 1;
            }
        }
    }
    println!("heaviest weight of {sampled} samples: {heaviest}");
    assert!(sampled > 100_000 && heaviest < 10.0, "{heaviest}");
}

/// f |cos| / pdf from the three functions, over ordinary directions.
#[test]
fn weights_are_value_times_cosine_over_density() {
    let mut random = Random(3);
    for (name, bsdf) in materials() {
        let mut compared = 0;
        for _ in 0..4000 {
            let wo = direction(2.0 * random.unit() - 1.0, 6.0 * random.unit());
            let (u_lobe, u) = (random.unit(), random.square());
            if let Some(s) =
                bsdf.sample(wo, u_lobe, u, Transport::Radiance).filter(|s| !s.delta && wo.z.abs() > 0.02)
            {
                check(
                    name,
                    wo,
                    s.wi,
                    s.weight,
                    s.pdf,
                    bsdf.eval(wo, s.wi, Transport::Radiance),
                    bsdf.pdf_solid_angle(wo, s.wi),
                );
                assert!(bsdf.lobes()[s.lobe as usize].kind() != LobeClass::Delta);
                compared += 1;
            }
            for lobe in bsdf.lobes().iter().filter(|l| l.kind() != LobeClass::Delta) {
                if let Some(s) = lobe.sample(wo, u, Transport::Radiance).filter(|_| wo.z.abs() > 0.02) {
                    let (f, pdf) = (lobe.eval(wo, s.wi, Transport::Radiance), lobe.pdf_solid_angle(wo, s.wi));
                    check(name, wo, s.wi, s.weight, s.pdf, f, pdf);
                }
            }
        }
        assert_eq!(compared > 500, bsdf.has_non_delta(), "{name}");
    }
}

fn check(name: &str, wo: Vec3, wi: Vec3, weight: Rgb, pdf: f32, f: Rgb, claimed_pdf: f32) {
    // Half vectors of lobes of 0.002 keep four digits.
    let tolerance = if name.ends_with("0.002") || name.ends_with("0.02") { 2e-2 } else { 2e-3 };
    if wi.z.abs() > 0.02 {
        let off = mismatch(wi, weight, pdf, f, claimed_pdf);
        assert!(off < tolerance, "{name}: wo {wo} wi {wi} {weight:?} pdf {pdf} {claimed_pdf} f {f:?}: {off}");
    }
}

/// Largest relative difference of a sample's density and weight from what `eval` and `pdf_solid_angle` say.
fn mismatch(wi: Vec3, weight: Rgb, pdf: f32, f: Rgb, claimed_pdf: f32) -> f32 {
    let bands = (0..3).map(|band| {
        let expected = f[band] * wi.z.abs() / claimed_pdf;
        (weight[band] - expected).abs() / (0.05 + expected)
    });
    bands.fold((pdf / claimed_pdf - 1.0).abs(), f32::max)
}

/// Negative control: the value of a slightly rougher metal does not match.
#[test]
fn wrong_values_are_seen() {
    let (metal, rougher) = (Bsdf::conductor_reflectance(Rgb::WHITE, [0.3; 2]), [0.31; 2]);
    let rougher = Bsdf::conductor_reflectance(Rgb::WHITE, rougher);
    let wo = direction(0.6, 0.0);
    let s = metal.sample(wo, 0.5, [0.3, 0.8], Transport::Radiance).unwrap();
    let (f, pdf) = (metal.eval(wo, s.wi, Transport::Radiance), metal.pdf_solid_angle(wo, s.wi));
    assert!(mismatch(s.wi, s.weight, s.pdf, f, pdf) < 2e-3);
    assert!(mismatch(s.wi, s.weight, s.pdf, rougher.eval(wo, s.wi, Transport::Radiance), pdf) > 2e-3);
    assert!(mismatch(s.wi, s.weight, s.pdf, f, rougher.pdf_solid_angle(wo, s.wi)) > 2e-3);
}

#[test]
fn users_nonsense_is_tamed() {
    let nan = f32::NAN;
    let bad = Rgb::new(nan, -1.0, f32::INFINITY);
    for bsdf in [
        Bsdf::diffuse(bad),
        Bsdf::conductor(bad, bad, [nan, -1.0]),
        Bsdf::conductor_reflectance(bad, [f32::INFINITY, nan]),
        Bsdf::dielectric(nan, [0.2; 2]),
        Bsdf::dielectric(-1.0, [0.2; 2]),
        Bsdf::dielectric(f32::INFINITY, [0.0; 2]),
        Bsdf::thin_dielectric(0.0),
        Bsdf::coated_diffuse(bad, nan, [0.1; 2]),
        Bsdf::coated_conductor(nan, [nan; 2], bad, bad, [nan; 2]),
        Bsdf::coated_conductor(1.5, [0.1; 2], bad, bad, [nan; 2]),
        Bsdf::mix(&Bsdf::diffuse(Rgb::WHITE), &Bsdf::none(), nan),
    ] {
        let mut random = Random(5);
        for _ in 0..200 {
            let (wo, wi) = (view(&mut random), view(&mut random));
            assert!(sound(bsdf.eval(wo, wi, Transport::Flux)) && sound(bsdf.albedo(wo)), "{bsdf:?}");
            if let Some(s) = bsdf.sample(wo, random.unit(), random.square(), Transport::Flux) {
                assert!(sound(s.weight) && s.wi.is_finite(), "{bsdf:?}");
            }
        }
    }
    let diffuse = Bsdf::diffuse(Rgb::WHITE);
    let nowhere = Vec3::splat(nan);
    assert!(diffuse.eval(nowhere, Vec3::Z, Transport::Flux).is_black());
    assert!(diffuse.sample(nowhere, 0.5, [0.5; 2], Transport::Flux).is_none());
}

#[test]
fn nothing_scatters_nothing() {
    let none = Bsdf::none();
    assert!(none.is_black() && !none.has_delta() && !none.has_non_delta());
    assert!(none.sample(Vec3::Z, 0.5, [0.5; 2], Transport::Flux).is_none());
    assert_eq!(none.pdf_solid_angle(Vec3::Z, Vec3::Z), 0.0);
    assert!(Bsdf::diffuse(Rgb::BLACK).is_black());
}

#[test]
fn mixtures_add_up() {
    let red = Bsdf::diffuse(Rgb::new(0.8, 0.0, 0.0));
    let green = Bsdf::diffuse(Rgb::new(0.0, 0.4, 0.0));
    let mixed = Bsdf::mix(&red, &green, 0.25);
    assert_eq!(mixed.lobes().len(), 1);
    let albedo = mixed.diffuse_albedo(Vec3::Z);
    assert!((albedo[0] - 0.6).abs() < 1e-6 && (albedo[1] - 0.1).abs() < 1e-6);
    // No trace of a material of weight zero.
    assert_eq!(Bsdf::mix(&red, &Bsdf::thin_dielectric(1.5), 0.0).lobes(), red.lobes());
    assert_eq!(Bsdf::mix(&red, &green, 1.0).lobes(), green.lobes());
    // Many glasses: room for four pairs, and never half a pair.
    let glass = |eta| Bsdf::dielectric(eta, [0.2; 2]);
    let four =
        Bsdf::mix(&Bsdf::mix(&glass(1.3), &glass(1.4), 0.5), &Bsdf::mix(&glass(1.5), &glass(1.6), 0.5), 0.5);
    assert_eq!(four.lobes().len(), 8);
    let five = Bsdf::mix(&four, &glass(1.7), 0.3);
    let reflecting = five.lobes().iter().filter(|l| !l.is_transmissive()).count();
    assert!(reflecting * 2 == five.lobes().len() && reflecting > 0);
    assert!(five.albedo(Vec3::Z).max() <= 1.0 + 1e-6);
}

/// The deterministic split of a delta lobe: its branches are what `sample` draws, in proportion to their flux.
#[test]
fn branches_are_what_is_sampled() {
    for (name, bsdf) in materials() {
        for (i, lobe) in bsdf.lobes().iter().enumerate() {
            let wo = direction(-0.8, 1.0);
            let branches: Vec<_> = lobe.branches(wo, Transport::Radiance).into_iter().flatten().collect();
            assert_eq!(branches.is_empty(), lobe.kind() != LobeClass::Delta, "{name} {i}");
            if branches.is_empty() {
                continue;
            }
            let n = 1000;
            let mut sums = vec![0.0; branches.len()];
            for k in 0..n {
                let u = [(k as f32 + 0.5) / n as f32, 0.3];
                let s = lobe.sample(wo, u, Transport::Radiance).unwrap();
                let at = branches
                    .iter()
                    .position(|b| b.wi == s.wi && b.transmitted == s.transmitted && b.eta == s.eta)
                    .unwrap();
                sums[at] += s.weight[0] / n as f32;
            }
            for (sum, branch) in sums.iter().zip(&branches) {
                assert!((sum - branch.weight[0]).abs() < 3e-3, "{name} {i}: {sums:?} {branches:?}");
            }
        }
    }
}

#[test]
fn lobes_stay_small() {
    println!("Lobe {} bytes, Bsdf {} bytes", size_of::<Lobe>(), size_of::<Bsdf>());
    assert!(size_of::<Bsdf>() <= 400);
}
