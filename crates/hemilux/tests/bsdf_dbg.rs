use hemilux::bsdf::*;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
#[test]
fn dbg() {
    let t = std::time::Instant::now();
    let b = Bsdf::coated_diffuse(Rgb::WHITE, 1.5, [0.1; 2]);
    println!("varnish {:?} {:?}", t.elapsed(), b.diffuse_albedo(Vec3::Z));
    let t = std::time::Instant::now();
    let b = Bsdf::coated_conductor(1.5, [0.1; 2], Rgb::WHITE, Rgb::WHITE, [0.1; 2]);
    println!("metal {:?} {:?}", b.eval(Vec3::Z, Vec3::Z, Transport::Flux), t.elapsed());
    println!("{} {}", std::mem::size_of::<Bsdf>(), std::mem::size_of::<Lobe>());
}
