//! `wiperlab blade`.

mod check;

use crate::plausibility::PlausibilityFinding;
use crate::program::failure::{CommandOutcome, Failure};
use crate::program::files::{self, OutputCommand, Overwrite, WritePolicy};
use crate::program::global::GlobalArgs;
use crate::program::load::print_warnings;
use crate::program::output;
use crate::section::{BladeEstimate, BladeSection};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub struct BladeArgs {
    /// Section of the blade (section.toml)
    #[arg(required_unless_present = "check")]
    pub section: Option<PathBuf>,
    /// In place of a section: a scene (scene.toml) whose blade is to be checked with ruler and scale
    #[arg(long, value_name = "SCENE", conflicts_with = "section")]
    pub check: Option<PathBuf>,
    /// With --check: the length of blade that the scene's masses are for, in metres; adds masses and
    /// force per metre
    #[arg(long, value_name = "METRES", conflicts_with = "section", allow_negative_numbers = true)]
    #[arg(value_parser = parse_above_zero)]
    pub length_m: Option<f64>,
    /// With --check: the force on the tip for which its displacement is given, in newtons; 0.0098 is
    /// the weight of 1 g
    #[arg(long, value_name = "NEWTONS", conflicts_with = "section", allow_negative_numbers = true)]
    #[arg(value_parser = parse_above_zero, default_value_t = DEFAULT_FORCE_N)]
    pub force_n: f64,
    /// Folder for blade.toml and blade.json, or for checks.json
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// About the weight of a gram: it moves the tip of a blade of some centimetres by tenths of a millimetre.
const DEFAULT_FORCE_N: f64 = 0.01;

fn parse_above_zero(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| "expected a number above 0, without a unit".to_owned())
}

/// `blade.json` and `checks.json`: what was computed, with what is hard to believe in the file.
#[derive(Serialize)]
struct BladeJson<T> {
    #[serde(flatten)]
    computed: T,
    findings: Vec<PlausibilityFinding>,
}

impl BladeArgs {
    pub fn run(&self, global: &GlobalArgs) -> Result<CommandOutcome, Failure> {
        match (&self.check, &self.section) {
            (Some(scene), _) => self.check_scene(scene, global)?,
            (None, Some(section)) => self.estimate_from_section(section, global)?,
            (None, None) => {} // clap asks for one of the two
        }
        Ok(CommandOutcome::Done)
    }

    fn estimate_from_section(&self, path: &Path, global: &GlobalArgs) -> Result<(), Failure> {
        let text = files::read_toml(path)?;
        let section = BladeSection::parse(&path.display().to_string(), &text).map_err(Failure::input)?;
        let (estimate, findings) = (BladeEstimate::from_section(&section), section.find_implausible());
        print_warnings(path, &findings, global);
        let table = estimate.to_toml();
        let answer = to_json(estimate, findings)?;
        self.write_files(&[("blade.toml", table.clone().into_bytes()), ("blade.json", answer)])?;
        output::write_stdout(&output::escape_lines(&table));
        Ok(())
    }

    /// Writes the files, where a folder is given.
    fn write_files(&self, answers: &[(&str, Vec<u8>)]) -> Result<(), Failure> {
        let writer = WritePolicy::new(OutputCommand::Blade, self.overwrite);
        self.out.as_ref().map_or(Ok(()), |out| files::write_outputs(out, &writer, answers))
    }
}

fn to_json(computed: impl Serialize, findings: Vec<PlausibilityFinding>) -> Result<Vec<u8>, Failure> {
    serde_json::to_vec_pretty(&BladeJson { computed, findings }).map_err(Failure::internal)
}
