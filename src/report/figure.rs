//! One file a figure: its data, its drawing and its caption; named as the SVG that it makes.

pub mod animation;
pub mod friction;
pub mod history;
pub mod phase_portrait;
pub mod poses;
pub mod ring_down;
pub mod spectrogram;
pub mod spectrum;
pub mod stick_slip;
pub mod windows;
