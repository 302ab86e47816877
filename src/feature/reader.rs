//! A recording from which many features are read: each channel is computed once, and each window
//! transformed once.

use super::deflection::head_speeds_m_per_s;
use super::missing::MissingValue;
use super::spectral::{CycleSegments, FeatureBand};
use crate::recording::Recording;
use crate::recording::channel::{Channel, ReversalInstants, Window};
use crate::simulate::outputs::EnergyAudit;
use crate::simulate::{RunResult, Transition};
use crate::spectrum::{Detrend, SpectrumSettings, WindowedTransform};
use std::cell::{OnceCell, RefCell};
use std::ops::Range;
use std::rc::Rc;

/// What decides a transform.
type TransformKey = (Channel, Range<usize>, Detrend);
/// Speeds of the head in some frames, m/s, where they can be found.
type CachedSpeeds = (Range<usize>, Option<Rc<Vec<f64>>>);

/// A recording, the instants found in it, and what has been computed of it.
pub struct FeatureReader<'a> {
    recording: &'a Recording,
    instants: &'a ReversalInstants,
    run: Option<&'a RunRecord>,
    channels: [OnceCell<Vec<Option<f64>>>; Channel::ALL.len()],
    transforms: RefCell<Vec<(TransformKey, Rc<WindowedTransform>)>>,
    segments: RefCell<Vec<(FeatureBand, f64, Rc<CycleSegments>)>>,
    speeds: RefCell<Vec<CachedSpeeds>>,
}

impl<'a> FeatureReader<'a> {
    /// Of `recording`, in which `instants` were found.
    #[must_use]
    pub fn new(recording: &'a Recording, instants: &'a ReversalInstants) -> Self {
        let (transforms, segments, speeds) = (RefCell::default(), RefCell::default(), RefCell::default());
        Self { recording, instants, run: None, channels: Default::default(), transforms, segments, speeds }
    }

    /// Of a simulated run and the recording that a camera took of it.
    pub(crate) fn with_run(
        recording: &'a Recording,
        instants: &'a ReversalInstants,
        run: &'a RunRecord,
    ) -> Self {
        Self { run: Some(run), ..Self::new(recording, instants) }
    }

    pub(super) fn run(&self) -> Option<&RunRecord> {
        self.run
    }

    pub(super) fn instants(&self) -> &ReversalInstants {
        self.instants
    }

    pub(super) fn frame_rate_hz(&self) -> f64 {
        self.recording.grid().frame_rate_hz
    }

    pub(super) fn time_s(&self, frame: usize) -> f64 {
        self.recording.grid().time_s(frame)
    }

    fn channel(&self, channel: Channel) -> &[Option<f64>] {
        let place = Channel::ALL.iter().position(|c| *c == channel).unwrap_or(0);
        self.channels[place].get_or_init(|| channel.samples(self.recording))
    }

    pub(super) fn window_frames(&self, window: &Window) -> Result<Range<usize>, MissingValue> {
        Ok(window.resolve_frames(self.recording, self.instants)?)
    }

    pub(super) fn channel_frames(&self, channel: Channel, frames: Range<usize>) -> &[Option<f64>] {
        self.channel(channel).get(frames).unwrap_or_default()
    }

    /// The transform of a band's window.
    pub(super) fn band_transform(&self, band: &FeatureBand) -> Result<Rc<WindowedTransform>, MissingValue> {
        let cut = (band.channel, self.window_frames(&band.window)?, band.detrend);
        let known = self
            .transforms
            .borrow()
            .iter()
            .find(|(known, _)| *known == cut)
            .map(|(_, found)| Rc::clone(found));
        if let Some(found) = known {
            return Ok(found);
        }
        let found = Rc::new(self.compute_transform(&cut)?);
        self.transforms.borrow_mut().push((cut, Rc::clone(&found)));
        Ok(found)
    }

    fn compute_transform(
        &self,
        (channel, frames, detrend): &TransformKey,
    ) -> Result<WindowedTransform, MissingValue> {
        let settings = SpectrumSettings { detrend: Some(*detrend), ..SpectrumSettings::default() };
        Ok(WindowedTransform::new(
            self.channel_frames(*channel, frames.clone()),
            self.frame_rate_hz(),
            &settings,
        )?)
    }

    /// The component of a band, segment for segment; both ends of its range are read from it.
    pub(super) fn cycle_segments(
        &self,
        band: &FeatureBand,
        segment_s: f64,
    ) -> Result<Rc<CycleSegments>, MissingValue> {
        let known = self
            .segments
            .borrow()
            .iter()
            .find(|(b, s, _)| b == band && *s == segment_s)
            .map(|(_, _, found)| Rc::clone(found));
        if let Some(found) = known {
            return Ok(found);
        }
        let samples = self.channel_frames(band.channel, self.window_frames(&band.window)?);
        let found = Rc::new(CycleSegments::from_samples(band, segment_s, samples, self.frame_rate_hz())?);
        self.segments.borrow_mut().push((band.clone(), segment_s, Rc::clone(&found)));
        Ok(found)
    }

    /// The head's speed in every frame of a window, m/s; all points of a friction curve are read from it.
    pub(super) fn head_speeds_m_per_s(&self, frames: &Range<usize>) -> Option<Rc<Vec<f64>>> {
        let known =
            self.speeds.borrow().iter().find(|(known, _)| known == frames).map(|(_, found)| found.clone());
        known.unwrap_or_else(|| {
            let found = head_speeds_m_per_s(
                self.channel_frames(Channel::HeadX, frames.clone()),
                self.frame_rate_hz(),
            )
            .map(Rc::new);
            self.speeds.borrow_mut().push((frames.clone(), found.clone()));
            found
        })
    }
}

// What is kept of a simulated run, for what its traces do not show.

/// What is kept of a simulated run.
#[derive(Debug, Clone)]
pub struct RunRecord {
    /// Start and stop time of its scene, s.
    pub span_s: [f64; 2],
    /// How it went.
    pub run: RunResult,
    /// When the tip stuck, s.
    pub stick_s: Vec<[f64; 2]>,
    /// Its changes of mode.
    pub transitions: Vec<Transition>,
    /// Its extremes, where a reading needs them ([`super::Reading::needs_audit`]).
    pub audit: Option<EnergyAudit>,
}
