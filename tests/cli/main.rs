//! The program as it is used: commands, refusals, files.

#[path = "../common/project.rs"]
mod project;
#[path = "../common/sealed.rs"]
mod sealed;
#[path = "../common/small_fit.rs"]
mod small_fit;
#[allow(dead_code, reason = "no test of commands chooses between two numbers")]
#[path = "../common/thorough.rs"]
mod thorough;
#[cfg_attr(not(unix), allow(dead_code, reason = "commands of pages run where there is a shell"))]
#[path = "../common/tracked.rs"]
mod tracked;

mod accuracy;
mod batch;
mod blade;
mod bounds;
mod demo;
mod docs;
mod estimates;
mod figures;
mod first_hour;
mod fit;
mod help;
mod import;
mod input;
mod inspect;
mod interrupt;
mod journal;
mod level;
mod mistakes;
mod no_panic;
mod options;
mod output;
mod outputs;
#[cfg_attr(not(unix), allow(dead_code, reason = "commands of pages run where there is a shell"))]
mod page;
mod readme;
mod report;
mod results;
mod same_bits;
mod shards;
mod simulate;
mod slider;
mod spectrum;
mod stability;
mod submit;
mod sweep;
mod traces;
mod video;
