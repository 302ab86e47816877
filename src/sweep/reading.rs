//! Reads a quantity from a run: from the traces that the camera saw, or from the run itself.

use super::quantity::Band;
use super::{Missing, Quantity, Reason};
use crate::recording::Recording;
use crate::recording::channel::{Anchor, Channel, Instants, Window, WindowEnd};
use crate::simulate::mode::Mode;
use crate::simulate::outputs::Audit;
use crate::simulate::scene::Scene;
use crate::simulate::{Cause, Run, Status, Transition};
use crate::spectrum::{self, Component, Settings, Spectrum};
use crate::twin::View;

/// All that is known of a run.
pub(super) struct Seen {
    recording: Recording,
    instants: Instants,
    run: Run,
    span_s: [f64; 2],
    stick_s: Vec<[f64; 2]>,
    transitions: Vec<Transition>,
    audit: Option<Audit>,
}

impl Seen {
    pub fn new(scene: &Scene, view: View, transitions: Vec<Transition>, audit: Option<Audit>) -> Self {
        let View { recording, run, stick_s } = view;
        Self {
            instants: Instants::find(&recording),
            recording,
            run,
            span_s: [scene.start_s, scene.run.stop_s],
            stick_s,
            transitions,
            audit,
        }
    }

    /// Start and end of a window, s: exact where it is given in seconds or by an instant, to a frame where it
    /// is a phase.
    fn ends_s(&self, window: &Window) -> Result<[f64; 2], Missing> {
        let frames = window.resolve(&self.recording, &self.instants).map_err(no_window)?;
        let end = |end: WindowEnd, open_s: f64, frame: usize| match end {
            WindowEnd::Open => Ok(open_s),
            WindowEnd::Time(time_s) => Ok(time_s),
            WindowEnd::Found { anchor, reversal, offset_s } => {
                self.instants.time_s(anchor, reversal).map(|found_s| found_s + offset_s)
            }
            WindowEnd::Phase { .. } => Ok(self.recording.grid().time_s(frame)),
        };
        let [start_s, stop_s] = self.span_s;
        Ok([
            end(window.from, start_s, frames.start).map_err(no_window)?,
            end(window.to, stop_s, frames.end).map_err(no_window)?,
        ])
    }

    /// Lengths of the stick intervals, cut at the ends of a window, s.
    fn sticking_s(&self, [from, to]: [f64; 2]) -> impl Iterator<Item = f64> {
        self.stick_s
            .iter()
            .map(move |[start, end]| end.min(to) - start.max(from))
            .filter(|length| *length > 0.0)
    }

    fn cut(&self, channel: Channel, window: &Window) -> Result<Vec<Option<f64>>, Missing> {
        let frames = window.resolve(&self.recording, &self.instants).map_err(no_window)?;
        Ok(channel.samples(&self.recording).get(frames).map_or_else(Vec::new, <[_]>::to_vec))
    }

    fn spectrum(&self, band: &Band) -> Result<Spectrum, Missing> {
        let samples = self.cut(band.channel, &band.window)?;
        let settings =
            Settings { detrend: Some(band.detrend), band_hz: Some(band.band_hz), ..Settings::default() };
        spectrum::analyse(&samples, self.recording.grid().frame_rate_hz, &settings)
            .map_err(|error| Missing::because(Reason::NoComponent, error))
    }

    fn component(&self, band: &Band) -> Result<Component, Missing> {
        let (low, high) = band.band_hz;
        let component = self
            .spectrum(band)?
            .component_in_band(low, high)
            .cloned()
            .ok_or(Missing::plain(Reason::NoComponent))?;
        if component.amplitude_m < band.least_amplitude_m {
            return Err(Missing::because(
                Reason::NoComponent,
                format!(
                    "the largest has {:.3e} m at {:.3} Hz",
                    component.amplitude_m, component.frequency_hz
                ),
            ));
        }
        Ok(component)
    }

    fn first(&self, is: impl Fn(&Transition) -> bool, ends_as: Status) -> Result<f64, Missing> {
        let during =
            self.transitions.iter().find(|transition| is(transition)).map(|transition| transition.time_s);
        let at_the_end = (self.run.status == ends_as).then_some(self.run.stopped_at_s);
        during.or(at_the_end).ok_or(Missing::plain(Reason::Never))
    }
}

/// The value of a quantity, in its unit.
///
/// # Errors
/// [`Missing`] where the run does not show it.
pub(super) fn read(quantity: &Quantity, seen: &Seen) -> Result<f64, Missing> {
    let extreme =
        |of: fn(&Audit) -> Option<f64>| seen.audit.as_ref().and_then(of).ok_or(Missing::plain(Reason::Never));
    match quantity {
        Quantity::Frequency(band) => seen.component(band).map(|component| component.frequency_hz),
        Quantity::Amplitude(band) => seen.component(band).map(|component| component.amplitude_m),
        Quantity::Rms(band) => {
            seen.spectrum(band).map(|spectrum| spectrum.rms_in_band_m(band.band_hz.0, band.band_hz.1))
        }
        Quantity::MeanDeflection(window) => {
            seen.cut(Channel::Deflection, window).and_then(|samples| mean(&samples))
        }
        Quantity::ReleaseAfterReversal(reversal) => {
            let time_s = |anchor| seen.instants.time_s(anchor, *reversal).map_err(no_window);
            Ok(time_s(Anchor::Release)? - time_s(Anchor::Reversal)?)
        }
        Quantity::StickFraction(window) => {
            let share = |[from, to]: [f64; 2]| {
                seen.sticking_s([from, to]).fold(0.0, |sum, length| sum + length) / (to - from)
            }; // (an empty sum() is -0)
            seen.ends_s(window).map(share)
        }
        Quantity::StickDuration(window) => {
            seen.ends_s(window).map(|ends| seen.sticking_s(ends).fold(0.0, f64::max))
        }
        Quantity::Transitions(window) => {
            let count = |[from, to]: [f64; 2]| {
                seen.transitions.iter().filter(|t| (from..=to).contains(&t.time_s)).count()
            };
            seen.ends_s(window).map(|ends| count(ends) as f64)
        }
        Quantity::ContactLoss => seen.first(|transition| transition.to == Mode::Flight, Status::ContactLost),
        Quantity::Jam => seen.first(|transition| transition.cause == Cause::JamImpact, Status::Jammed),
        // in contact the force is zero or above; where contact is lost, rounding may say otherwise
        Quantity::LeastNormalForce => {
            extreme(|audit| audit.min_normal_force_n).map(|force_n| force_n.max(0.0))
        }
        Quantity::LeastPainleveIndicator => extreme(|audit| audit.min_painleve_indicator),
    }
}

fn no_window(why: impl ToString) -> Missing {
    Missing::because(Reason::NoWindow, why)
}

fn mean(samples: &[Option<f64>]) -> Result<f64, Missing> {
    let present: Vec<f64> = samples.iter().flatten().copied().collect();
    if present.is_empty() {
        return Err(Missing::plain(Reason::NoWindow));
    }
    Ok(present.iter().sum::<f64>() / present.len() as f64)
}
