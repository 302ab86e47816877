//! `wiperlab modes`.

use super::load::{print_warnings, read_scene};
use super::prelude::*;
use crate::figures::modes::draw_figures;
use crate::model::modes::{NaturalMode, TipConstraint, body_frequencies, natural_modes};

#[derive(Debug, Args)]
pub(crate) struct ModesArgs {
    /// Scene of the blade (scene.toml)
    pub scene: PathBuf,
    #[command(flatten)]
    pub figures: FigureArgs,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl ModesArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let scene = read_scene(&self.scene)?;
        let blade = &scene.linkage;
        if blade.is_slider() && self.figures.folder.is_some() {
            let problem = "found a slider, expected a blade: the mode of a slider has no shape to draw; leave the option out";
            return Err(Failure::at("--figures", problem));
        }
        self.figures.check_folder(&FIGURES, self.overwrite)?;
        print_warnings(&self.scene, &scene.find_implausible(), global);
        print_line!("{}", scene.title());
        print_line!("");
        if blade.is_slider() {
            print_line!("mode of the slider on its spring, without friction; a stuck slider has no mode");
            print_line!("  undamped Hz    damped Hz     ratio");
            for mode in natural_modes(blade, TipConstraint::Free, false) {
                let [undamped, damped, ratio] = mode_numbers(&mode);
                print_line!("  {undamped:>11} {damped:>12} {ratio:>9}");
            }
            return Ok(CommandOutcome::Done);
        }
        let names = body_frequencies(blade);
        print_line!("natural frequencies of the single parts");
        print_line!("  head  sqrt(k0/M)/2pi        {:10.3} Hz", names.head_hz);
        print_line!("  neck  sqrt(k1/m_theta)/2pi  {:10.3} Hz", names.neck_hz);
        print_line!("  lip   sqrt(k2/m_phi)/2pi    {:10.3} Hz", names.lip_hz);
        let sides: &[bool] = if blade.shoulder.is_some() { &[false, true] } else { &[false] };
        for &on_shoulder in sides {
            let neck = if on_shoulder { ", neck on the shoulder" } else { "" };
            print_line!("");
            print_line!("coupled modes about the upright position, no friction{neck}");
            print_line!("  tip           undamped Hz    damped Hz     ratio  lip/neck");
            for (tip, word) in [(TipConstraint::Free, "slides"), (TipConstraint::Held, "held")] {
                natural_modes(blade, tip, on_shoulder).iter().for_each(|mode| print_mode(word, mode));
            }
        }
        let drawn = || FIGURES.into_iter().zip(draw_figures(scene.title(), blade)).collect();
        self.figures.write_figures(self.overwrite, global.quiet, drawn)?;
        Ok(CommandOutcome::Done)
    }
}

/// File names of the figures.
const FIGURES: [&str; 2] = ["tip-compliance", "mode-shapes"];

/// Undamped and damped frequency, Hz, and damping ratio as texts.
fn mode_numbers(mode: &NaturalMode) -> [String; 3] {
    let number = |value: Option<f64>, digits: usize, none: &str| {
        value.map_or(none.to_owned(), |v| format!("{v:.digits$}"))
    };
    [
        number(mode.frequency_hz, 3, "unstable"),
        number(mode.damped_frequency_hz, 3, "-"),
        number(mode.damping_ratio, 4, "-"),
    ]
}

fn print_mode(tip: &str, mode: &NaturalMode) {
    let [undamped, damped, ratio] = mode_numbers(mode);
    print_line!("  {tip:12} {undamped:>12} {damped:>12} {ratio:>9} {:>9.3}", mode.lip_over_neck);
}
