//! Exact answers (equations, identities, convergence, and what a run may not do), published numbers, and
//! known values that are found again.

#[path = "../common/belt.rs"]
mod belt;
#[path = "../common/blade.rs"]
mod blade;
#[path = "../../examples/sliding/chatter.rs"]
mod chatter_sweep;
#[path = "../../crates/short-spectra/examples/spectra/counts.rs"]
mod counts;
#[path = "../../examples/cycles/count.rs"]
mod cycle_count;
#[path = "../../crates/short-spectra/examples/spectra/hard.rs"]
mod hard;
#[path = "../common/lagrangian.rs"]
mod lagrangian;
#[path = "../common/noise.rs"]
mod noise;
#[path = "../common/scenes.rs"]
mod scenes;
#[path = "../../crates/short-spectra/examples/spectra/score.rs"]
mod score;
#[path = "../../crates/short-spectra/examples/spectra/signal.rs"]
mod signal;
#[path = "../../examples/sliding/growth.rs"]
mod sliding_growth;
#[path = "../common/thorough.rs"]
mod thorough;

mod allocations;
mod analysis;
mod belts;
mod bits;
mod chatter;
mod clock;
mod compliance;
mod conditioning;
mod cycles;
mod diagnosis;
mod drive;
mod equations;
mod features;
mod film;
mod flight;
mod friction_law;
mod hard_cases;
mod hard_records;
mod identities;
mod impact;
mod level;
mod multitaper;
mod newcomer;
mod paper_scheme;
mod plausibility;
mod quality;
mod recover;
mod ridge;
mod section;
mod sensitivity;
mod series;
mod shutter;
mod slack;
mod slider;
mod spectrum;
mod stability;
mod strokes;
mod sweep;
mod tilt;
mod transitions;
mod untracked;
mod validate;
