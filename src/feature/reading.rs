//! Readings, and the table of kinds of readings that jobs and studies share.

use super::contact::ContactReading;
use super::deflection;
use super::interval::ReversalInterval;
use super::keys::ReadingEntry;
use super::missing::{MissingReason, MissingValue};
use super::reader::FeatureReader;
use super::spectral::{self, CycleRangeEnd, FeatureBand};
use super::value::{FeatureUnit, FeatureValue, LengthCalibration, ValueComparison};
use crate::recording::channel::Window;
use crate::toml_file::{KeyRefusal, suggest_key};
use portable_math as math;
use serde::Serialize;

/// Scale, s, of the difference between two values of a time interval that may be zero or negative: a
/// difference of this size counts as large. It is a tenth of the duration of a long stick, 0.5 s.
pub(crate) const TIME_SCALE_S: f64 = 0.05;
/// Default number of bands of a log-spectrum. If the bands span an octave, the width of each band is about
/// the change of a stick-slip frequency that friction causes.
const DEFAULT_LINES: usize = 12;
/// Maximum number of bands of a log-spectrum and of speeds of a friction curve: each becomes a separate
/// feature.
const MAX_SERIES_LENGTH: usize = 100;

/// A quantity that can be evaluated in a recording or in a simulated run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Reading {
    /// Frequency of a component in a band, Hz: the strongest component, or the one assigned to a target.
    Frequency(FeatureBand),
    /// Amplitude of the strongest component in a band, m.
    Amplitude(FeatureBand),
    /// Root mean square of the part of a channel that is in a frequency band, m.
    Rms(FeatureBand),
    /// Level of one band of a log-spectrum, m: `sqrt(rms^2 + floor_m^2)`, where `rms` is the root mean square
    /// of the part of the channel in the band.
    BandLevel {
        /// The band.
        band: FeatureBand,
        /// Floor, m, that is added in quadrature to the root mean square of the band, so that noise is not
        /// fitted.
        floor_m: f64,
    },
    /// Damping ratio of the ring-down of the strongest component in a band.
    DampingRatio(FeatureBand),
    /// Lowest or highest frequency of a drifting component, Hz.
    CycleFrequency {
        /// Band of the component.
        band: FeatureBand,
        /// Length of the segments in which the component is tracked, s.
        segment_s: f64,
        /// Whether the lowest or the highest frequency is evaluated.
        end: CycleRangeEnd,
    },
    /// Slips per second of the stick-slip cycle that is counted in the path of the tip over a window, Hz.
    SlipRate(Window),
    /// Mean of the deflection `tip_x - head_x` over a window, m.
    MeanDeflection(Window),
    /// Mean of the deflection over the frames of a window in which the head has a given speed, m.
    DeflectionAtSpeed {
        /// Window from which the frames are selected.
        window: Window,
        /// Speed of the head, m/s, above 0; the head may move in either direction.
        speed_m_per_s: f64,
        /// Half width of the range of accepted head speeds, as a fraction of `speed_m_per_s`.
        width_relative: f64,
    },
    /// Time between two instants of a reversal, s.
    Interval {
        /// Kind of interval, which determines the two instants.
        interval: ReversalInterval,
        /// Number of the reversal, counted from 1.
        reversal: usize,
    },
    /// A reading of the contact, which only a simulated run can give.
    Contact(ContactReading),
}

/// One kind of reading.
pub(crate) struct ReadingKind {
    /// Name of the kind in files.
    pub word: &'static str,
    unit: FeatureUnit,
    /// Keys that have a meaning for this kind.
    keys: &'static [&'static str],
    make: ReadingConstructor,
}

type SeriesConstructor = fn(&ReadingEntry) -> Result<Vec<(String, Reading)>, KeyRefusal>;

/// Makes the readings of an entry.
enum ReadingConstructor {
    One(fn(&ReadingEntry) -> Result<Reading, KeyRefusal>),
    /// Several readings; the name of each is the name of the entry with a suffix.
    Series(SeriesConstructor),
    /// A time interval at a reversal.
    Interval(ReversalInterval),
    /// A reading of a simulated run, which no recording can give.
    OfRun(fn(&ReadingEntry) -> Result<ContactReading, KeyRefusal>),
}

