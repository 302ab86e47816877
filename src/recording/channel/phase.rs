//! The phases of a reversal: before, stick, flip, after.

use super::instants::{InstantKind, ReversalInstants};
use super::window::{AbsentInstant, Window, WindowEnd};
use crate::recording::Recording;
use serde::Serialize;
use std::ops::Range;

/// A part of the motion around a reversal. The four phases follow one another without a gap: each ends where
/// the next starts.
///
/// | name | from | to |
/// |---|---|---|
/// | `before` | start of the recording, or settling of the previous reversal | the tip stops (`hold`) |
/// | `stick` | the tip stops (`hold`) | the deflection leaves its level (`flip`) |
/// | `flip` | the deflection leaves its level (`flip`) | the deflection has reached its level on the other side and the tip has slipped again (settled) |
/// | `after` | settled | the tip stops at the next reversal (`hold`), or the end of the recording |
///
/// The tip still sticks during most of `flip`, while the head passes over it. During `stick` the blade rests,
/// so a ring-down in this phase does not overlap with the flip. The phase `before` of a later reversal is the
/// phase `after` of the previous one. The type `Flip` describes how the flip is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum ReversalPhase {
    /// The blade trails on its old side.
    Before,
    /// The tip sticks and the blade rests.
    Stick,
    /// The deflection changes sides.
    Flip,
    /// The blade trails on its new side.
    After,
}

impl ReversalPhase {
    /// Every phase, in order of time.
    pub(crate) const ALL: [Self; 4] = [Self::Before, Self::Stick, Self::Flip, Self::After];

    /// Name of the phase on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::Stick => "stick",
            Self::Flip => "flip",
            Self::After => "after",
        }
    }

    /// Time of the end (if `at_end`) or the start of the phase at the `reversal`-th turn (counted from 1), s;
    /// `None` means the end or the start of the recording.
    pub(super) fn boundary_s(
        self,
        at_end: bool,
        reversal: usize,
        instants: &ReversalInstants,
    ) -> Result<Option<f64>, AbsentInstant> {
        let at = |kind: InstantKind, turn| instants.time_s(kind, turn).map_err(|reason| (kind, turn, reason));
        let settled =
            |turn| instants.settling_time_s(turn).map_err(|reason| (InstantKind::Flip, turn, reason));
        let found = match (self, at_end) {
            (Self::Before, false) if reversal == 1 => return Ok(None),
            (Self::Before, false) => settled(reversal.saturating_sub(1)),
            (Self::Before, true) | (Self::Stick, false) => at(InstantKind::Hold, reversal),
            (Self::Stick, true) | (Self::Flip, false) => at(InstantKind::Flip, reversal),
            (Self::Flip, true) | (Self::After, false) => settled(reversal),
            (Self::After, true) if reversal >= instants.reversals.len() => return Ok(None),
            (Self::After, true) => at(InstantKind::Hold, reversal + 1),
        };
        found.map(Some).map_err(|(kind, turn, reason)| (format!("{}[{turn}]", kind.name()), reason))
    }
}

/// A phase of a reversal that a recording shows.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseWindow {
    /// Name of the phase in a window: `after`, `after[2]`.
    pub name: String,
    /// The phase.
    pub phase: ReversalPhase,
    /// Number of the reversal, counted from 1.
    pub reversal: usize,
    /// Frames of the phase, those with `from_s <= time < to_s`; at least one.
    pub frames: Range<usize>,
    /// Start of the phase, s.
    pub from_s: f64,
    /// End of the phase, s.
    pub to_s: f64,
}

