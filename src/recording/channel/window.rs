//! Windows `A..B`: in seconds of the recording's time, relative to instants found in the recording, or a
//! phase of a reversal by its name.

use super::instants::{InstantKind, InstantNotFound, ReversalInstants};
use super::phase::ReversalPhase;
use crate::recording::Recording;
use crate::text::parse_finite;
use serde::Serialize;
use std::fmt;
use std::ops::Range;

/// Minimum number of frames of a window: a cubic trend uses four degrees of freedom, so that four are left.
pub(crate) const MIN_FRAMES: usize = 8;

/// One end of a window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum WindowEnd {
    /// The start or end of the recording.
    Open,
    /// A time of the recording, s.
    Time(f64),
    /// An instant found in the recording, and an offset from it.
    Found {
        /// The instant.
        anchor: InstantKind,
        /// Number of the reversal, counted from 1.
        reversal: usize,
        /// Time from the instant, s.
        offset_s: f64,
    },
    /// A phase of a reversal: the start of the phase if this is the start of a window, and the end of the
    /// phase if this is the end of a window.
    Phase {
        /// The phase.
        phase: ReversalPhase,
        /// Number of the reversal, counted from 1.
        reversal: usize,
    },
}

/// A part of a recording: the frames from `from` (included) to `to` (not included).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Window {
    /// Start of the window.
    pub from: WindowEnd,
    /// End of the window.
    pub to: WindowEnd,
}

/// Why a window was refused: the window as written, what was found, what was expected and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("window `{window}`{problem}")]
pub struct WindowError {
    window: String,
    problem: String,
}

/// An instant as written in a window, and why the recording does not show it.
pub(super) type AbsentInstant = (String, InstantNotFound);

impl Window {
    /// The whole recording.
    pub const WHOLE: Self = Self { from: WindowEnd::Open, to: WindowEnd::Open };

    /// The frames of this window: those with `from <= time < to`.
    ///
    /// # Errors
    /// [`WindowError`] when an instant was not found, or the window leaves the recording, runs backwards or
    /// is shorter than `MIN_FRAMES`.
    pub fn resolve_frames(
        &self,
        recording: &Recording,
        instants: &ReversalInstants,
    ) -> Result<Range<usize>, WindowError> {
        let (frames, _, _) = self.locate_span(recording, instants)?;
        if frames.len() >= MIN_FRAMES {
            return Ok(frames);
        }
        Err(self.refuse(format!(": found {} frames, expected at least {MIN_FRAMES}; widen it", frames.len())))
    }

    fn refuse(&self, problem: String) -> WindowError {
        WindowError { window: self.to_string(), problem }
    }

    /// Frames of the window, which may be fewer than `MIN_FRAMES`, and its start and end, s.
    pub(super) fn locate_span(
        &self,
        recording: &Recording,
        instants: &ReversalInstants,
    ) -> Result<(Range<usize>, f64, f64), WindowError> {
        let grid = recording.grid();
        let (name, after_last_s) = (recording.name(), recording.time_s(grid.frames));
        let absent = |(instant, reason)| {
            let tracked = recording.traces().head_x_m.iter().any(Option::is_some);
            let turns = tracked || !instants.reversals.is_empty();
            let reason = if turns { reason } else { InstantNotFound::HeadNotTracked };
            self.refuse(format!(
                ": {name} shows no `{instant}`: {reason}; give the window in seconds of the recording's time"
            ))
        };
        let from_s = self.from.time_s(false, instants).map_err(absent)?.unwrap_or(grid.start_s);
        let to_s = self.to.time_s(true, instants).map_err(absent)?.unwrap_or(after_last_s);
        if to_s < from_s {
            let problem = format!(": it starts at {from_s:.6} s and ends at {to_s:.6} s; exchange its ends");
            return Err(self.refuse(problem));
        }
        let [from, to] = [from_s, to_s].map(|time_s| recording.frame_at_or_after(time_s));
        if from < 0.0 || to > grid.frames as f64 {
            let end_s = recording.time_s(grid.frames.saturating_sub(1));
            return Err(self.refuse(format!(
                " is {from_s:.6} s to {to_s:.6} s, but {name} runs from {:.6} s to {end_s:.6} s; choose a \
                 window inside it",
                grid.start_s
            )));
        }
        // (both are whole numbers between 0 and the number of frames)
        Ok((from as usize..to as usize, from_s, to_s))
    }
}

