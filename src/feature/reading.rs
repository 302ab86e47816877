//! What is read: the readings, and the one table of their kinds that jobs and studies share.

use super::band::Band;
use super::contact::Contact;
use super::interval::Interval;
use super::keys::Entry;
use super::length::Length;
use super::missing::Missing;
use super::reader::Reader;
use super::reason::Reason;
use super::spectral::{self, End};
use super::unit::{Measure, Unit};
use super::value::Value;
use super::{damping, deflection};
use crate::math;
use crate::recording::channel::Window;
use crate::toml_file::{Refusal, nearest, refuse};
use serde::Serialize;

/// Scale of a time that may be zero or negative, s: a tenth of the stick after a reversal of half a second, a
/// few hundred frames.
pub(crate) const TIME_SCALE_S: f64 = 0.05;
/// Bands of a log-spectrum unless the file says otherwise: over a band of an octave as fine as the friction
/// moves a stick-slip cycle.
const LINES: usize = 12;
/// Most bands of a log-spectrum and most speeds of a friction curve: each is a feature of its own.
const MOST_PARTS: usize = 100;

/// What is read from a recording or a simulated run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Reading {
    /// Frequency of a component in a band, Hz: the largest, or the one that is assigned to a target.
    Frequency(Band),
    /// Amplitude of the largest component in a band, m.
    Amplitude(Band),
    /// Root mean square of a band, m.
    Rms(Band),
    /// Level of one band of a log-spectrum: root mean square of the band and of a floor, m.
    BandLevel {
        /// The band.
        band: Band,
        /// Root mean square that is added in quadrature, m, so that noise is not fitted.
        floor_m: f64,
    },
    /// Damping ratio of the ring-down of the largest component in a band.
    DampingRatio(Band),
    /// Lowest or highest frequency over which a drifting component runs, Hz.
    CycleFrequency {
        /// Where it runs.
        band: Band,
        /// Length of the segments in which it is followed, s.
        segment_s: f64,
        /// Which end of its range.
        end: End,
    },
    /// Mean of the deflection `tip_x - head_x` over a window, m.
    MeanDeflection(Window),
    /// Mean of the deflection over the frames of a window in which the head has a speed, m.
    DeflectionAtSpeed {
        /// Which frames.
        window: Window,
        /// The speed, m/s, above 0, in either direction.
        speed_m_per_s: f64,
        /// Speeds within this share of it count.
        width_relative: f64,
    },
    /// Time between two instants of a reversal, s.
    Interval {
        /// Between which.
        interval: Interval,
        /// Of which reversal, counted from 1.
        reversal: usize,
    },
    /// What only a simulated run knows.
    Contact(Contact),
}

/// One kind of reading.
pub(crate) struct Kind {
    /// Its name in files.
    pub word: &'static str,
    unit: Unit,
    /// Keys that have a meaning for it.
    keys: &'static [&'static str],
    make: Make,
}

type MakeSeveral = fn(&Entry) -> Result<Vec<(String, Reading)>, Refusal>;

/// Makes readings of an entry.
enum Make {
    One(fn(&Entry) -> Result<Reading, Refusal>),
    /// Each with what follows the name of the entry.
    Several(MakeSeveral),
    /// A time of a reversal.
    Interval(Interval),
    /// Of a run, not of a recording.
    OfRun(fn(&Entry) -> Result<Contact, Refusal>),
}

const BAND: &[&str] = &["channel", "window", "band_hz", "detrend"];
const PEAK: &[&str] = &["channel", "window", "band_hz", "detrend", "least_amplitude_m"];
const CYCLE: &[&str] = &["channel", "window", "band_hz", "detrend", "segment_s"];
const LEVELS: &[&str] = &["channel", "window", "band_hz", "detrend", "lines", "floor_m"];
const STROKE: &[&str] = &["speed_m_per_s", "width_relative", "window", "part", "reversal"];
const CURVE: &[&str] = &["speeds_m_per_s", "width_relative", "window", "part", "reversal"];
const WINDOW: &[&str] = &["window"];

