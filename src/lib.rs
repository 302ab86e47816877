//! wiperlab holds high-speed-video measurements of a windshield wiper blade against a stick-slip model of it.

pub mod import;
pub mod recording;
pub mod report;
pub mod spectrum;
pub mod toml_file;
