use hemilux::world::World; use hemilux::zones::{ZoneOptions, Zones};
fn main(){ let a: Vec<String> = std::env::args().collect();
 let l = hemilux_scene::import::load(&[std::path::PathBuf::from(&a[1])], &hemilux_scene::import::LoadOptions::default()).unwrap();
 let w = World::new(l.scene);
 let z = Zones::solve(&w, &ZoneOptions{particles: a[2].parse().unwrap(), refine:0, ..Default::default()});
 println!("{:?} rays {} field {}", z.records(), z.ledger.rays, z.field().len());
 let f = |i: usize| a[i].parse::<f32>().unwrap();
 let x = hemilux_scene::geom::Vec3::new(f(3),f(4),f(5)); let n = hemilux_scene::geom::Vec3::new(f(6),f(7),f(8));
 z.records().debug(x,n);
}
