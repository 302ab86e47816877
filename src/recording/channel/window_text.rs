//! Windows as text: `A..B`, or the name of a phase.

use super::instants::InstantKind;
use super::phase::ReversalPhase;
use super::window::{Window, WindowEnd, WindowError};
use std::fmt;

const EXPECTED_END: &str = "seconds or one of `hold`, `reversal`, `flip`, `release` (`before`, `stick` and \
    `after` stand alone, without `..`)";
const EXPECTED_PHASE: &str = "two ends with `..` between them, or one of `before`, `stick`, `flip`, `after`";

impl Window {
    /// Reads `A..B`; an end is empty, seconds, or `hold|reversal|flip|release`, then `[k]` (the k-th
    /// reversal, default 1), then `+seconds` or `-seconds`. Or a whole phase of a reversal,
    /// `before|stick|flip|after`, then `[k]`: see [`ReversalPhase`].
    ///
    /// # Errors
    /// [`WindowError::Syntax`] naming the part at fault.
    pub fn parse(text: &str) -> Result<Self, WindowError> {
        let refuse = |found: &str, expected| WindowError::Syntax {
            window: text.to_owned(),
            found: found.to_owned(),
            expected,
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
                f.write_str(anchor.name())?;
                write_reversal(f, reversal)?;
                if offset_s == 0.0 { Ok(()) } else { write!(f, "{offset_s:+}") }
            }
            Self::Phase { phase, reversal } => {
                f.write_str(phase.name())?;
                write_reversal(f, reversal)
            }
        }
    }
}

fn write_reversal(f: &mut fmt::Formatter<'_>, reversal: usize) -> fmt::Result {
    if reversal == 1 { Ok(()) } else { write!(f, "[{reversal}]") }
}

fn parse_end(part: &str) -> Result<WindowEnd, &'static str> {
    if part.is_empty() {
        return Ok(WindowEnd::Open);
    }
    if !part.starts_with(|c: char| c.is_alphabetic()) {
        return parse_seconds(part).map(WindowEnd::Time).ok_or("seconds");
    }
    let (anchor, rest) = InstantKind::ALL
        .into_iter()
        .find_map(|anchor| part.strip_prefix(anchor.name()).map(|rest| (anchor, rest)))
        .ok_or(EXPECTED_END)?;
    let (reversal, rest) = parse_reversal(rest)?;
    let offset_s = match rest.trim() {
        "" => 0.0,
        rest if rest.starts_with(['+', '-']) => {
            parse_seconds(rest).ok_or("an offset in seconds after `+` or `-`")?
        }
        _ => return Err("`+` or `-` and an offset in seconds after the instant"),
    };
    Ok(WindowEnd::Found { anchor, reversal, offset_s })
}

/// A phase of a reversal as a window of its own.
fn parse_phase(text: &str) -> Result<Window, &'static str> {
    let named = ReversalPhase::ALL
        .into_iter()
        .find_map(|phase| text.strip_prefix(phase.name()).map(|rest| (phase, rest)));
    let (phase, rest) = named.ok_or(EXPECTED_PHASE)?;
    let (reversal, rest) = parse_reversal(rest)?;
    let end = WindowEnd::Phase { phase, reversal };
    if rest.trim().is_empty() { Ok(Window { from: end, to: end }) } else { Err(EXPECTED_PHASE) }
}

/// `[k]`, 1 where it is left out, and what follows it.
fn parse_reversal(text: &str) -> Result<(usize, &str), &'static str> {
    let Some(rest) = text.strip_prefix('[') else { return Ok((1, text)) };
    let (number, rest) = rest.split_once(']').ok_or("`]` after the number of the reversal")?;
    Ok((
        number.parse().ok().filter(|n| *n >= 1).ok_or("the number of a reversal, counted from 1, in `[]`")?,
        rest,
    ))
}

/// A finite number; words such as `inf` are not seconds.
fn parse_seconds(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}