const BAND: &[&str] = &["channel", "window", "band_hz", "detrend"];
const PEAK: &[&str] = &["channel", "window", "band_hz", "detrend", "least_amplitude_m"];
const CYCLE: &[&str] = &["channel", "window", "band_hz", "detrend", "segment_s"];
const LEVELS: &[&str] = &["channel", "window", "band_hz", "detrend", "lines", "floor_m"];
const STROKE: &[&str] = &["speed_m_per_s", "width_relative", "window", "part", "reversal"];
const CURVE: &[&str] = &["speeds_m_per_s", "width_relative", "window", "part", "reversal"];
const WINDOW: &[&str] = &["window"];
const REVERSAL: &[&str] = &["reversal"];
const NONE: &[&str] = &[];

macro_rules! kinds {
    ($($word:literal $unit:ident $keys:ident $make:ident $of:expr;)*) => {
        /// Every kind of reading. To add a kind, add a variant of [`Reading`], a row here, its name in
        /// [`Reading::kind`] and its evaluation in [`Reading::read`].
        const KINDS: &[ReadingKind] = &[$(ReadingKind {
            word: $word, unit: FeatureUnit::$unit, keys: $keys, make: ReadingConstructor::$make($of),
        }),*];
    };
}

kinds! {
    "frequency" HERTZ PEAK One |e| Ok(Reading::Frequency(e.parse_band()?));
    "amplitude" MICROMETRES PEAK One |e| Ok(Reading::Amplitude(e.parse_band()?));
    "rms" MICROMETRES BAND One |e| Ok(Reading::Rms(e.parse_band()?));
    "damping-ratio" DIMENSIONLESS BAND One |e| Ok(Reading::DampingRatio(e.parse_band()?));
    "cycle-frequency-low" HERTZ CYCLE One |e| cycle_frequency_reading(e, CycleRangeEnd::Low);
    "cycle-frequency-high" HERTZ CYCLE One |e| cycle_frequency_reading(e, CycleRangeEnd::High);
    "slip-rate" HERTZ WINDOW One |e| Ok(Reading::SlipRate(e.parse_window()?));
    "mean-deflection" MILLIMETRES WINDOW One |e| Ok(Reading::MeanDeflection(e.parse_window()?));
    "deflection-at-speed" MILLIMETRES STROKE One deflection_reading;
    "release-after-reversal" MILLISECONDS REVERSAL Interval ReversalInterval::ReleaseAfterReversal;
    "stick-duration" MILLISECONDS REVERSAL Interval ReversalInterval::StickDuration;
    "flip-after-reversal" MILLISECONDS REVERSAL Interval ReversalInterval::FlipAfterReversal;
    "flip-duration" MILLISECONDS REVERSAL Interval ReversalInterval::FlipDuration;
    "friction-curve" MILLIMETRES CURVE Series friction_curve_readings;
    "log-spectrum" MICROMETRES LEVELS Series log_spectrum_readings;
    "stick-fraction" DIMENSIONLESS WINDOW OfRun |e| Ok(ContactReading::StickFraction(e.window_or_whole()?));
    "longest-stick" MILLISECONDS WINDOW OfRun |e| Ok(ContactReading::LongestStick(e.window_or_whole()?));
    "transitions" DIMENSIONLESS WINDOW OfRun |e| Ok(ContactReading::Transitions(e.window_or_whole()?));
    "contact-loss" SECONDS NONE OfRun |_| Ok(ContactReading::ContactLoss);
    "least-normal-force" NEWTONS NONE OfRun |_| Ok(ContactReading::LeastNormalForce);
    "jam" SECONDS NONE OfRun |_| Ok(ContactReading::Jam);
    "least-painleve-indicator" DIMENSIONLESS NONE OfRun |_| Ok(ContactReading::LeastPainleveIndicator);
}

