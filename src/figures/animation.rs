//! The linkage in motion through a reversal, slowed down: a figure with what moves drawn over it, as SVG with
//! SMIL (no script).
//!
//! The still parts are a [`Figure`] like any other: a drawing to scale with the poses of a few instants, an
//! enlarged one of the tip, and the deflection and the tip's velocity over time. Over it move head, neck and
//! lip, the measured points, a word for the state of contact, and a line for the time.

pub(crate) mod caption;
mod drawing;
mod moving;
pub mod pace;
mod strips;
mod track;

use crate::blade::Linkage;
use crate::chart::{FULL_WIDTH_MM, Figure};
use crate::figures::{NO_TRACES, about, subtitle};
use crate::simulate::ModelSample;
use crate::simulate::mode::TipMode;
use crate::text::format_decimals;
use pace::PlaybackPace;

/// What an animation shows; all on one clock.
#[derive(Debug, Clone)]
pub struct Animation {
    /// What it is about, under the heading.
    pub title: String,
    /// Whether the measured motion is one that no camera took.
    pub synthetic: bool,
    /// Whether the head turns in what is shown.
    pub turns: bool,
    /// The links of the model.
    pub linkage: Linkage,
    /// Its states over what is shown, close enough for straight lines between them.
    pub samples: Vec<ModelSample>,
    /// Its modes of contact: from when on, s, and which; the first one from the first instant shown.
    pub modes: Vec<(f64, TipMode)>,
    /// When its tip sticks, s.
    pub stick_s: Vec<[f64; 2]>,
    /// Its hold around the reversal, or its longest one where the head does not turn: first and last instant
    /// of stick, s.
    pub hold_s: [f64; 2],
    /// Measured motion; `None` where there is no recording.
    pub measured: Option<TrackedMotion>,
    /// What is shown, and how much slower.
    pub pace: PlaybackPace,
}

/// What was measured, frame by frame; `None` where a point was not tracked.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrackedMotion {
    /// Instants of the frames, s.
    pub time_s: Vec<f64>,
    /// Lip tip along the sweep, m.
    pub tip_x_m: Vec<Option<f64>>,
    /// Head along the sweep, m.
    pub head_x_m: Vec<Option<f64>>,
    /// Drop of the head, m.
    pub head_drop_m: Vec<Option<f64>>,
}

/// For readers who asked for less motion: what moves is not shown to them, and the poses of the instants
/// named stay.
const LESS_MOTION: &str = "<style>@media (prefers-reduced-motion:reduce){svg .moves{display:none}}</style>\n";

/// The animation as SVG; the same always gives the same bytes. It starts at the hold, with the poses of other
/// instants next to it, which is what print shows.
#[must_use]
pub fn render_svg(animation: &Animation) -> String {
    draw_still(animation).svg_with_overlay(|plots| {
        let part = |p: &pace::PlaybackPart| format!("{} {} {}", p.from_s, p.to_s, p.slower);
        let parts: Vec<String> = animation.pace.parts.iter().map(part).collect();
        format!(
            "{LESS_MOTION}<g class=\"moves\" data-pace=\"{}\" data-duration=\"{}\">\n{}</g>\n",
            parts.join(";"),
            animation.pace.duration_s(),
            moving::moving_elements(animation, plots)
        )
    })
}

impl Animation {
    /// Which part of the motion is shown.
    #[must_use]
    pub fn part_name(&self) -> &'static str {
        if self.turns { "the reversal" } else { "its longest stick" }
    }

    /// What is seen, with its number.
    fn claim_sentence(&self) -> String {
        let rest_ms = 1e3 * (self.hold_s[1] - self.hold_s[0]);
        let when = if self.turns { " while the head turns" } else { "" };
        format!("The tip of the model rests for {} ms{when}", format_decimals(rest_ms, 1))
    }
}

/// Everything that does not move.
fn draw_still(animation: &Animation) -> Figure {
    let source = if animation.measured.is_none() { format!("{NO_TRACES}; ") } else { String::new() };
    let drawing = drawing::draw_linkage_panel(animation);
    let enlarged = drawing::draw_tip_panel(animation, drawing.height_mm);
    Figure {
        title: animation.claim_sentence(),
        subtitle: about(
            &animation.title,
            &subtitle(animation.synthetic, &format!("{source}{}", describe_pace(&animation.pace))),
        ),
        watermarked: animation.synthetic,
        description: format!(
            "Animation of the linkage of head, neck and lip through {}, with deflection and velocity of the \
             tip over time.",
            if animation.turns { "the reversal of the head" } else { animation.part_name() }
        ),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: [vec![drawing, enlarged], strips::draw_strips(animation)].concat(),
    }
}

/// "100 times slower than the motion, then 500 times".
#[must_use]
pub fn describe_pace(pace: &PlaybackPace) -> String {
    let factors: Vec<String> = pace.parts.iter().map(|p| format!("{} times", p.slower)).collect();
    match factors.as_slice() {
        [] => String::new(),
        [first, rest @ ..] => format!(
            "{first} slower than the motion{}",
            rest.iter().map(|f| format!(", then {f}")).collect::<String>()
        ),
    }
}