impl WindowEnd {
    /// Time, s, at which a window ends (if `at_end`) or starts. `None` means the end or the start of the
    /// recording, respectively.
    fn time_s(self, at_end: bool, instants: &ReversalInstants) -> Result<Option<f64>, AbsentInstant> {
        match self {
            Self::Open => Ok(None),
            Self::Time(time_s) => Ok(Some(time_s)),
            Self::Phase { phase, reversal } => phase.boundary_s(at_end, reversal, instants),
            Self::Found { anchor, reversal, offset_s } => {
                let found = instants.time_s(anchor, reversal).map(|time_s| Some(time_s + offset_s));
                found.map_err(|reason| (format!("{}[{reversal}]", anchor.name()), reason))
            }
        }
    }
}

const EXPECTED_END: &str = "seconds or one of `hold`, `reversal`, `flip`, `release` (`before`, `stick` and \
    `after` stand alone, without `..`)";
const EXPECTED_PHASE: &str = "two ends with `..` between them, or one of `before`, `stick`, `flip`, `after`";

impl Window {
    /// Parses `A..B`. Each end is empty, or a number of seconds, or `hold|reversal|flip|release` followed by
    /// an optional `[k]` (the k-th reversal, default 1) and an optional `+seconds` or `-seconds`. A whole
    /// phase of a reversal, `before|stick|flip|after` with an optional `[k]`, may be given in place of
    /// `A..B`: see [`ReversalPhase`].
    ///
    /// # Errors
    /// [`WindowError`] with the part at fault.
    pub fn parse(text: &str) -> Result<Self, WindowError> {
        let refuse = |found: &str, expected: &str| {
            let problem = format!(
                ": found `{found}`, expected {expected}; write it like `0.10..0.25`, \
                 `release+0.02..release[2]-0.1` or `after[2]`"
            );
            WindowError { window: text.to_owned(), problem }
        };
        let Some((from, to)) = text.split_once("..") else {
            return parse_phase(text.trim()).map_err(|expected| refuse(text, expected));
        };
        let end = |part: &str| parse_end(part.trim()).map_err(|expected| refuse(part.trim(), expected));
        Ok(Self { from: end(from)?, to: end(to)? })
    }
}

impl std::str::FromStr for Window {
    type Err = WindowError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::parse(text)
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.from, self.to) {
            (WindowEnd::Phase { .. }, to) if to == self.from => write!(f, "{to}"),
            (from, to) => write!(f, "{from}..{to}"),
        }
    }
}

impl fmt::Display for WindowEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Open => Ok(()),
            Self::Time(time_s) => write!(f, "{time_s}"),
            Self::Found { anchor, reversal, offset_s } => {
                let offset = if offset_s == 0.0 { String::new() } else { format!("{offset_s:+}") };
                write!(f, "{}{}{offset}", anchor.name(), format_reversal_index(reversal))
            }
            Self::Phase { phase, reversal } => {
                write!(f, "{}{}", phase.name(), format_reversal_index(reversal))
            }
        }
    }
}

fn format_reversal_index(reversal: usize) -> String {
    if reversal == 1 { String::new() } else { format!("[{reversal}]") }
}

fn parse_end(part: &str) -> Result<WindowEnd, &'static str> {
    if part.is_empty() {
        return Ok(WindowEnd::Open);
    }
    if !part.starts_with(|c: char| c.is_alphabetic()) {
        return parse_finite(part).map(WindowEnd::Time).ok_or("seconds");
    }
    let named = |anchor: InstantKind| Some((anchor, part.strip_prefix(anchor.name())?));
    let (anchor, rest) = InstantKind::ALL.into_iter().find_map(named).ok_or(EXPECTED_END)?;
    let (reversal, rest) = parse_reversal(rest)?;
    let offset_s = match rest.trim() {
        "" => 0.0,
        rest if rest.starts_with(['+', '-']) => {
            parse_finite(rest).ok_or("an offset in seconds after `+` or `-`")?
        }
        _ => return Err("`+` or `-` and an offset in seconds after the instant"),
    };
    Ok(WindowEnd::Found { anchor, reversal, offset_s })
}