impl ReadingKind {
    /// The kind with the given name.
    ///
    /// # Errors
    /// A message with the unknown name and the nearest known name.
    pub(crate) fn find(word: &str) -> Result<&'static Self, String> {
        let words: Vec<&str> = KINDS.iter().map(|kind| kind.word).collect();
        let unknown = || format!("unknown kind `{word}`; {}", suggest_key(word, &words));
        KINDS.iter().find(|kind| kind.word == word).ok_or_else(unknown)
    }

    /// Whether an entry of this kind has several readings.
    pub(crate) fn is_series(&self) -> bool {
        matches!(self.make, ReadingConstructor::Series(_))
    }

    /// Whether only a simulated run can give a reading of this kind.
    pub(crate) fn is_of_run(&self) -> bool {
        matches!(self.make, ReadingConstructor::OfRun(_))
    }

    /// Readings of an entry with their names: the name of the entry, with a suffix if the entry has several
    /// readings.
    ///
    /// # Errors
    /// The key at fault, the value found and the value expected.
    pub(crate) fn make_readings(
        &self,
        name: &str,
        entry: &ReadingEntry,
    ) -> Result<Vec<(String, Reading)>, KeyRefusal> {
        entry.check_keys(self.keys)?;
        let name = name.to_owned();
        Ok(match self.make {
            ReadingConstructor::One(make) => vec![(name, make(entry)?)],
            ReadingConstructor::Interval(interval) => {
                vec![(name, Reading::Interval { interval, reversal: entry.reversal_number()? })]
            }
            ReadingConstructor::OfRun(make) => vec![(name, Reading::Contact(make(entry)?))],
            ReadingConstructor::Series(make) => {
                make(entry)?.into_iter().map(|(part, reading)| (format!("{name} {part}"), reading)).collect()
            }
        })
    }
}

fn cycle_frequency_reading(entry: &ReadingEntry, end: CycleRangeEnd) -> Result<Reading, KeyRefusal> {
    let band = entry.band_of_deflection()?;
    let expected = "the length of a segment, s, such as 0.02";
    let segment_s = entry.require_positive("segment_s", entry.keys.segment_s, expected)?;
    Ok(Reading::CycleFrequency { band, segment_s, end })
}

fn deflection_reading(entry: &ReadingEntry) -> Result<Reading, KeyRefusal> {
    let (key, expected) = ("speed_m_per_s", "a speed of the head, m/s");
    let speed_m_per_s = entry.require_positive(key, entry.keys.speed_m_per_s, expected)?;
    let (window, width_relative) = (entry.stroke_window()?, entry.width_relative()?);
    Ok(Reading::DeflectionAtSpeed { window, speed_m_per_s, width_relative })
}

fn friction_curve_readings(entry: &ReadingEntry) -> Result<Vec<(String, Reading)>, KeyRefusal> {
    let key = "speeds_m_per_s";
    let speeds = entry.keys.speeds_m_per_s.as_deref().unwrap_or_default();
    let count = speeds.len();
    if !(1..=MAX_SERIES_LENGTH).contains(&count) {
        let expected = format!("1 to {MAX_SERIES_LENGTH} speeds of the head, m/s, such as [0.05, 0.1]");
        return entry.refuse(key, format!("found {count} speeds, expected {expected}"));
    }
    let (window, width_relative) = (entry.stroke_window()?, entry.width_relative()?);
    let part = |speed: &f64| {
        let speed_m_per_s = entry.require_positive(key, Some(*speed), "speeds of the head, m/s")?;
        let reading = Reading::DeflectionAtSpeed { window, speed_m_per_s, width_relative };
        Ok((format!("at {speed} m/s"), reading))
    };
    speeds.iter().map(part).collect()
}