/// Every kind. A new one is a variant of [`Reading`], a row here, its word in [`Reading::kind`] and its
/// value in [`Reading::read`].
#[rustfmt::skip]
const KINDS: &[Kind] = &[
    one("frequency", Unit::HERTZ, PEAK, |e| Ok(Reading::Frequency(e.band()?))),
    one("amplitude", Unit::MICROMETRES, PEAK, |e| Ok(Reading::Amplitude(e.band()?))),
    one("rms", Unit::MICROMETRES, BAND, |e| Ok(Reading::Rms(e.band()?))),
    one("damping-ratio", Unit::PLAIN, BAND, |e| Ok(Reading::DampingRatio(e.band()?))),
    one("cycle-frequency-low", Unit::HERTZ, CYCLE, |e| cycle(e, End::Low)),
    one("cycle-frequency-high", Unit::HERTZ, CYCLE, |e| cycle(e, End::High)),
    one("mean-deflection", Unit::MILLIMETRES, WINDOW, |e| Ok(Reading::MeanDeflection(e.window()?))),
    one("deflection-at-speed", Unit::MILLIMETRES, STROKE, deflection_at_speed),
    of_reversal(Interval::ReleaseAfterReversal),
    of_reversal(Interval::StickDuration),
    of_reversal(Interval::FlipAfterReversal),
    of_reversal(Interval::FlipDuration),
    several("friction-curve", Unit::MILLIMETRES, CURVE, friction_curve),
    several("log-spectrum", Unit::MICROMETRES, LEVELS, log_spectrum),
    of_run("stick-fraction", Unit::PLAIN, WINDOW, |e| Ok(Contact::StickFraction(e.window_or_whole()?))),
    of_run("longest-stick", Unit::MILLISECONDS, WINDOW, |e| Ok(Contact::LongestStick(e.window_or_whole()?))),
    of_run("transitions", Unit::PLAIN, WINDOW, |e| Ok(Contact::Transitions(e.window_or_whole()?))),
    of_run("contact-loss", Unit::SECONDS, &[], |_| Ok(Contact::ContactLoss)),
    of_run("least-normal-force", Unit::NEWTONS, &[], |_| Ok(Contact::LeastNormalForce)),
    of_run("jam", Unit::SECONDS, &[], |_| Ok(Contact::Jam)),
    of_run("least-painleve-indicator", Unit::PLAIN, &[], |_| Ok(Contact::LeastPainleveIndicator)),
];

type Keys = &'static [&'static str];

const fn one(
    word: &'static str,
    unit: Unit,
    keys: Keys,
    make: fn(&Entry) -> Result<Reading, Refusal>,
) -> Kind {
    Kind { word, unit, keys, make: Make::One(make) }
}

const fn several(word: &'static str, unit: Unit, keys: Keys, make: MakeSeveral) -> Kind {
    Kind { word, unit, keys, make: Make::Several(make) }
}

const fn of_reversal(interval: Interval) -> Kind {
    Kind {
        word: interval.kind(),
        unit: Unit::MILLISECONDS,
        keys: &["reversal"],
        make: Make::Interval(interval),
    }
}

const fn of_run(
    word: &'static str,
    unit: Unit,
    keys: Keys,
    make: fn(&Entry) -> Result<Contact, Refusal>,
) -> Kind {
    Kind { word, unit, keys, make: Make::OfRun(make) }
}

impl Kind {
    /// The kind of that name.
    ///
    /// # Errors
    /// What was found, and the nearest name.
    pub fn find(word: &str) -> Result<&'static Self, String> {
        let words: Vec<&str> = KINDS.iter().map(|kind| kind.word).collect();
        let unknown = || format!("unknown kind `{word}`; {}", nearest(word, &words));
        KINDS.iter().find(|kind| kind.word == word).ok_or_else(unknown)
    }

    /// Whether an entry stands for several readings.
    pub fn is_several(&self) -> bool {
        matches!(self.make, Make::Several(_))
    }

    /// Whether only a simulated run shows it.
    pub fn is_of_run(&self) -> bool {
        matches!(self.make, Make::OfRun(_))
    }

    /// What an entry reads, each with its name: that of the entry, and what follows it where it stands for
    /// several.
    ///
    /// # Errors
    /// The key at fault, what was found and what was expected.
    pub fn readings(&self, name: &str, entry: &Entry) -> Result<Vec<(String, Reading)>, Refusal> {
        entry.check_keys(self.keys)?;
        let name = name.to_owned();
        Ok(match self.make {
            Make::One(make) => vec![(name, make(entry)?)],
            Make::Interval(interval) => {
                vec![(name, Reading::Interval { interval, reversal: entry.reversal()? })]
            }
            Make::OfRun(make) => vec![(name, Reading::Contact(make(entry)?))],
            Make::Several(make) => {
                make(entry)?.into_iter().map(|(part, reading)| (format!("{name} {part}"), reading)).collect()
            }
        })
    }
}

