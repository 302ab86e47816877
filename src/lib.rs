//! wiperlab holds high-speed-video measurements of a windshield wiper blade against a stick-slip model of it.

pub mod blade;
pub mod fit;
pub mod import;
pub mod ode;
pub mod recording;
pub mod report;
pub mod simulate;
pub mod spectrum;
pub mod toml_file;
pub mod twin;
