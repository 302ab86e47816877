//! Figures and pages: drawn for every medium, looked at by a rasteriser.

#[path = "../common/browser.rs"]
mod driver;
#[path = "../common/files.rs"]
mod files;
#[path = "../../examples/gallery.rs"]
mod gallery_pages;
#[path = "../common/hostile.rs"]
mod hostile;
#[path = "../common/noise.rs"]
mod noise;
#[path = "../common/project.rs"]
mod project;
#[path = "../common/raster.rs"]
mod raster;
#[path = "../common/shown.rs"]
mod shown;
#[path = "../../examples/sketch.rs"]
mod sketch_file;
#[path = "../common/small_fit.rs"]
mod small_fit;
#[path = "../common/thorough.rs"]
mod thorough;

mod browser;
mod claims;
mod comparison;
mod gallery;
mod hard_reports;
mod hostile_names;
mod media;
mod numbers;
mod sketch;
mod spectrum;
mod video;