fn cycle(entry: &Entry, end: End) -> Result<Reading, Refusal> {
    let band = entry.band_of_deflection()?;
    let expected = "the length of a segment, s, such as 0.02";
    Ok(Reading::CycleFrequency {
        band,
        segment_s: entry.needed("segment_s", entry.keys.segment_s, expected)?,
        end,
    })
}

fn deflection_at_speed(entry: &Entry) -> Result<Reading, Refusal> {
    Ok(Reading::DeflectionAtSpeed {
        speed_m_per_s: entry.needed("speed_m_per_s", entry.keys.speed_m_per_s, "a speed of the head, m/s")?,
        window: entry.stroke()?,
        width_relative: entry.width_relative()?,
    })
}

fn friction_curve(entry: &Entry) -> Result<Vec<(String, Reading)>, Refusal> {
    let key = "speeds_m_per_s";
    let speeds = entry.keys.speeds_m_per_s.as_deref().unwrap_or_default();
    if speeds.is_empty() || speeds.len() > MOST_PARTS {
        return refuse(
            entry.key(key),
            format!(
                "found {} speeds, expected 1 to {MOST_PARTS} speeds of the head, m/s, such as [0.05, 0.1]",
                speeds.len()
            ),
        );
    }
    let (window, width_relative) = (entry.stroke()?, entry.width_relative()?);
    let part = |speed: &f64| {
        let speed_m_per_s = entry.needed(key, Some(*speed), "speeds of the head, m/s")?;
        let reading = Reading::DeflectionAtSpeed { window, speed_m_per_s, width_relative };
        Ok((format!("at {speed} m/s"), reading))
    };
    speeds.iter().map(part).collect()
}

fn log_spectrum(entry: &Entry) -> Result<Vec<(String, Reading)>, Refusal> {
    let band = entry.band()?;
    let lines = entry.keys.lines.unwrap_or(LINES);
    if !(2..=MOST_PARTS).contains(&lines) {
        return refuse(
            entry.key("lines"),
            format!("found {lines}, expected 2 to {MOST_PARTS} lines of equal width in the band"),
        );
    }
    let floor_m = match entry.keys.floor_m {
        None if !entry.noisy => 0.0,
        floor_m => entry.needed(
            "floor_m",
            floor_m,
            "the rms of the noise in one line, m: the noise of the channel times the square root of \
             2 x width of a line / frame rate",
        )?,
    };
    let level = |(low, high): (f64, f64)| {
        let reading = Reading::BandLevel { band: Band { band_hz: (low, high), ..band.clone() }, floor_m };
        (format!("at {:.1} Hz", (low + high) / 2.0), reading)
    };
    Ok(equal_bands(band.band_hz, lines).map(level).collect())
}

/// Bands of equal width: in the logarithm where they span more than an octave together.
fn equal_bands((low, high): (f64, f64), count: usize) -> impl Iterator<Item = (f64, f64)> {
    let share = move |k: usize| k as f64 / count as f64;
    let edge = move |k: usize| {
        if low > 0.0 && high > 2.0 * low {
            low * math::powf(high / low, share(k))
        } else {
            low + share(k) * (high - low)
        }
    };
    (0..count).map(move |k| (edge(k), edge(k + 1)))
}

