//! Light transport by gathering over a zonal solution, with its error.
//!
//! The data flow is one way: a [`hemilux_scene::Scene`] is prepared into a [`world::World`]; particles make
//! [`zones::Zones`] from it; [`gather`] integrates the hemisphere at every visible point over them; [`film::Film`] keeps
//! the sums; [`render`] drives it all over tiles, passes and threads.
//!
//! Four modes: `zonal` (gather rays end on zones: fast, smooth, **biased by the zones**), `corrected` (the same with
//! residuals that take the bias away), `path` (the unbiased reference, [`transport`] without zones) and `zones` (the zonal
//! solution as one sees it).

pub mod adaptive;
pub mod bsdf;
pub mod check;
pub mod checkpoint;
pub mod film;
pub mod gather;
mod guide;
pub mod hints;
mod images;
pub mod picture;
pub mod prologue;
pub mod render;
pub mod residual;
pub mod sampler;
pub mod sense;
pub mod sensor;
pub mod strategies;
pub mod transport;
pub mod validate;
pub mod world;
pub mod wrong;
pub mod zones;
