//! `wiperlab modes`.

use crate::blade::modes::{NaturalMode, Tip, modes, named};
use crate::figures::modes::figures;
use crate::program::failure::{Failure, Outcome};
use crate::program::figures::Figures;
use crate::program::files::Overwrite;
use crate::program::global::Global;
use crate::program::load::{read_scene, warn_of};
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct ModesArgs {
    /// Scene of the blade (scene.toml)
    pub scene: PathBuf,
    #[command(flatten)]
    pub figures: Figures,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl ModesArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let scene = read_scene(&self.scene)?;
        let blade = &scene.linkage;
        self.figures.check(&FIGURES, self.overwrite)?;
        warn_of(&self.scene, &scene.findings(), global);
        let names = named(blade);
        print_line!("{}", scene.title());
        print_line!("");
        print_line!("natural frequencies of the single parts");
        print_line!("  head  sqrt(k0/M)/2pi        {:10.3} Hz", names.head_hz);
        print_line!("  neck  sqrt(k1/m_theta)/2pi  {:10.3} Hz", names.neck_hz);
        print_line!("  lip   sqrt(k2/m_phi)/2pi    {:10.3} Hz", names.lip_hz);
        let sides: &[bool] = if blade.shoulder.is_some() { &[false, true] } else { &[false] };
        for &on_shoulder in sides {
            let neck = if on_shoulder { ", neck on the shoulder" } else { "" };
            print_line!("");
            print_line!("coupled modes about the upright position, no friction{neck}");
            print_line!(
                "  {:12} {:>12} {:>12} {:>9} {:>9}",
                "tip",
                "undamped Hz",
                "damped Hz",
                "ratio",
                "lip/neck"
            );
            for (tip, word) in [(Tip::Free, "slides"), (Tip::Held, "held")] {
                modes(blade, tip, on_shoulder).iter().for_each(|mode| print_mode(word, mode));
            }
        }
        let drawn = || FIGURES.into_iter().zip(figures(scene.title(), blade)).collect();
        self.figures.write(self.overwrite, global, drawn)?;
        Ok(Outcome::Done)
    }
}

/// The answer of the tip, and the shapes.
const FIGURES: [&str; 2] = ["tip-compliance", "mode-shapes"];

fn print_mode(tip: &str, mode: &NaturalMode) {
    let number = |value: Option<f64>, digits: usize, none: &str| {
        value.map_or(none.to_owned(), |v| format!("{v:.digits$}"))
    };
    print_line!(
        "  {tip:12} {:>12} {:>12} {:>9} {:>9.3}",
        number(mode.frequency_hz, 3, "unstable"),
        number(mode.damped_frequency_hz, 3, "-"),
        number(mode.damping_ratio, 4, "-"),
        mode.lip_over_neck
    );
}
