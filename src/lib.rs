//! wiperlab holds high-speed-video measurements of a windshield wiper blade against a stick-slip model of it.

pub mod fit;
pub mod recording;
pub mod spectrum;
pub mod toml_file;
