//! wiperlab holds high-speed-video measurements of a windshield wiper blade against a stick-slip model of it.

pub mod blade;
pub mod ode;
pub mod recording;
pub mod simulate;
pub mod toml_file;
