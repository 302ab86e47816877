//! `wiperlab blade --check`: what one can check on a blade, as a table.

use super::{BladeArgs, json};
use crate::program::failure::Failure;
use crate::program::global::Global;
use crate::program::load::{read_scene, warn_of};
use crate::section::checks::{Checks, PerMetre, Slide};
use crate::text::{ascii, short};
use std::path::Path;

impl BladeArgs {
    pub(super) fn check(&self, path: &Path, global: &Global) -> Result<(), Failure> {
        let scene = read_scene(path)?;
        let (checks, findings) = (Checks::of(&scene, self.force_n, self.length_m), scene.findings());
        warn_of(path, &findings, global);
        self.write(&[("checks.json", json(&checks, findings)?)])?;
        print_line!("{}", scene.title());
        print_weights(&checks);
        print_deflections(&checks);
        print_frequencies(&checks);
        Ok(())
    }
}

fn heading(words: &str) {
    print_line!("");
    print_line!("{words}");
}

fn number(words: &str, value: f64, unit: &str) {
    print_line!("  {words:<52} {:>10} {unit}", ascii(&short(value)));
}

fn print_weights(checks: &Checks) {
    heading("on a scale");
    number("neck and lip", 1e3 * checks.rubber_mass_kg, "g");
    number("head, neck and lip", 1e3 * checks.mass_kg, "g");
    number("their weight", checks.weight_n, "N");
    number("force on the glass, upright", checks.preload_force_n, "N");
    if let Some(PerMetre { rubber_mass_kg_per_m, mass_kg_per_m, press_force_n_per_m }) = checks.per_metre {
        number("neck and lip per metre", 1e3 * rubber_mass_kg_per_m, "g/m");
        number("head, neck and lip per metre", 1e3 * mass_kg_per_m, "g/m");
        number("force on the glass per metre", press_force_n_per_m, "N/m");
    }
}

fn print_deflections(checks: &Checks) {
    heading("with a ruler");
    let force = ascii(&short(1e3 * checks.tip_force_n));
    let by_force = |what| format!("{what} {force} mN along the glass");
    number(&by_force("tip in free air, head held, by"), 1e3 * checks.tip_displacement_m, "mm");
    number(&by_force("tip in free air, neck held, by"), 1e3 * checks.lip_displacement_m, "mm");
    number("support under the force on the glass", 1e3 * checks.preload_displacement_m, "mm");
    if let Some(Slide { speed_m_per_s, deflection_m, head_drop_m, neck_angle_rad, lip_angle_rad }) =
        checks.slide
    {
        heading("in steady slip at the head's top speed");
        number("speed", speed_m_per_s, "m/s");
        number("tip behind the head", 1e3 * deflection_m, "mm");
        number("drop of the head", 1e3 * head_drop_m, "mm");
        number("lean of the neck", neck_angle_rad.to_degrees(), "degrees");
        number("lean of the lip", lip_angle_rad.to_degrees(), "degrees");
    }
}

fn print_frequencies(checks: &Checks) {
    heading("in a spectrum, without friction (`wiperlab modes` has damping and the shoulder)");
    number("head on its support", checks.parts.head_hz, "Hz");
    number("neck, the lip a mass at its lower end", checks.parts.neck_hz, "Hz");
    number("lip, the neck held", checks.parts.lip_hz, "Hz");
    let coupled = [
        ("blade in free air, head held", &checks.free_air_hz),
        ("blade on the glass, tip slides", &checks.sliding_tip_hz),
        ("blade on the glass, tip held", &checks.held_tip_hz),
    ];
    for (words, frequencies) in coupled {
        for frequency in frequencies {
            match frequency {
                Some(hz) => number(words, *hz, "Hz"),
                None => print_line!("  {words:<52} {:>10}", "unstable"),
            }
        }
    }
}
