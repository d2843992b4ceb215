//! Light transport by gathering over a zonal solution, with its error.

pub mod bsdf;
