//! A reader shared by many features of a recording: it computes each channel, transform and speed only once.

use super::deflection::head_speeds_m_per_s;
use super::missing::MissingValue;
use super::spectral::{CycleSegments, FeatureBand};
use crate::recording::Recording;
use crate::recording::channel::{Channel, ReversalInstants, Window};
use crate::simulate::outputs::EnergyAudit;
use crate::simulate::{RunResult, Transition};
use short_spectra::{Detrend, SpectrumSettings, WindowedTransform};
use std::borrow::Cow;
use std::cell::{OnceCell, RefCell};
use std::ops::Range;
use std::rc::Rc;

/// A recording with its instants, and with the channels, transforms and speeds that have been computed from
/// it.
pub struct FeatureReader<'a> {
    pub(super) recording: Cow<'a, Recording>,
    pub(super) instants: &'a ReversalInstants,
    pub(super) run: Option<&'a RunRecord>,
    channels: [OnceCell<Vec<Option<f64>>>; Channel::ALL.len()],
    transforms: KeyedValues<(Channel, Range<usize>, Detrend), WindowedTransform>,
    segments: KeyedValues<(FeatureBand, f64), CycleSegments>,
    speeds: KeyedValues<Range<usize>, Vec<f64>>,
}

impl<'a> FeatureReader<'a> {
    /// Reader of `recording`; `instants` are the instants that were found in this recording.
    #[must_use]
    pub fn new(recording: &'a Recording, instants: &'a ReversalInstants) -> Self {
        let (transforms, segments, speeds) = (RefCell::default(), RefCell::default(), RefCell::default());
        let recording = recording.resample_to_grid();
        Self { recording, instants, run: None, channels: Default::default(), transforms, segments, speeds }
    }

    /// Reader of a simulated run and of the recording that a camera would take of it.
    pub(crate) fn with_run(
        recording: &'a Recording,
        instants: &'a ReversalInstants,
        run: &'a RunRecord,
    ) -> Self {
        Self { run: Some(run), ..Self::new(recording, instants) }
    }

    pub(super) fn frame_rate_hz(&self) -> f64 {
        self.recording.grid().frame_rate_hz
    }

    pub(super) fn window_frames(&self, window: &Window) -> Result<Range<usize>, MissingValue> {
        Ok(window.resolve_frames(&self.recording, self.instants)?)
    }

    pub(super) fn channel_frames(&self, channel: Channel, frames: Range<usize>) -> &[Option<f64>] {
        let samples = self.channels[channel as usize].get_or_init(|| channel.samples(&self.recording));
        samples.get(frames).unwrap_or_default()
    }

    /// Fourier transform of the channel of a band in the window of the band.
    pub(super) fn band_transform(&self, band: &FeatureBand) -> Result<Rc<WindowedTransform>, MissingValue> {
        let key = (band.channel, self.window_frames(&band.window)?, band.detrend);
        compute_once(&self.transforms, key, |(channel, frames, detrend)| {
            let settings = SpectrumSettings { detrend: Some(*detrend), ..SpectrumSettings::default() };
            let samples = self.channel_frames(*channel, frames.clone());
            Ok(WindowedTransform::new(samples, self.frame_rate_hz(), &settings)?)
        })
    }

    /// The strongest component of a band in each segment of the band's window. The lowest and the highest
    /// frequency of a drifting component are both taken from these segments.
    pub(super) fn cycle_segments(
        &self,
        band: &FeatureBand,
        segment_s: f64,
    ) -> Result<Rc<CycleSegments>, MissingValue> {
        compute_once(&self.segments, (band.clone(), segment_s), |_| {
            let samples = self.channel_frames(band.channel, self.window_frames(&band.window)?);
            CycleSegments::from_samples(band, segment_s, samples, self.frame_rate_hz())
        })
    }

    /// The speed of the head in every frame of a window, m/s; shared by all points of a friction curve.
    pub(super) fn head_speeds_m_per_s(&self, frames: &Range<usize>) -> Result<Rc<Vec<f64>>, MissingValue> {
        compute_once(&self.speeds, frames.clone(), |frames| {
            let head = self.channel_frames(Channel::HeadX, frames.clone());
            head_speeds_m_per_s(head, self.frame_rate_hz()).ok_or(MissingValue::NoSpeed)
        })
    }
}

/// Values computed so far, each with its key.
type KeyedValues<K, V> = RefCell<Vec<(K, Rc<V>)>>;

/// The value for a key; computed when it is first requested.
fn compute_once<K: PartialEq, V>(
    known: &KeyedValues<K, V>,
    key: K,
    compute: impl FnOnce(&K) -> Result<V, MissingValue>,
) -> Result<Rc<V>, MissingValue> {
    if let Some((_, found)) = known.borrow().iter().find(|(known, _)| *known == key) {
        return Ok(Rc::clone(found));
    }
    let found = Rc::new(compute(&key)?);
    known.borrow_mut().push((key, Rc::clone(&found)));
    Ok(found)
}

/// The part of a simulated run that its recording does not contain.
#[derive(Debug, Clone)]
pub struct RunRecord {
    /// Start and stop time of the scene, s.
    pub span_s: [f64; 2],
    /// The status with which the run ended, and the time of its end.
    pub run: RunResult,
    /// Start and end of each stick interval, s.
    pub stick_s: Vec<[f64; 2]>,
    /// Changes of the contact mode, in order of time.
    pub transitions: Vec<Transition>,
    /// Extrema of the forces and of the Painlevé indicator over the run; `None` if no reading needs them.
    pub audit: Option<EnergyAudit>,
}
