//! Every tracking format is read right or refused.

#[path = "../common/exports.rs"]
mod exports;

mod advice;
mod generated_tables;
mod motion;
mod one_reading;
mod particles;
mod pose;
mod program;
mod properties;
mod registry;
mod tables;
mod trace;
mod tracker;
mod units_and_clocks;
