//! What only a simulated run knows of the contact: stick, changes of mode, forces.

use super::missing::Missing;
use super::reader::Reader;
use super::run_record::RunRecord;
use crate::recording::channel::{Window, WindowEnd};
use crate::simulate::mode::Mode;
use crate::simulate::outputs::Audit;
use crate::simulate::{Cause, Status, Transition};
use serde::Serialize;

/// A reading of the contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Contact {
    /// Share of a window in which the tip sticks.
    StickFraction(Window),
    /// Longest uninterrupted stick in a window, s.
    LongestStick(Window),
    /// Changes of mode in a window.
    Transitions(Window),
    /// When the normal force first reaches zero, s.
    ContactLoss,
    /// Least normal force in contact, N.
    LeastNormalForce,
    /// When the Painlevé condition first fails, s.
    Jam,
    /// Least Painlevé indicator in slip.
    LeastPainleveIndicator,
}

impl Contact {
    /// Its kind in a study.
    #[must_use]
    pub fn kind(self) -> &'static str {
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

    /// The window that it is read from, where it has one.
    #[must_use]
    pub fn window(&self) -> Option<&Window> {
        match self {
            Self::StickFraction(window) | Self::LongestStick(window) | Self::Transitions(window) => {
                Some(window)
            }
            Self::ContactLoss | Self::LeastNormalForce | Self::Jam | Self::LeastPainleveIndicator => None,
        }
    }

    /// Whether it is known from a run that ended like this. A count or a share is not: what comes after the
    /// end would belong to it.
    pub(super) fn is_known_after(self, end: Status) -> bool {
        match self {
            Self::ContactLoss | Self::LeastNormalForce => end == Status::ContactLost,
            Self::Jam | Self::LeastPainleveIndicator => end == Status::Jammed,
            Self::StickFraction(_) | Self::LongestStick(_) | Self::Transitions(_) => false,
        }
    }

    /// Whether it takes the extremes over a run, which cost work.
    pub(super) fn needs_audit(self) -> bool {
        matches!(self, Self::LeastNormalForce | Self::LeastPainleveIndicator)
    }

    /// Its value, in its unit.
    pub(super) fn value(self, reader: &Reader) -> Result<f64, Missing> {
        let run = reader.run().ok_or(Missing::NoRun)?;
        match self {
            Self::StickFraction(window) => {
                let [from, to] = ends_s(&window, reader, run)?;
                let sticking_s = stick_lengths_s(run, [from, to]).fold(0.0, |sum, length| sum + length);
                Ok(sticking_s / (to - from)) // (an empty sum() is -0)
            }
            Self::LongestStick(window) => {
                Ok(stick_lengths_s(run, ends_s(&window, reader, run)?).fold(0.0, f64::max))
            }
            Self::Transitions(window) => {
                let [from, to] = ends_s(&window, reader, run)?;
                let inside = run.transitions.iter().filter(|t| (from..=to).contains(&t.time_s));
                Ok(inside.count() as f64)
            }
            Self::ContactLoss => first_s(run, |t| t.to == Mode::Flight, Status::ContactLost),
            Self::Jam => first_s(run, |t| t.cause == Cause::JamImpact, Status::Jammed),
            // in contact the force is zero or above; where contact is lost, rounding may say otherwise
            Self::LeastNormalForce => {
                extreme(run, |audit| audit.min_normal_force_n).map(|force_n| force_n.max(0.0))
            }
            Self::LeastPainleveIndicator => extreme(run, |audit| audit.min_painleve_indicator),
        }
    }
}

/// Start and end of a window, s: exact where it is given in seconds or by an instant, to a frame where it is
/// a phase.
fn ends_s(window: &Window, reader: &Reader, run: &RunRecord) -> Result<[f64; 2], Missing> {
    let frames = reader.frames(window)?;
    let end = |end: WindowEnd, open_s: f64, frame: usize| {
        Ok::<f64, Missing>(match end {
            WindowEnd::Open => open_s,
            WindowEnd::Time(time_s) => time_s,
            WindowEnd::Found { anchor, reversal, offset_s } => {
                reader.instants().time_s(anchor, reversal).map_err(Missing::Instant)? + offset_s
            }
            WindowEnd::Phase { .. } => reader.time_s(frame),
        })
    };
    let [start_s, stop_s] = run.span_s;
    Ok([end(window.from, start_s, frames.start)?, end(window.to, stop_s, frames.end)?])
}

/// Lengths of the stick intervals, cut at the ends of a window, s.
fn stick_lengths_s(run: &RunRecord, [from, to]: [f64; 2]) -> impl Iterator<Item = f64> {
    run.stick_s.iter().map(move |[start, end]| end.min(to) - start.max(from)).filter(|length| *length > 0.0)
}

/// When a transition like this first happens, or the run ends like this, s.
fn first_s(run: &RunRecord, is: impl Fn(&Transition) -> bool, end: Status) -> Result<f64, Missing> {
    let during = run.transitions.iter().find(|transition| is(transition)).map(|t| t.time_s);
    let at_the_end = (run.run.status == end).then_some(run.run.stopped_at_s);
    during.or(at_the_end).ok_or(Missing::Never)
}

fn extreme(run: &RunRecord, of: fn(&Audit) -> Option<f64>) -> Result<f64, Missing> {
    run.audit.as_ref().and_then(of).ok_or(Missing::Never)
}