/// The phases of all reversals that a recording shows, in order of time and without overlap. The motion
/// between two reversals is listed once, as `after` of the first reversal. A phase is left out if the
/// recording does not show the instants at its ends.
#[must_use]
pub fn phase_windows(recording: &Recording, instants: &ReversalInstants) -> Vec<PhaseWindow> {
    let mut windows: Vec<PhaseWindow> = Vec::new();
    for reversal in 1..=instants.reversals.len() {
        for phase in ReversalPhase::ALL.into_iter().skip(usize::from(reversal > 1)) {
            let end = WindowEnd::Phase { phase, reversal };
            let window = Window { from: end, to: end };
            let Ok((frames, from_s, to_s)) = window.locate_span(recording, instants) else { continue };
            let follows = windows.last().is_none_or(|last| last.frames.end <= frames.start);
            if follows && !frames.is_empty() {
                let name = window.to_string();
                windows.push(PhaseWindow { name, phase, reversal, frames, from_s, to_s });
            }
        }
    }
    windows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::channel::Reversal;
    use crate::recording::channel::flip::Flip;
    use crate::recording::{FrameGrid, Traces};

    fn recording() -> Recording {
        let column = vec![Some(0.0); 1000];
        let traces = Traces {
            tip_x_m: column.clone(),
            tip_y_m: column.clone(),
            head_x_m: column.clone(),
            head_y_m: column,
            ..Traces::default()
        };
        Recording::new("r", FrameGrid { start_s: 0.5, frame_rate_hz: 1000.0, frames: 1000 }, traces, false)
            .unwrap()
    }

    fn turn(reversal_s: f64) -> Reversal {
        let flip = Some(Flip { start_s: reversal_s + 0.02, end_s: reversal_s + 0.05 });
        Reversal { reversal_s, hold_s: Some(reversal_s - 0.01), release_s: Some(reversal_s + 0.06), flip }
    }

    fn listed(reversals: Vec<Reversal>) -> Vec<(String, Range<usize>)> {
        phase_windows(&recording(), &ReversalInstants { reversals })
            .into_iter()
            .map(|w| (w.name, w.frames))
            .collect()
    }

    fn frames(text: &str, reversals: Vec<Reversal>) -> Result<Range<usize>, String> {
        Window::parse(text)
            .and_then(|w| w.resolve_frames(&recording(), &ReversalInstants { reversals }))
            .map_err(|e| e.to_string())
    }

    fn names(names: &[(&str, Range<usize>)]) -> Vec<(String, Range<usize>)> {
        names.iter().map(|(name, frames)| ((*name).to_owned(), frames.clone())).collect()
    }

    #[test]
    fn the_phases_of_two_reversals_tile_the_recording() {
        let expected = [
            ("before", 0..190),
            ("stick", 190..220),
            ("flip", 220..260),
            ("after", 260..690),
            ("stick[2]", 690..720),
            ("flip[2]", 720..760),
            ("after[2]", 760..1000),
        ];
        assert_eq!(listed(vec![turn(0.7), turn(1.2)]), names(&expected));
        let found = phase_windows(&recording(), &ReversalInstants { reversals: vec![turn(0.7)] });
        assert_eq!((found.len(), found[2].phase, found[2].reversal), (4, ReversalPhase::Flip, 1));
        assert!((found[2].from_s - 0.72).abs() < 1e-12 && (found[2].to_s - 0.76).abs() < 1e-12);
    }

    #[test]
    fn a_phase_is_a_window_by_its_name() {
        for (name, expected) in listed(vec![turn(0.7), turn(1.2)]) {
            assert_eq!(frames(&name, vec![turn(0.7), turn(1.2)]), Ok(expected), "{name}");
        }
        assert_eq!(frames("before[2]", vec![turn(0.7), turn(1.2)]), Ok(260..690));
        assert_eq!(frames(" after[1] ", vec![turn(0.7), turn(1.2)]), Ok(260..690));
        assert_eq!(frames("after", vec![turn(0.7)]), Ok(260..1000));
        assert_eq!(
            frames("flip..release", vec![turn(0.7)]),
            Ok(220..260),
            "the start of the flip is an instant too"
        );
        assert_eq!(frames("flip+0.01..flip[2]-0.1", vec![turn(0.7), turn(1.2)]), Ok(230..620));
    }

    #[test]
    fn the_flip_lasts_until_the_later_of_its_end_and_the_release() {
        let late = Reversal { flip: Some(Flip { start_s: 0.72, end_s: 0.78 }), ..turn(0.7) };
        assert_eq!(frames("flip", vec![late]), Ok(220..280));
        assert_eq!(frames("after", vec![late]), Ok(280..1000));
    }

    #[test]
    fn a_phase_without_its_instants_is_left_out_and_refused_with_the_instant() {
        let unreleased = Reversal { release_s: None, flip: None, ..turn(0.7) };
        assert_eq!(listed(vec![unreleased]), names(&[("before", 0..190)]));
        let advice = "give the window in seconds of the recording's time";
        let expected = format!(
            "window `after`: r shows no `flip[1]`: the tip does not rest there and then leave its place; \
             {advice}"
        );
        assert_eq!(frames("after", vec![unreleased]).unwrap_err(), expected);
        assert!(
            frames("stick", vec![unreleased])
                .unwrap_err()
                .starts_with("window `stick`: r shows no `flip[1]`: ")
        );
        let noisy = Reversal { flip: None, ..turn(0.7) };
        assert!(frames("flip", vec![noisy]).unwrap_err().contains("by no more than its noise"));
        let unheld = Reversal { hold_s: None, ..turn(1.2) };
        assert_eq!(
            listed(vec![turn(0.7), unheld]).len(),
            5,
            "before, stick, flip of the first; flip and after of the second"
        );
        assert!(
            frames("after", vec![turn(0.7), unheld])
                .unwrap_err()
                .contains("shows no `hold[2]`: the tip does not come to rest there")
        );
        assert!(
            frames("before", vec![])
                .unwrap_err()
                .contains("shows no `hold[1]`: the head does not turn in it")
        );
        assert!(
            frames("stick[3]", vec![turn(0.7), turn(1.2)])
                .unwrap_err()
                .contains("shows no `hold[3]`: 2 reversals were found")
        );
    }

    #[test]
    fn a_hold_that_spans_two_turns_gives_no_windows_that_overlap() {
        let both = |reversal_s| Reversal {
            reversal_s,
            hold_s: Some(0.69),
            release_s: Some(1.3),
            flip: Some(Flip { start_s: 1.22, end_s: 1.29 }),
        };
        assert_eq!(
            listed(vec![both(0.7), both(1.2)]),
            names(&[("before", 0..190), ("stick", 190..720), ("flip", 720..800), ("after[2]", 800..1000)])
        );
    }

    #[test]
    fn text_that_is_no_phase_is_refused() {
        for (text, part) in [
            ("stick[0]", "`stick[0]`"),
            ("sticky", "`sticky`"),
            ("after[2", "`after[2`"),
            ("after..", "`after`"),
            ("before..hold", "`before`"),
        ] {
            let message = frames(text, vec![turn(0.7)]).unwrap_err();
            assert!(message.contains(&format!("found {part}, expected")), "{message}");
        }
        assert_eq!(Window::parse("after[1]").unwrap().to_string(), "after");
        assert_eq!(Window::parse("stick[12]").unwrap().to_string(), "stick[12]");
    }
}
