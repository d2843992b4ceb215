use hemilux::world::World; use hemilux::zones::{ZoneOptions, Zones};
fn main(){ let a: Vec<String> = std::env::args().collect();
 let l = hemilux_scene::import::load(&[std::path::PathBuf::from(&a[1])], &hemilux_scene::import::LoadOptions::default()).unwrap();
 let w = World::new(l.scene);
 let z = Zones::solve(&w, &ZoneOptions{particles: a[2].parse().unwrap(), refine:0, ..Default::default()});
 println!("{:?} rays {} field {}", z.records(), z.ledger.rays, z.field().len());
 z.records().debug();
}
