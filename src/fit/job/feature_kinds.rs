//! The kinds of features: the word of each, the keys that it takes, and what is read.

use super::aim::When;
use super::as_written;
use super::entry::{Entry, Place};
use super::refusal::{Refusal, refuse};
use crate::feature::{Band, End, Interval, Reading, WIDTH_RELATIVE};
use crate::recording::channel::{Channel, Window};
use crate::toml_file::nearest;

/// Lines of a log-spectrum unless the job says otherwise: over a band of an octave as fine as the friction
/// moves a stick-slip cycle.
const LINES: usize = 12;
/// Most lines of a log-spectrum and most speeds of a friction curve: each is a feature of its own.
const MOST_PARTS: usize = 100;
/// Standard deviation of a line's logarithm unless the job says otherwise: a periodogram of a few resolutions
/// scatters as much.
pub(super) const LINE_SD_RELATIVE: f64 = 0.3;
/// Largest relative half width of the speeds that count as one.
const WIDEST_RELATIVE: f64 = 0.5;

/// What one entry reads; several where it stands for several features.
pub(super) struct Part {
    /// What follows the name of the entry, where it stands for several.
    pub suffix: Option<String>,
    pub reading: Reading,
    pub stage: When,
}

impl Part {
    fn alone(reading: Reading) -> Vec<Self> {
        vec![Self { suffix: None, reading, stage: When::Always }]
    }
}

/// One row of the table.
pub(super) struct Kind {
    pub word: &'static str,
    /// Keys that have a meaning for it, beside those of every feature.
    keys: &'static [&'static str],
    /// Whether it stands for several features, so that one target cannot be given.
    pub several: bool,
    read: fn(&Source) -> Result<Vec<Part>, Refusal>,
}

const SPECTRAL: &[&str] = &["channel", "window", "band_hz", "detrend"];
const CYCLE: &[&str] = &["channel", "window", "band_hz", "detrend", "segment_s"];
const REVERSAL: &[&str] = &["reversal"];

const fn one(
    word: &'static str,
    keys: &'static [&'static str],
    read: fn(&Source) -> Result<Vec<Part>, Refusal>,
) -> Kind {
    Kind { word, keys, several: false, read }
}

const KINDS: &[Kind] = &[
    one("rms", SPECTRAL, |s| Ok(Part::alone(Reading::Rms(s.band()?)))),
    one("amplitude", SPECTRAL, |s| Ok(Part::alone(Reading::Amplitude(s.band()?)))),
    one("damping-ratio", SPECTRAL, |s| Ok(Part::alone(Reading::DampingRatio(s.band()?)))),
    one("cycle-frequency-low", CYCLE, |s| s.cycle(End::Low)),
    one("cycle-frequency-high", CYCLE, |s| s.cycle(End::High)),
    one("mean-deflection", &["window"], |s| {
        Ok(Part::alone(Reading::MeanDeflection(s.entry.window(s.written.window.as_deref())?)))
    }),
    one("deflection-at-speed", &["speed_m_per_s", "width_relative", "window", "part", "reversal"], |s| {
        s.deflection_at_speed()
    }),
    Kind {
        several: true,
        ..one("friction-curve", &["speeds_m_per_s", "width_relative", "window", "part", "reversal"], |s| {
            s.friction_curve()
        })
    },
    one("release-after-reversal", REVERSAL, |s| s.interval(Interval::ReleaseAfterReversal)),
    one("stick-duration", REVERSAL, |s| s.interval(Interval::StickDuration)),
    one("flip-after-reversal", REVERSAL, |s| s.interval(Interval::FlipAfterReversal)),
    one("flip-duration", REVERSAL, |s| s.interval(Interval::FlipDuration)),
    Kind {
        several: true,
        ..one("log-spectrum", &["channel", "window", "band_hz", "detrend", "lines", "floor_m"], |s| {
            s.log_spectrum()
        })
    },
];

/// The kind of a feature.
pub(super) fn kind(written: &as_written::Feature) -> Result<&'static Kind, Refusal> {
    let words: Vec<&str> = KINDS.iter().map(|kind| kind.word).collect();
    let unknown = || {
        refuse(
            named(written, "`kind`"),
            format!("unknown kind `{}`; {}", written.kind, nearest(&written.kind, &words)),
        )
    };
    KINDS.iter().find(|kind| kind.word == written.kind).map_or_else(unknown, Ok)
}

