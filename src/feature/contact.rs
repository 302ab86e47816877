//! Readings of the contact between tip and glass, which only a simulated run can give: stick, changes of
//! contact mode, forces.

use super::missing::MissingValue;
use super::reader::{FeatureReader, RunRecord};
use crate::recording::channel::{Window, WindowEnd};
use crate::simulate::mode::TipMode;
use crate::simulate::outputs::EnergyAudit;
use crate::simulate::{RunStatus, Transition, TransitionCause};
use serde::Serialize;

/// A reading of the contact between tip and glass in a simulated run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum ContactReading {
    /// Fraction of the duration of a window in which the tip sticks, 0 to 1.
    StickFraction(Window),
    /// Longest uninterrupted stick in a window, s.
    LongestStick(Window),
    /// Number of changes of contact mode in a window.
    Transitions(Window),
    /// Time at which the normal force first reaches zero, s.
    ContactLoss,
    /// Smallest normal force on the tip while it is in contact, N.
    LeastNormalForce,
    /// Time at which the Painlevé condition is first violated, s.
    Jam,
    /// Smallest Painlevé indicator while the tip slips.
    LeastPainleveIndicator,
}

impl ContactReading {
    /// Name of the kind of reading in a study.
    pub(crate) fn kind(self) -> &'static str {
        match self {
            Self::StickFraction(_) => "stick-fraction",
            Self::LongestStick(_) => "longest-stick",
            Self::Transitions(_) => "transitions",
            Self::ContactLoss => "contact-loss",
            Self::LeastNormalForce => "least-normal-force",
            Self::Jam => "jam",
            Self::LeastPainleveIndicator => "least-painleve-indicator",
        }
    }

    /// The window of the reading, if it has one.
    pub(crate) fn window(&self) -> Option<&Window> {
        match self {
            Self::StickFraction(w) | Self::LongestStick(w) | Self::Transitions(w) => Some(w),
            _ => None,
        }
    }

    /// Whether the value is known although the run ended early with the status `end`. A count or a fraction
    /// is not known, because it needs the rest of the run.
    pub(super) fn is_known_after(self, end: RunStatus) -> bool {
        match self {
            Self::ContactLoss | Self::LeastNormalForce => end == RunStatus::ContactLost,
            Self::Jam | Self::LeastPainleveIndicator => end == RunStatus::Jammed,
            _ => false,
        }
    }

    /// Whether the reading needs the [`EnergyAudit`] of the run, which takes time to compute.
    pub(super) fn needs_audit(self) -> bool {
        matches!(self, Self::LeastNormalForce | Self::LeastPainleveIndicator)
    }

    /// Value of the reading, in its unit.
    pub(super) fn value(self, reader: &FeatureReader) -> Result<f64, MissingValue> {
        let run = reader.run.ok_or(MissingValue::NoRun)?;
        match self {
            Self::StickFraction(window) => {
                let [from, to] = window_ends_s(&window, reader, run)?;
                let sticking_s = stick_lengths_s(run, [from, to]).fold(0.0, |sum, length| sum + length);
                Ok(sticking_s / (to - from)) // (`sum()` of no numbers is -0)
            }
            Self::LongestStick(window) => {
                Ok(stick_lengths_s(run, window_ends_s(&window, reader, run)?).fold(0.0, f64::max))
            }
            Self::Transitions(window) => {
                let [from, to] = window_ends_s(&window, reader, run)?;
                let inside = run.transitions.iter().filter(|t| (from..=to).contains(&t.time_s));
                Ok(inside.count() as f64)
            }
            Self::ContactLoss => first_time_s(run, |t| t.to == TipMode::Flight, RunStatus::ContactLost),
            Self::Jam => first_time_s(run, |t| t.cause == TransitionCause::JamImpact, RunStatus::Jammed),
            // rounding may make the force negative at the loss of contact
            Self::LeastNormalForce => extreme(run, |audit| audit.min_normal_force_n).map(|n| n.max(0.0)),
            Self::LeastPainleveIndicator => extreme(run, |audit| audit.min_painleve_indicator),
        }
    }
}

/// Start and end of a window, s. An end given as a time or relative to an instant is exact; an end given as a
/// phase is accurate to a frame.
fn window_ends_s(window: &Window, reader: &FeatureReader, run: &RunRecord) -> Result<[f64; 2], MissingValue> {
    let frames = reader.window_frames(window)?;
    let end = |end: WindowEnd, open_s: f64, frame: usize| {
        Ok::<f64, MissingValue>(match end {
            WindowEnd::Open => open_s,
            WindowEnd::Time(time_s) => time_s,
            WindowEnd::Found { anchor, reversal, offset_s } => {
                reader.instants.time_s(anchor, reversal).map_err(MissingValue::Instant)? + offset_s
            }
            WindowEnd::Phase { .. } => reader.recording.grid().time_s(frame),
        })
    };
    let [start_s, stop_s] = run.span_s;
    Ok([end(window.from, start_s, frames.start)?, end(window.to, stop_s, frames.end)?])
}

/// For each stick interval, the length of the part that is within the window, s.
fn stick_lengths_s(run: &RunRecord, [from, to]: [f64; 2]) -> impl Iterator<Item = f64> {
    run.stick_s.iter().map(move |[start, end]| end.min(to) - start.max(from)).filter(|length| *length > 0.0)
}

/// Time, s, of the first transition that satisfies the condition `is`. If no transition does and the run
/// ended with the status `end`, the time at which the run ended.
fn first_time_s(
    run: &RunRecord,
    is: impl Fn(&Transition) -> bool,
    end: RunStatus,
) -> Result<f64, MissingValue> {
    let during = run.transitions.iter().find(|transition| is(transition)).map(|t| t.time_s);
    let at_the_end = (run.run.status == end).then_some(run.run.stopped_at_s);
    during.or(at_the_end).ok_or(MissingValue::Never)
}

fn extreme(run: &RunRecord, of: fn(&EnergyAudit) -> Option<f64>) -> Result<f64, MissingValue> {
    run.audit.as_ref().and_then(of).ok_or(MissingValue::Never)
}
