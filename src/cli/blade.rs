//! `wiperlab blade`.

use super::load::{print_warnings, read_scene};
use super::prelude::*;
use crate::model::plausibility::PlausibilityFinding;
use crate::model::section::{BladeEstimate, BladeSection};
use crate::simulate::bench_checks::BenchChecks;
use crate::text::{format_short, parse_positive, to_ascii};
use serde::Serialize;

#[derive(Debug, Args)]
pub(crate) struct BladeArgs {
    /// Section of the blade (section.toml)
    #[arg(required_unless_present = "check")]
    pub section: Option<PathBuf>,
    /// Instead of a section: a scene (scene.toml) whose blade is to be checked with ruler and scale
    #[arg(long, value_name = "SCENE", conflicts_with = "section")]
    pub check: Option<PathBuf>,
    /// With --check: the length of blade to which the scene's masses belong, in metres; adds masses and force
    /// per metre
    #[arg(long, value_name = "METRES", conflicts_with = "section", allow_negative_numbers = true)]
    #[arg(value_parser = parse_above_zero)]
    pub length_m: Option<f64>,
    /// With --check: the force on the tip for which the displacement is printed, in newtons; 0.0098 is the
    /// weight of 1 g
    #[arg(long, value_name = "NEWTONS", conflicts_with = "section", allow_negative_numbers = true)]
    #[arg(value_parser = parse_above_zero, default_value_t = DEFAULT_FORCE_N)]
    pub force_n: f64,
    /// Folder for blade.toml and blade.json, or for checks.json
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Default force on the tip, N: about the weight of 1 g. It moves the tip of a piece of blade of some
/// centimetres by tenths of a millimetre.
const DEFAULT_FORCE_N: f64 = 0.01;

fn parse_above_zero(text: &str) -> Result<f64, String> {
    let number = parse_positive(text);
    number.ok_or_else(|| "expected a number above 0, without a unit".to_owned())
}

/// Contents of `blade.json` and `checks.json`: the result, and the implausible values of the input file.
#[derive(Serialize)]
struct BladeJson<T> {
    #[serde(flatten)]
    computed: T,
    findings: Vec<PlausibilityFinding>,
}

impl BladeArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        match (&self.check, &self.section) {
            (Some(scene), _) => self.check_scene(scene, global)?,
            (None, Some(section)) => self.estimate_from_section(section, global)?,
            (None, None) => {} // clap requires one of the two
        }
        Ok(CommandOutcome::Done)
    }

    fn estimate_from_section(&self, path: &Path, global: &GlobalArgs) -> Outcome<()> {
        let text = files::read_toml(path)?;
        let section = BladeSection::parse(&path.display().to_string(), &text).map_err(Failure::input)?;
        let (estimate, findings) = (BladeEstimate::from_section(&section), section.find_implausible());
        print_warnings(path, &findings, global);
        let table = estimate.to_toml();
        let answer = to_json(estimate, findings)?;
        self.write_files(&[("blade.toml", table.clone().into_bytes()), ("blade.json", answer)])?;
        output::print_lines(&table);
        Ok(())
    }

    /// Writes the files if the user gave a folder for them.
    fn write_files(&self, answers: &[(&str, Vec<u8>)]) -> Outcome<()> {
        let writer = WritePolicy::new(OutputCommand::Blade, self.overwrite);
        self.out.as_ref().map_or(Ok(()), |out| files::write_outputs(out, &writer, answers))
    }
}

fn to_json(computed: impl Serialize, findings: Vec<PlausibilityFinding>) -> Outcome<Vec<u8>> {
    serde_json::to_vec_pretty(&BladeJson { computed, findings }).map_err(Failure::internal)
}

// `wiperlab blade --check`.

impl BladeArgs {
    pub(super) fn check_scene(&self, path: &Path, global: &GlobalArgs) -> Outcome<()> {
        let scene = read_scene(path)?;
        let (checks, findings) =
            (BenchChecks::from_scene(&scene, self.force_n, self.length_m), scene.find_implausible());
        print_warnings(path, &findings, global);
        self.write_files(&[("checks.json", to_json(&checks, findings)?)])?;
        print_line!("{}", scene.title());
        print_weights(&checks);
        print_deflections(&checks);
        print_frequencies(&checks);
        Ok(())
    }
}

fn print_heading(words: &str) {
    print_line!("");
    print_line!("{words}");
}

fn print_number(words: &str, value: f64, unit: &str) {
    print_line!("  {words:<52} {:>10} {unit}", to_ascii(&format_short(value)));
}

fn print_weights(checks: &BenchChecks) {
    print_heading("on a scale");
    print_number("neck and lip", 1e3 * checks.rubber_mass_kg, "g");
    print_number("head, neck and lip", 1e3 * checks.mass_kg, "g");
    print_number("their weight", checks.weight_n, "N");
    print_number("force on the glass, upright", checks.preload_force_n, "N");
    if let Some(per_metre) = checks.per_metre {
        print_number("neck and lip per metre", 1e3 * per_metre.rubber_mass_kg_per_m, "g/m");
        print_number("head, neck and lip per metre", 1e3 * per_metre.mass_kg_per_m, "g/m");
        print_number("force on the glass per metre", per_metre.press_force_n_per_m, "N/m");
    }
}

fn print_deflections(checks: &BenchChecks) {
    print_heading("with a ruler");
    let force = to_ascii(&format_short(1e3 * checks.tip_force_n));
    let by_force = |what| format!("{what} {force} mN along the glass");
    print_number(&by_force("tip in free air, head held, by"), 1e3 * checks.tip_displacement_m, "mm");
    print_number(&by_force("tip in free air, neck held, by"), 1e3 * checks.lip_displacement_m, "mm");
    print_number("support under the force on the glass", 1e3 * checks.preload_displacement_m, "mm");
    if let Some(slide) = checks.slide {
        print_heading("in steady slip at the head's top speed");
        print_number("speed", slide.speed_m_per_s, "m/s");
        print_number("tip behind the head", 1e3 * slide.deflection_m, "mm");
        print_number("drop of the head", 1e3 * slide.head_drop_m, "mm");
        print_number("lean of the neck", slide.neck_angle_rad.to_degrees(), "degrees");
        print_number("lean of the lip", slide.lip_angle_rad.to_degrees(), "degrees");
    }
}

fn print_frequencies(checks: &BenchChecks) {
    print_heading("in a spectrum, without friction (`wiperlab modes` has damping and the shoulder)");
    print_number("head on its support", checks.parts.head_hz, "Hz");
    print_number("neck, the lip a mass at its lower end", checks.parts.neck_hz, "Hz");
    print_number("lip, the neck held", checks.parts.lip_hz, "Hz");
    let coupled = [
        ("blade in free air, head held", &checks.free_air_hz),
        ("blade on the glass, tip slides", &checks.sliding_tip_hz),
        ("blade on the glass, tip held", &checks.held_tip_hz),
    ];
    for (words, frequency) in coupled.iter().flat_map(|(words, all)| all.iter().map(move |hz| (words, hz))) {
        match frequency {
            Some(hz) => print_number(words, *hz, "Hz"),
            None => print_line!("  {words:<52} {:>10}", "unstable"),
        }
    }
}