fn named(written: &as_written::Feature, key: &str) -> String {
    written.name.as_ref().map_or_else(|| format!("feature, {key}"), |name| format!("feature `{name}`, {key}"))
}

impl Kind {
    /// What the entry reads, after a check that each of its keys has a meaning here.
    pub(super) fn parts(
        &self,
        entry: &Entry,
        written: &as_written::Feature,
        place: &Place,
    ) -> Result<Vec<Part>, Refusal> {
        if let Some((key, _)) =
            present(written).into_iter().find(|(key, found)| *found && !self.keys.contains(key))
        {
            return refuse(
                entry.key(key),
                format!(
                    "has no meaning for this kind of feature, which takes {}; remove it",
                    self.keys.join(", ")
                ),
            );
        }
        (self.read)(&Source { entry, written, place })
    }
}

/// The keys that belong to some kinds only, and whether they are there.
fn present(written: &as_written::Feature) -> [(&'static str, bool); 12] {
    [
        ("channel", written.channel.is_some()),
        ("window", written.window.is_some()),
        ("band_hz", written.band_hz.is_some()),
        ("detrend", written.detrend.is_some()),
        ("reversal", written.reversal.is_some()),
        ("segment_s", written.segment_s.is_some()),
        ("speed_m_per_s", written.speed_m_per_s.is_some()),
        ("speeds_m_per_s", written.speeds_m_per_s.is_some()),
        ("width_relative", written.width_relative.is_some()),
        ("part", written.part.is_some()),
        ("lines", written.lines.is_some()),
        ("floor_m", written.floor_m.is_some()),
    ]
}

/// An entry from which readings are made.
pub(super) struct Source<'a> {
    entry: &'a Entry,
    written: &'a as_written::Feature,
    place: &'a Place,
}

