//! One file a figure: its data, its drawing and its caption; named as the SVG that it makes.

pub mod animation;
pub mod corner;
pub mod cycle;
pub mod evidence;
pub mod friction;
pub mod history;
pub mod modes;
pub mod motion;
pub(in crate::report) mod naming;
pub mod phase_portrait;
pub mod poses;
pub mod profiles;
pub mod pulls;
pub mod recorded;
pub mod residuals;
pub mod ring_down;
pub mod spectrogram;
pub mod spectrum;
pub mod sweep_map;
pub mod sweep_sheet;
mod symbol;
pub mod twin;
pub mod video_frames;
pub mod windows;
pub mod work_precision;
