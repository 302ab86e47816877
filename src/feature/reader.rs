//! A recording from which many features are read: each channel is computed once, and each window
//! transformed once.

use super::band::Band;
use super::cycle::Segments;
use super::head_speed::speeds_m_per_s;
use super::missing::Missing;
use super::run_record::RunRecord;
use crate::recording::Recording;
use crate::recording::channel::{Channel, Instants, Window};
use crate::spectrum::{Detrend, Settings, Transformed};
use std::cell::{OnceCell, RefCell};
use std::ops::Range;
use std::rc::Rc;

/// What decides a transform.
type Cut = (Channel, Range<usize>, Detrend);
/// Speeds of the head in some frames, m/s, where they can be found.
type Speeds = (Range<usize>, Option<Rc<Vec<f64>>>);

/// A recording, the instants found in it, and what has been computed of it.
pub struct Reader<'a> {
    recording: &'a Recording,
    instants: &'a Instants,
    run: Option<&'a RunRecord>,
    channels: [OnceCell<Vec<Option<f64>>>; Channel::ALL.len()],
    spectra: RefCell<Vec<(Cut, Rc<Transformed>)>>,
    segments: RefCell<Vec<(Band, f64, Rc<Segments>)>>,
    speeds: RefCell<Vec<Speeds>>,
}

impl<'a> Reader<'a> {
    /// Of `recording`, in which `instants` were found.
    #[must_use]
    pub fn new(recording: &'a Recording, instants: &'a Instants) -> Self {
        let (spectra, segments, speeds) = (RefCell::default(), RefCell::default(), RefCell::default());
        Self { recording, instants, run: None, channels: Default::default(), spectra, segments, speeds }
    }

    /// Of a simulated run and the recording that a camera took of it.
    #[must_use]
    pub fn of_run(recording: &'a Recording, instants: &'a Instants, run: &'a RunRecord) -> Self {
        Self { run: Some(run), ..Self::new(recording, instants) }
    }

    pub(super) fn run(&self) -> Option<&RunRecord> {
        self.run
    }

    pub(super) fn instants(&self) -> &Instants {
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

    pub(super) fn frames(&self, window: &Window) -> Result<Range<usize>, Missing> {
        Ok(window.resolve(self.recording, self.instants)?)
    }

    pub(super) fn cut(&self, channel: Channel, frames: Range<usize>) -> &[Option<f64>] {
        self.channel(channel).get(frames).unwrap_or_default()
    }

    /// The transform of a band's window.
    pub(super) fn transformed(&self, band: &Band) -> Result<Rc<Transformed>, Missing> {
        let cut = (band.channel, self.frames(&band.window)?, band.detrend);
        let known =
            self.spectra.borrow().iter().find(|(known, _)| *known == cut).map(|(_, found)| Rc::clone(found));
        if let Some(found) = known {
            return Ok(found);
        }
        let found = Rc::new(self.transform(&cut)?);
        self.spectra.borrow_mut().push((cut, Rc::clone(&found)));
        Ok(found)
    }

    fn transform(&self, (channel, frames, detrend): &Cut) -> Result<Transformed, Missing> {
        let settings = Settings { detrend: Some(*detrend), ..Settings::default() };
        Ok(Transformed::of(self.cut(*channel, frames.clone()), self.frame_rate_hz(), &settings)?)
    }

    /// The component of a band, segment for segment; both ends of its range are read from it.
    pub(super) fn segments(&self, band: &Band, segment_s: f64) -> Result<Rc<Segments>, Missing> {
        let known = self
            .segments
            .borrow()
            .iter()
            .find(|(b, s, _)| b == band && *s == segment_s)
            .map(|(_, _, found)| Rc::clone(found));
        if let Some(found) = known {
            return Ok(found);
        }
        let samples = self.cut(band.channel, self.frames(&band.window)?);
        let found = Rc::new(Segments::of(band, segment_s, samples, self.frame_rate_hz())?);
        self.segments.borrow_mut().push((band.clone(), segment_s, Rc::clone(&found)));
        Ok(found)
    }

    /// The head's speed in every frame of a window, m/s; all points of a friction curve are read from it.
    pub(super) fn speeds(&self, frames: &Range<usize>) -> Option<Rc<Vec<f64>>> {
        let known =
            self.speeds.borrow().iter().find(|(known, _)| known == frames).map(|(_, found)| found.clone());
        known.unwrap_or_else(|| {
            let found =
                speeds_m_per_s(self.cut(Channel::HeadX, frames.clone()), self.frame_rate_hz()).map(Rc::new);
            self.speeds.borrow_mut().push((frames.clone(), found.clone()));
            found
        })
    }
}