impl Source<'_> {
    fn band(&self) -> Result<Band, Refusal> {
        self.band_of(self.written.channel.as_deref())
    }

    fn band_of(&self, channel: Option<&str>) -> Result<Band, Refusal> {
        self.entry.band(
            channel,
            self.written.window.as_deref(),
            self.written.band_hz,
            self.written.detrend.as_deref(),
            self.place,
        )
    }

    fn cycle(&self, end: End) -> Result<Vec<Part>, Refusal> {
        let channel = self.written.channel.as_deref().unwrap_or(Channel::Deflection.name());
        let band = self.band_of(Some(channel))?;
        let segment_s = self.entry.needed(
            "segment_s",
            self.written.segment_s,
            "the length of a segment, s, such as 0.02",
        )?;
        Ok(Part::alone(Reading::CycleFrequency { band, segment_s, end }))
    }

    fn interval(&self, interval: Interval) -> Result<Vec<Part>, Refusal> {
        Ok(Part::alone(Reading::Interval { interval, reversal: self.reversal()? }))
    }

    fn reversal(&self) -> Result<usize, Refusal> {
        match self.written.reversal {
            Some(0) => {
                refuse(self.entry.key("reversal"), "found 0, expected 1 or more: the first reversal is 1")
            }
            reversal => Ok(reversal.unwrap_or(1)),
        }
    }

    fn deflection_at_speed(&self) -> Result<Vec<Part>, Refusal> {
        let speed_m_per_s =
            self.entry.needed("speed_m_per_s", self.written.speed_m_per_s, "a speed of the head, m/s")?;
        Ok(Part::alone(Reading::DeflectionAtSpeed {
            window: self.stroke()?,
            speed_m_per_s,
            width_relative: self.width_relative()?,
        }))
    }

    fn friction_curve(&self) -> Result<Vec<Part>, Refusal> {
        let key = "speeds_m_per_s";
        let speeds = self.written.speeds_m_per_s.as_deref().unwrap_or_default();
        if speeds.is_empty() || speeds.len() > MOST_PARTS {
            let found = speeds.len();
            return refuse(
                self.entry.key(key),
                format!(
                    "found {found} speeds, expected 1 to {MOST_PARTS} speeds of the head, m/s, such as [0.05, 0.1]"
                ),
            );
        }
        let (window, width_relative) = (self.stroke()?, self.width_relative()?);
        let part = |speed: &f64| {
            let speed_m_per_s = self.entry.needed(key, Some(*speed), "speeds of the head, m/s")?;
            let reading = Reading::DeflectionAtSpeed { window, speed_m_per_s, width_relative };
            Ok(Part { suffix: Some(format!("at {speed} m/s")), reading, stage: When::Always })
        };
        speeds.iter().map(part).collect()
    }

    /// The part of a stroke in which a speed is looked for: `part` of the reversal, or a window.
    fn stroke(&self) -> Result<Window, Refusal> {
        let written = self.written;
        match (written.part.as_deref(), written.window.as_deref()) {
            (Some(part @ ("before" | "after")), None) => {
                let reversal = self.reversal()?;
                Window::parse(&format!("{part}[{reversal}]"))
                    .or_else(|error| refuse(self.entry.key("part"), error.to_string()))
            }
            (Some(part), None) => refuse(
                self.entry.key("part"),
                format!("found \"{part}\", expected \"before\" or \"after\" (the flip)"),
            ),
            (None, window @ Some(_)) if written.reversal.is_none() => self.entry.window(window),
            (None, Some(_)) => refuse(
                self.entry.key("reversal"),
                "has no meaning beside `window`; write it into the window, such as \"after[2]\"",
            ),
            _ => refuse(
                self.entry.key("part"),
                "expected either `part` = \"before\" or \"after\" (the flip), or `window`; give one of them",
            ),
        }
    }

    fn width_relative(&self) -> Result<f64, Refusal> {
        let width = self.written.width_relative.unwrap_or(WIDTH_RELATIVE);
        if width > 0.0 && width <= WIDEST_RELATIVE {
            return Ok(width);
        }
        refuse(
            self.entry.key("width_relative"),
            format!(
                "found {width}, expected above 0 and at most {WIDEST_RELATIVE}: 0.15 takes speeds within 15 %"
            ),
        )
    }

    fn log_spectrum(&self) -> Result<Vec<Part>, Refusal> {
        let band = self.band()?;
        let lines = self.written.lines.unwrap_or(LINES);
        if !(2..=MOST_PARTS).contains(&lines) {
            return refuse(
                self.entry.key("lines"),
                format!("found {lines}, expected 2 to {MOST_PARTS} lines of equal width in the band"),
            );
        }
        let advice = "the rms of the noise in one line, m: the noise of the channel times the square root of 2 x width of a line / frame rate";
        let floor_m = self.entry.needed("floor_m", self.written.floor_m, advice)?;
        let line = |(low, high): (f64, f64)| {
            let reading = Reading::BandLevel { band: Band { band_hz: (low, high), ..band.clone() }, floor_m };
            Part { suffix: Some(format!("at {:.1} Hz", (low + high) / 2.0)), reading, stage: When::Last }
        };
        Ok(equal_lines(band.band_hz, lines).map(line).collect())
    }
}

/// Lines of equal width: in the logarithm where the band spans more than an octave.
fn equal_lines((low, high): (f64, f64), lines: usize) -> impl Iterator<Item = (f64, f64)> {
    let share = move |k: usize| k as f64 / lines as f64;
    let edge = move |k: usize| {
        if low > 0.0 && high > 2.0 * low {
            low * (high / low).powf(share(k))
        } else {
            low + share(k) * (high - low)
        }
    };
    (0..lines).map(move |k| (edge(k), edge(k + 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_have_equal_ratios_over_an_octave_and_equal_differences_within_one() {
        assert_eq!(
            equal_lines((100.0, 200.0), 4).collect::<Vec<_>>(),
            [(100.0, 125.0), (125.0, 150.0), (150.0, 175.0), (175.0, 200.0)]
        );
        let wide: Vec<_> = equal_lines((100.0, 800.0), 3).collect();
        for (found, expected) in wide.iter().zip([(100.0, 200.0), (200.0, 400.0), (400.0, 800.0)]) {
            assert!((found.0 - expected.0).abs() < 1e-9 && (found.1 - expected.1).abs() < 1e-9, "{wide:?}");
        }
        assert_eq!(equal_lines((0.0, 30.0), 3).last(), Some((20.0, 30.0)), "no logarithm of 0");
    }
}
