//! `wiperlab blade --check`: what one can check on a blade, as a table.

use super::{BladeArgs, to_json};
use crate::program::failure::Failure;
use crate::program::global::GlobalArgs;
use crate::program::load::{print_warnings, read_scene};
use crate::section::checks::{BenchChecks, ChecksPerMetre, SteadySlipCheck};
use crate::text::{format_short, to_ascii};
use std::path::Path;

impl BladeArgs {
    pub(super) fn check_scene(&self, path: &Path, global: &GlobalArgs) -> Result<(), Failure> {
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
    if let Some(ChecksPerMetre { rubber_mass_kg_per_m, mass_kg_per_m, press_force_n_per_m }) =
        checks.per_metre
    {
        print_number("neck and lip per metre", 1e3 * rubber_mass_kg_per_m, "g/m");
        print_number("head, neck and lip per metre", 1e3 * mass_kg_per_m, "g/m");
        print_number("force on the glass per metre", press_force_n_per_m, "N/m");
    }
}

fn print_deflections(checks: &BenchChecks) {
    print_heading("with a ruler");
    let force = to_ascii(&format_short(1e3 * checks.tip_force_n));
    let by_force = |what| format!("{what} {force} mN along the glass");
    print_number(&by_force("tip in free air, head held, by"), 1e3 * checks.tip_displacement_m, "mm");
    print_number(&by_force("tip in free air, neck held, by"), 1e3 * checks.lip_displacement_m, "mm");
    print_number("support under the force on the glass", 1e3 * checks.preload_displacement_m, "mm");
    if let Some(SteadySlipCheck { speed_m_per_s, deflection_m, head_drop_m, neck_angle_rad, lip_angle_rad }) =
        checks.slide
    {
        print_heading("in steady slip at the head's top speed");
        print_number("speed", speed_m_per_s, "m/s");
        print_number("tip behind the head", 1e3 * deflection_m, "mm");
        print_number("drop of the head", 1e3 * head_drop_m, "mm");
        print_number("lean of the neck", neck_angle_rad.to_degrees(), "degrees");
        print_number("lean of the lip", lip_angle_rad.to_degrees(), "degrees");
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
    for (words, frequencies) in coupled {
        for frequency in frequencies {
            match frequency {
                Some(hz) => print_number(words, *hz, "Hz"),
                None => print_line!("  {words:<52} {:>10}", "unstable"),
            }
        }
    }
}
