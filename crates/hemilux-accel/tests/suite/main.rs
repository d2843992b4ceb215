//! The package's tests, in one binary: they share their scenes.

mod oracle;
mod quadrics;
mod support;
mod watertight;