fn log_spectrum_readings(entry: &ReadingEntry) -> Result<Vec<(String, Reading)>, KeyRefusal> {
    let band = entry.parse_band()?;
    let lines = entry.keys.lines.unwrap_or(DEFAULT_LINES);
    if !(2..=MAX_SERIES_LENGTH).contains(&lines) {
        let expected = format!("2 to {MAX_SERIES_LENGTH} lines of equal width in the band");
        return entry.refuse("lines", format!("found {lines}, expected {expected}"));
    }
    let expected = "the rms of the noise in one line, m: the noise of the channel times the square root of \
        2 x width of a line / frame rate";
    let floor_m = match entry.keys.floor_m {
        None if !entry.noisy => 0.0,
        floor_m => entry.require_positive("floor_m", floor_m, expected)?,
    };
    let level = |(low, high): (f64, f64)| {
        let band = FeatureBand { band_hz: (low, high), ..band.clone() };
        (format!("at {:.1} Hz", (low + high) / 2.0), Reading::BandLevel { band, floor_m })
    };
    Ok(split_band(band.band_hz, lines).map(level).collect())
}

/// Splits a band into `count` bands of equal width. If the band spans more than an octave, the parts have an
/// equal ratio of upper to lower edge instead.
fn split_band((low, high): (f64, f64), count: usize) -> impl Iterator<Item = (f64, f64)> {
    let share = move |k: usize| k as f64 / count as f64;
    let edge = move |k: usize| {
        let over_octave = low > 0.0 && high > 2.0 * low;
        if over_octave { low * math::powf(high / low, share(k)) } else { low + share(k) * (high - low) }
    };
    (0..count).map(move |k| (edge(k), edge(k + 1)))
}

