//! The blade itself: poses through the reversal, its stick and slip, and an animation.

use super::aligned::Aligned;
use super::{Best, Measured, first_of_its_run, heading, of_condition};
use crate::fit::job::Job;
use crate::recording::Recording;
use crate::report::chart::Figure;
use crate::report::poses::{self, Poses};
use crate::report::stick_raster::{self, StickRaster};
use crate::report::{Drawing, FigureBlock, subtitle};

/// The figures, run by run.
pub(super) fn blocks(job: &Job, measured: &[Measured], best: &[Best]) -> Vec<FigureBlock> {
    let mut figures = Vec::new();
    for (i, seen) in best.iter().enumerate() {
        let Some(same) = first_of_its_run(job, best, i) else { continue };
        let number = if best.len() > 1 { format!("-{}", i + 1) } else { String::new() };
        let (title, recording) = (heading(job, i), measured.get(i).map(|m| m.recording));
        let drawn = [poses(&title, &of_the_model(recording), seen), stick_raster(&title, recording, seen)];
        let block = |(name, caption, figure)| FigureBlock {
            file: format!("{name}{number}.svg"),
            caption: of_condition(job, i, format!("{caption}{same}")),
            drawing: Drawing::Chart(figure),
        };
        figures.extend(drawn.into_iter().flatten().map(block));
    }
    figures.extend(super::animated::blocks(job, measured, best));
    figures
}

/// The line under the heading: what is drawn is the model, and what it was fitted to may be synthetic.
fn of_the_model(recording: Option<&Recording>) -> String {
    subtitle(recording.is_some_and(Recording::is_synthetic), "drawn from the fitted model")
}

/// Name, caption and figure.
type Drawn = (&'static str, String, Figure);

fn poses(title: &str, subtitle: &str, best: &Best) -> Option<Drawn> {
    let shown = Poses::of(&best.motion, title, subtitle.to_owned())?;
    Some(("poses", poses::caption(&shown), poses::figure(&shown)))
}

fn stick_raster(title: &str, recording: Option<&Recording>, best: &Best) -> Option<Drawn> {
    // on the clock of the recording, as every other figure over time is
    let shift_s = recording.map_or(0.0, |recording| Aligned::of(recording, &best.view.recording).shift_s);
    let stick_s = best.motion.stick_s.iter().map(|[from, to]| [from + shift_s, to + shift_s]).collect();
    let shown = StickRaster { title: title.to_owned(), subtitle: of_the_model(recording), stick_s };
    Some(("stick-slip", stick_raster::caption(&shown), stick_raster::figure(&shown)?))
}