/// Parses a whole phase of a reversal: `after`, `after[2]`.
fn parse_phase(text: &str) -> Result<Window, &'static str> {
    let named = |phase: ReversalPhase| Some((phase, text.strip_prefix(phase.name())?));
    let (phase, rest) = ReversalPhase::ALL.into_iter().find_map(named).ok_or(EXPECTED_PHASE)?;
    let (reversal, rest) = parse_reversal(rest)?;
    let end = WindowEnd::Phase { phase, reversal };
    if rest.trim().is_empty() { Ok(Window { from: end, to: end }) } else { Err(EXPECTED_PHASE) }
}

/// Parses an optional `[k]`: the number `k` (1 without brackets), and the text after it.
fn parse_reversal(text: &str) -> Result<(usize, &str), &'static str> {
    let Some(rest) = text.strip_prefix('[') else { return Ok((1, text)) };
    let (number, rest) = rest.split_once(']').ok_or("`]` after the number of the reversal")?;
    let number = number.parse().ok().filter(|n| *n >= 1);
    Ok((number.ok_or("the number of a reversal, counted from 1, in `[]`")?, rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::FrameGrid;
    use crate::recording::Traces;
    use crate::recording::channel::Reversal;
    use crate::recording::channel::flip::Flip;

    fn recording() -> Recording {
        let column = vec![None; 1000];
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

    fn instants() -> ReversalInstants {
        let first = Reversal {
            reversal_s: 0.7,
            hold_s: Some(0.69),
            release_s: Some(0.75),
            flip: Some(Flip { start_s: 0.71, end_s: 0.745 }),
        };
        ReversalInstants {
            reversals: vec![
                first,
                Reversal { reversal_s: 1.2, hold_s: Some(1.19), release_s: None, flip: None },
            ],
        }
    }

    fn frames(text: &str) -> Result<Range<usize>, String> {
        Window::parse(text)
            .and_then(|w| w.resolve_frames(&recording(), &instants()))
            .map_err(|e| e.to_string())
    }

    #[test]
    fn a_window_holds_the_frames_from_its_start_up_to_its_end() {
        assert_eq!(frames("0.6..0.7"), Ok(100..200));
        assert_eq!(frames("0.7..0.8"), Ok(200..300), "windows that meet share no frame");
        assert_eq!(frames(".."), Ok(0..1000));
        assert_eq!(frames("0.6005.."), Ok(101..1000));
        assert_eq!(frames("0.5..1.5"), Ok(0..1000));
    }

    #[test]
    fn instants_anchor_a_window() {
        assert_eq!(frames("release+0.02..release+0.20"), Ok(270..450));
        assert_eq!(frames("hold..release"), Ok(190..250));
        assert_eq!(frames("reversal[2]-1e-2 .. reversal[2]+0.1"), Ok(690..800));
    }

    #[test]
    fn an_instant_that_was_not_found_is_refused_with_its_reason() {
        assert!(
            frames("release[2]..")
                .unwrap_err()
                .starts_with("window `release[2]..`: r shows no `release[2]`: ")
        );
        assert!(frames("hold[3]..").unwrap_err().contains("2 reversals were found"));
    }

    #[test]
    fn windows_outside_backwards_or_short_are_refused() {
        assert!(frames("0.4..0.7").unwrap_err().contains("runs from 0.500000 s to 1.499000 s"));
        assert!(frames("0.9..1.6").unwrap_err().contains("choose a window inside it"));
        assert!(frames("0.9..0.8").unwrap_err().contains("exchange its ends"));
        assert!(frames("0.9..0.907").unwrap_err().contains("found 7 frames, expected at least 8"));
        assert!(frames("1e300..2e300").is_err() && frames("-1e300..2e300").is_err());
    }

    #[test]
    fn text_that_is_no_window_is_refused_with_the_part_at_fault() {
        for (text, part) in [
            ("0.1", "`0.1`"),
            ("a..0.2", "`a`"),
            ("0.1..inf", "`inf`"),
            ("release[0]..", "`release[0]`"),
            ("release*2..", "`release*2`"),
            ("1;2..3", "`1;2`"),
        ] {
            let message = frames(text).unwrap_err();
            assert!(message.contains(&format!("found {part}, expected")), "{message}");
        }
    }

    #[test]
    fn a_window_prints_as_it_is_written() {
        for text in ["0.1..0.25", "..", "release+0.02..release[2]-0.1", "hold..reversal"] {
            assert_eq!(Window::parse(text).unwrap().to_string(), text);
        }
    }
}