impl Reading {
    /// Name of the kind of reading in a job or a study.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Frequency(_) => "frequency",
            Self::Amplitude(_) => "amplitude",
            Self::Rms(_) => "rms",
            Self::BandLevel { .. } => "log-spectrum",
            Self::DampingRatio(_) => "damping-ratio",
            Self::CycleFrequency { end: CycleRangeEnd::Low, .. } => "cycle-frequency-low",
            Self::CycleFrequency { end: CycleRangeEnd::High, .. } => "cycle-frequency-high",
            Self::SlipRate(_) => "slip-rate",
            Self::MeanDeflection(_) => "mean-deflection",
            Self::DeflectionAtSpeed { .. } => "deflection-at-speed",
            Self::Interval { interval, .. } => interval.kind(),
            Self::Contact(contact) => contact.kind(),
        }
    }

    /// Unit of the value.
    pub(crate) fn unit(&self) -> FeatureUnit {
        let row = KINDS.iter().find(|kind| kind.word == self.kind());
        row.map_or(FeatureUnit::DIMENSIONLESS, |kind| kind.unit)
    }

    /// Way of comparing two values of the reading.
    pub(crate) fn comparison(&self) -> ValueComparison {
        match self {
            Self::Interval { interval: ReversalInterval::FlipAfterReversal, .. } => {
                ValueComparison::Linear { scale: TIME_SCALE_S }
            }
            _ => ValueComparison::Log,
        }
    }

    /// The band of the reading, if it has one.
    pub(crate) fn band(&self) -> Option<&FeatureBand> {
        match self {
            Self::Frequency(band)
            | Self::Amplitude(band)
            | Self::Rms(band)
            | Self::BandLevel { band, .. }
            | Self::DampingRatio(band)
            | Self::CycleFrequency { band, .. } => Some(band),
            Self::SlipRate(_)
            | Self::MeanDeflection(_)
            | Self::DeflectionAtSpeed { .. }
            | Self::Interval { .. }
            | Self::Contact(_) => None,
        }
    }

    /// The window of the reading, if it has one.
    pub(crate) fn window(&self) -> Option<&Window> {
        match self {
            Self::SlipRate(window)
            | Self::MeanDeflection(window)
            | Self::DeflectionAtSpeed { window, .. } => Some(window),
            Self::Contact(contact) => contact.window(),
            Self::Frequency(_)
            | Self::Amplitude(_)
            | Self::Rms(_)
            | Self::BandLevel { .. }
            | Self::DampingRatio(_)
            | Self::CycleFrequency { .. } => self.band().map(|band| &band.window),
            Self::Interval { .. } => None,
        }
    }

    /// Effect of the camera's calibration on the value; `None` for a reading that is not a length.
    pub(crate) fn length_calibration(&self) -> Option<LengthCalibration> {
        match self {
            Self::MeanDeflection(_) | Self::DeflectionAtSpeed { .. } => Some(LengthCalibration::Position),
            Self::Amplitude(_) | Self::Rms(_) => Some(LengthCalibration::Size { floor_m: 0.0 }),
            Self::BandLevel { floor_m, .. } => Some(LengthCalibration::Size { floor_m: *floor_m }),
            Self::Frequency(_)
            | Self::DampingRatio(_)
            | Self::CycleFrequency { .. }
            | Self::SlipRate(_)
            | Self::Interval { .. }
            | Self::Contact(_) => None,
        }
    }

    /// Whether the reading needs the extrema over a run, [`RunRecord::audit`](super::RunRecord::audit).
    pub(crate) fn needs_audit(&self) -> bool {
        matches!(self, Self::Contact(contact) if contact.needs_audit())
    }

    /// Evaluates the reading. A frequency reading evaluates the component assigned to `target`, Hz, according
    /// to [`super::ASSIGN_WIDTH`] and [`super::ASSIGN_DB`]; without a target, the strongest component.
    ///
    /// # Errors
    /// [`MissingValue`] with the reason. A run that ended early has only those values that describe its end.
    pub fn read(&self, target: Option<f64>, reader: &FeatureReader) -> Result<FeatureValue, MissingValue> {
        self.check_end(reader)?;
        match self {
            Self::Frequency(band) => spectral::read_frequency(band, target, reader),
            Self::Amplitude(band) => spectral::read_amplitude(band, reader),
            Self::Rms(band) => spectral::read_rms(band, reader),
            Self::BandLevel { band, floor_m } => spectral::read_band_level(band, *floor_m, reader),
            Self::DampingRatio(band) => spectral::read_damping_ratio(band, reader),
            Self::CycleFrequency { band, segment_s, end } => {
                spectral::read_cycle_frequency(band, *segment_s, *end, reader)
            }
            Self::SlipRate(window) => {
                let cycle = reader.recording.count_cycles(reader.window_frames(window)?)?;
                Ok(FeatureValue::new(cycle.rate_hz, Some(cycle.rate_sd_hz)))
            }
            Self::MeanDeflection(window) => deflection::read_mean_deflection(window, reader),
            Self::DeflectionAtSpeed { window, speed_m_per_s, width_relative } => {
                deflection::read_deflection_at_speed(window, *speed_m_per_s, *width_relative, reader)
            }
            Self::Interval { interval, reversal } => interval.length_s(*reversal, reader),
            Self::Contact(contact) => contact.value(reader).map(|value| FeatureValue::new(value, None)),
        }
    }

    fn check_end(&self, reader: &FeatureReader) -> Result<(), MissingValue> {
        let Some(run) = reader.run.map(|record| record.run) else { return Ok(()) };
        let known = matches!(self, Self::Contact(contact) if contact.is_known_after(run.status));
        if known || MissingReason::from_status(run.status).is_none() {
            return Ok(());
        }
        Err(MissingValue::Ended { status: run.status, stopped_at_s: run.stopped_at_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_have_equal_ratios_over_an_octave_and_equal_differences_within_one() {
        assert_eq!(
            split_band((100.0, 200.0), 4).collect::<Vec<_>>(),
            [(100.0, 125.0), (125.0, 150.0), (150.0, 175.0), (175.0, 200.0)]
        );
        let wide: Vec<_> = split_band((100.0, 800.0), 3).collect();
        for (found, expected) in wide.iter().zip([(100.0, 200.0), (200.0, 400.0), (400.0, 800.0)]) {
            assert!((found.0 - expected.0).abs() < 1e-9 && (found.1 - expected.1).abs() < 1e-9, "{wide:?}");
        }
        assert_eq!(split_band((0.0, 30.0), 3).last(), Some((20.0, 30.0)), "no logarithm of 0");
    }
}