impl Reading {
    /// Its kind in a job or a study.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Frequency(_) => "frequency",
            Self::Amplitude(_) => "amplitude",
            Self::Rms(_) => "rms",
            Self::BandLevel { .. } => "log-spectrum",
            Self::DampingRatio(_) => "damping-ratio",
            Self::CycleFrequency { end: End::Low, .. } => "cycle-frequency-low",
            Self::CycleFrequency { end: End::High, .. } => "cycle-frequency-high",
            Self::MeanDeflection(_) => "mean-deflection",
            Self::DeflectionAtSpeed { .. } => "deflection-at-speed",
            Self::Interval { interval, .. } => interval.kind(),
            Self::Contact(contact) => contact.kind(),
        }
    }

    /// Unit of its value.
    #[must_use]
    pub fn unit(&self) -> Unit {
        let row = KINDS.iter().find(|kind| kind.word == self.kind());
        row.map_or(Unit::PLAIN, |kind| kind.unit)
    }

    /// How two of its values are compared.
    #[must_use]
    pub fn measure(&self) -> Measure {
        match self {
            Self::Interval { interval: Interval::FlipAfterReversal, .. } => {
                Measure::Linear { scale: TIME_SCALE_S }
            }
            _ => Measure::Log,
        }
    }

    /// The band that it is read from, where it has one.
    #[must_use]
    pub fn band(&self) -> Option<&Band> {
        match self {
            Self::Frequency(band)
            | Self::Amplitude(band)
            | Self::Rms(band)
            | Self::BandLevel { band, .. }
            | Self::DampingRatio(band)
            | Self::CycleFrequency { band, .. } => Some(band),
            Self::MeanDeflection(_)
            | Self::DeflectionAtSpeed { .. }
            | Self::Interval { .. }
            | Self::Contact(_) => None,
        }
    }

    /// The window that it is read from, where it has one.
    #[must_use]
    pub fn window(&self) -> Option<&Window> {
        match self {
            Self::Frequency(band)
            | Self::Amplitude(band)
            | Self::Rms(band)
            | Self::BandLevel { band, .. }
            | Self::DampingRatio(band)
            | Self::CycleFrequency { band, .. } => Some(&band.window),
            Self::MeanDeflection(window) | Self::DeflectionAtSpeed { window, .. } => Some(window),
            Self::Contact(contact) => contact.window(),
            Self::Interval { .. } => None,
        }
    }

    /// How it depends on the calibration of a camera; `None` where it is no length in a picture.
    #[must_use]
    pub fn length(&self) -> Option<Length> {
        match self {
            Self::MeanDeflection(_) | Self::DeflectionAtSpeed { .. } => Some(Length::Place),
            Self::Amplitude(_) | Self::Rms(_) => Some(Length::Size { floor_m: 0.0 }),
            Self::BandLevel { floor_m, .. } => Some(Length::Size { floor_m: *floor_m }),
            Self::Frequency(_)
            | Self::DampingRatio(_)
            | Self::CycleFrequency { .. }
            | Self::Interval { .. }
            | Self::Contact(_) => None,
        }
    }

    /// Whether it takes the extremes over a run ([`crate::simulate::outputs::Audit`]).
    #[must_use]
    pub fn needs_audit(&self) -> bool {
        matches!(self, Self::Contact(contact) if contact.needs_audit())
    }

    /// Its value. Of a frequency with a `target`, Hz, it is the component of the band that
    /// [`super::ASSIGN_WIDTH`] and [`super::ASSIGN_DB`] assign to it; without one, the strongest.
    ///
    /// # Errors
    /// [`Missing`] with the reason. Of a run that ended early nothing is known but what led to its end.
    pub fn read(&self, target: Option<f64>, reader: &Reader) -> Result<Value, Missing> {
        self.check_end(reader)?;
        match self {
            Self::Frequency(band) => spectral::frequency(band, target, reader),
            Self::Amplitude(band) => spectral::amplitude(band, reader),
            Self::Rms(band) => spectral::rms(band, reader),
            Self::BandLevel { band, floor_m } => spectral::band_level(band, *floor_m, reader),
            Self::DampingRatio(band) => damping::ratio(band, reader),
            Self::CycleFrequency { band, segment_s, end } => {
                spectral::cycle_frequency(band, *segment_s, *end, reader)
            }
            Self::MeanDeflection(window) => deflection::mean(window, reader),
            Self::DeflectionAtSpeed { window, speed_m_per_s, width_relative } => {
                deflection::at_speed(window, *speed_m_per_s, *width_relative, reader)
            }
            Self::Interval { interval, reversal } => interval.length_s(*reversal, reader),
            Self::Contact(contact) => contact.value(reader).map(|value| Value::of(value, None)),
        }
    }

    fn check_end(&self, reader: &Reader) -> Result<(), Missing> {
        let Some(run) = reader.run().map(|record| record.run) else { return Ok(()) };
        let known = matches!(self, Self::Contact(contact) if contact.is_known_after(run.status));
        if known || Reason::of(run.status).is_none() {
            return Ok(());
        }
        Err(Missing::Ended { status: run.status, stopped_at_s: run.stopped_at_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_have_equal_ratios_over_an_octave_and_equal_differences_within_one() {
        assert_eq!(
            equal_bands((100.0, 200.0), 4).collect::<Vec<_>>(),
            [(100.0, 125.0), (125.0, 150.0), (150.0, 175.0), (175.0, 200.0)]
        );
        let wide: Vec<_> = equal_bands((100.0, 800.0), 3).collect();
        for (found, expected) in wide.iter().zip([(100.0, 200.0), (200.0, 400.0), (400.0, 800.0)]) {
            assert!((found.0 - expected.0).abs() < 1e-9 && (found.1 - expected.1).abs() < 1e-9, "{wide:?}");
        }
        assert_eq!(equal_bands((0.0, 30.0), 3).last(), Some((20.0, 30.0)), "no logarithm of 0");
    }
}
