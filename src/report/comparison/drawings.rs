//! The blade itself: poses through the reversal, its stick and slip, and an animation.

use super::pair::Pair;
use crate::report::chart::Figure;
use crate::report::figure::poses::{self, Poses};
use crate::report::figure::stick_slip::{self, StickRaster};
use crate::report::{Drawing, FigureBlock, subtitle};

/// The figures, run by run.
pub(super) fn blocks(pairs: &[Pair]) -> Vec<FigureBlock> {
    let drawn = |pair: &Pair| {
        let shared = pair.shared.as_deref()?;
        let block = |(name, caption, figure): Drawn| FigureBlock {
            file: pair.file(name),
            caption: pair.captioned(format!("{caption}{shared}")),
            details: String::new(),
            drawing: Drawing::Chart(figure),
        };
        Some([poses(pair), stick_raster(pair)].into_iter().flatten().map(block).collect::<Vec<_>>())
    };
    pairs.iter().filter_map(drawn).flatten().chain(super::animated::blocks(pairs)).collect()
}

/// The line under the heading: what is drawn is the model, and what it was fitted to may be synthetic.
fn of_the_model(pair: &Pair) -> String {
    subtitle(pair.synthetic(), "drawn from the fitted model")
}

/// Name, caption and figure.
type Drawn = (&'static str, String, Figure);

fn poses(pair: &Pair) -> Option<Drawn> {
    let shown = Poses::of(&pair.best.motion, &pair.name(), of_the_model(pair))?;
    Some(("poses", poses::caption(&shown), poses::figure(&shown)))
}

fn stick_raster(pair: &Pair) -> Option<Drawn> {
    // on the clock of the recording, as every other figure over time is
    let shift_s = pair.aligned.shift_s;
    let stick_s = pair.best.motion.stick_s.iter().map(|[from, to]| [from + shift_s, to + shift_s]).collect();
    let shown = StickRaster { title: pair.name(), subtitle: of_the_model(pair), stick_s };
    Some(("stick-slip", stick_slip::caption(&shown), stick_slip::figure(&shown)?))
}
