//! `wiperlab inspect`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use crate::files;
use crate::load::{Loaded, load_recording};
use clap::Args;
use std::path::{Path, PathBuf};
use wiperlab::import::sha256;
use wiperlab::recording::quality::{quality, table};

#[derive(Debug, Args)]
pub struct InspectArgs {
    /// A recording's folder, or a trace.csv alone
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
}

impl InspectArgs {
    /// What is asked for is the text itself, so `--quiet` leaves the verdict.
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let loaded = load_recording(&self.recording)?;
        let recording = &loaded.recording;
        let measured = quality(recording, loaded.file.as_ref().and_then(|file| file.camera.exposure_s));
        if !global.quiet {
            print_line!("{}{}", recording.name(), if recording.is_synthetic() { " (synthetic: no camera took it)" } else { "" });
            print_origin(&loaded);
            print_line!("{}", table(&measured, recording.grid().start_s));
        }
        for line in changed_sources(&self.recording, &loaded).into_iter().chain(measured.verdict()) {
            print_line!("verdict: {line}");
        }
        Ok(Outcome::Done)
    }
}

fn print_origin(loaded: &Loaded) {
    let Some(file) = &loaded.file else {
        print_line!("no recording.toml: the rate is estimated from the times");
        return;
    };
    if let Some(source) = &file.source {
        print_line!("source            {} ({}, {})", source.file.all().join(", "), source.detected_format, source.encoding);
    }
    for (key, value) in &file.conditions {
        print_line!("condition         {key} = {value}");
    }
}

/// Sources that lie in the folder but are no longer what was imported.
fn changed_sources(path: &Path, loaded: &Loaded) -> Vec<String> {
    let Some(source) = loaded.file.as_ref().and_then(|file| file.source.as_ref()) else { return vec![] };
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new("")) };
    let changed = source.file.all().iter().zip(source.sha256.all()).filter(|(name, hash)| {
        let copy = folder.join(name);
        copy.is_file() && files::read(&copy).is_ok_and(|bytes| sha256(&bytes) != **hash)
    });
    changed.map(|(name, _)| format!("{name} is not the file that was imported (its SHA-256 differs): import it again")).collect()
}
