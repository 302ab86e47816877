//! A component whose frequency drifts: short-time spectra, and the course of the strongest component in a
//! band.
//!
//! A stick-slip cycle follows the speed of the tip, so that a spectrum of the whole record smears it over all
//! the frequencies it passes. [`Spectrogram`] cuts the record into overlapping Hann-weighted segments.
//! [`Spectrogram::ridge`] follows the strongest component from column to column (`time_frequency/path.rs`)
//! and then fits to each segment a sinusoid whose frequency and amplitude change linearly
//! (`time_frequency/chirp.rs`): unlike the place of a maximum between bins, that frequency holds at the
//! centre of the segment, and with the fitted rate it can be carried to the ends of the record, half a
//! segment farther out.
//!
//! What is held in `tests/verify/ridge.rs`: a chirp of 359 to 692 Hz in 0.1 to 0.6 s at 20 dB comes back as
//! that range within 2 %, also with harmonics, a remainder of a ring-down, or a fifth of the frames missing.
//! What it cannot do: a frequency that swings within a segment (a cycle that follows a faster ring-down of
//! the tip) comes back as its mean, and says so by larger deviations; a frequency that turns round at the
//! very end of a record of a tenth of a second is carried 2 to 3 % too far.

mod chirp;
mod choice;
mod columns;
pub mod course;
mod follow;
mod noise;
mod path;
mod range;
mod ridge;
mod segment;
mod spectrogram;
mod tracker;

pub use course::SpeedPoint;
pub use range::FrequencyRange;
pub use ridge::{Ridge, RidgeEnd, RidgePoint};
pub use segment::MOST_COLUMNS;

pub use spectrogram::{Spectrogram, SpectrogramSettings, default_band_hz};
