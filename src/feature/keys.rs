//! The keys of a job's `[[feature]]` and of a study's `[[map]]` that select a reading, and their checks.

use super::spectral::FeatureBand;
use crate::recording::channel::{Channel, Window};
use crate::toml_file::{KeyRefusal, NumberPair, check_above_zero, refuse_key};
use short_spectra::Detrend;

/// Default half width of the range of speeds around a given speed, as a fraction of that speed. Within this
/// range, several cycles of chatter occur, and friction hardly changes.
pub const WIDTH_RELATIVE: f64 = 0.15;
/// Largest allowed half width of the range of speeds around a given speed, as a fraction of that speed.
const WIDEST_RELATIVE: f64 = 0.5;

/// The list of keys from which [`Keys`] and the structs of TOML tables are made.
macro_rules! with_reading_keys {
    ($define:ident { $($own:tt)* }) => {
        $define! {
            { $($own)* }
            #[doc = "Channel: \"deflection\", \"head-drop\", \"tip-x\" or \"head-x\"."] channel: String,
            #[doc = "Frames from which it is read."] window: String,
            #[doc = "Lowest and highest frequency, Hz."] band_hz: NumberPair,
            #[doc = "What is removed first."] detrend: String,
            #[doc = "Amplitude below which nothing counts, m."] least_amplitude_m: f64,
            #[doc = "Number of the reversal, counted from 1; 1 if left out."] reversal: usize,
            #[doc = "Length of a segment, s."] segment_s: f64,
            #[doc = "Speed of the head, m/s."] speed_m_per_s: f64,
            #[doc = "Speeds of the head, m/s."] speeds_m_per_s: Vec<f64>,
            #[doc = "Relative half width of the speeds that count as one; 0.15 if left out."] width_relative: f64,
            #[doc = "Which part of the stroke, \"before\" or \"after\" the flip."] part: String,
            #[doc = "Number of lines."] lines: usize,
            #[doc = "Added to the rms of each line in quadrature, m."] floor_m: f64
        }
    };
}

macro_rules! define_keys {
    ({} $(#[doc = $doc:literal] $key:ident: $type:ty),*) => {
        /// The keys of an entry that select a reading.
        #[derive(Debug, Default)]
        pub struct Keys { $(pub $key: Option<$type>),* }

        impl Keys {
            /// Names of the keys that the entry has.
            fn given_keys(&self) -> impl Iterator<Item = &'static str> {
                let keys = [$(self.$key.is_some().then_some(stringify!($key))),*];
                keys.into_iter().flatten()
            }
        }
    };
}
with_reading_keys!(define_keys {});

/// Defines the struct of a TOML table with a `kind`, keys of its own and the keys of a reading.
macro_rules! define_entry {
    ({ $meaning:literal $name:ident { $(#[doc = $own_doc:literal] $own:ident: $own_type:ty),* $(,)? } }
     $(#[doc = $doc:literal] $key:ident: $type:ty),*) => {
        #[doc = $meaning]
        #[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Kind of the reading.
            pub kind: String,
            $(#[doc = $own_doc] pub $own: $own_type,)*
            $(#[doc = $doc] pub $key: Option<$type>),*
        }

        impl $name {
            pub fn keys(&self) -> crate::feature::Keys {
                crate::feature::Keys { $($key: self.$key.clone()),* }
            }
        }
    };
}
pub(crate) use {define_entry, with_reading_keys};

/// An entry of a file that selects a reading.
pub struct ReadingEntry<'a> {
    /// Name of the entry in messages: "feature `x` (rms)".
    pub name: &'a str,
    /// Name of the table in the file: `feature` or `map`.
    pub noun: &'a str,
    /// The keys of the entry.
    pub keys: &'a Keys,
    /// Half the frame rate of the camera, Hz, if known.
    pub nyquist_hz: Option<f64>,
    /// Whether the recording may have noise.
    pub noisy: bool,
}

impl ReadingEntry<'_> {
    /// Name of a key in messages: "feature `x` (rms), `window`".
    pub(crate) fn describe_key(&self, key: &str) -> String {
        format!("{}, `{key}`", self.name)
    }

    pub(super) fn refuse<T>(&self, key: &str, problem: impl Into<String>) -> Result<T, KeyRefusal> {
        refuse_key(self.describe_key(key), problem)
    }

    /// Checks that the entry has only keys from `known`, which lists the keys that have a meaning for this
    /// kind of reading.
    pub(crate) fn check_keys(&self, known: &[&str]) -> Result<(), KeyRefusal> {
        let Some(key) = self.keys.given_keys().find(|key| !known.contains(key)) else { return Ok(()) };
        let takes = if known.is_empty() { "none of its own".to_owned() } else { known.join(", ") };
        self.refuse(
            key,
            format!("has no meaning for this kind of {}, which takes {takes}; remove it", self.noun),
        )
    }

    /// The value of a required key, which must be above 0.
    pub(crate) fn require_positive(
        &self,
        key: &str,
        found: Option<f64>,
        expected: &str,
    ) -> Result<f64, KeyRefusal> {
        match found {
            Some(found) => check_above_zero(self.describe_key(key), found),
            None => self.refuse(key, format!("missing; expected {expected}")),
        }
    }

    pub(crate) fn parse_window(&self) -> Result<Window, KeyRefusal> {
        match self.window_if_given()? {
            Some(window) => Ok(window),
            None => {
                self.refuse("window", "missing; expected a window such as \"release+0.02..release+0.20\"")
            }
        }
    }

    /// The window; if none is given, the whole run.
    pub(crate) fn window_or_whole(&self) -> Result<Window, KeyRefusal> {
        Ok(self.window_if_given()?.unwrap_or(Window::WHOLE))
    }

    fn window_if_given(&self) -> Result<Option<Window>, KeyRefusal> {
        let parse =
            |text: &String| Window::parse(text).or_else(|error| self.refuse("window", error.to_string()));
        self.keys.window.as_ref().map(parse).transpose()
    }

    pub(crate) fn parse_band(&self) -> Result<FeatureBand, KeyRefusal> {
        match &self.keys.channel {
            Some(channel) => self.parse_band_of_channel(channel),
            None => self.refuse(
                "channel",
                format!("missing; expected one of {}", Channel::ALL.map(Channel::name).join(", ")),
            ),
        }
    }

    /// The band; its channel is the deflection unless another one is given.
    pub(crate) fn band_of_deflection(&self) -> Result<FeatureBand, KeyRefusal> {
        self.parse_band_of_channel(self.keys.channel.as_deref().unwrap_or(Channel::Deflection.name()))
    }

    fn parse_band_of_channel(&self, channel: &str) -> Result<FeatureBand, KeyRefusal> {
        let channel = Channel::parse(channel).or_else(|error| self.refuse("channel", error.to_string()))?;
        let band_hz = self.band_hz()?;
        let detrend = self.keys.detrend.as_deref().map_or(Ok(Detrend::default()), Detrend::parse);
        let detrend = detrend.or_else(|error| self.refuse("detrend", error.to_string()))?;
        let least_amplitude_m = self.least_amplitude_m()?;
        Ok(FeatureBand { channel, window: self.parse_window()?, band_hz, detrend, least_amplitude_m })
    }

    fn band_hz(&self) -> Result<(f64, f64), KeyRefusal> {
        let Some(NumberPair([low, high])) = self.keys.band_hz else {
            return self.refuse("band_hz", "missing; expected [lowest, highest] frequency");
        };
        let expected = match self.nyquist_hz {
            _ if !(low.is_finite() && high.is_finite() && 0.0 <= low && low < high) => {
                "0 <= lowest < highest; exchange or correct them".to_owned()
            }
            Some(nyquist) if high > nyquist => format!(
                "at most half the camera's frame rate, {nyquist} Hz; lower the band or raise \
                 camera.frame_rate_hz"
            ),
            _ => return Ok((low, high)),
        };
        self.refuse("band_hz", format!("found [{low}, {high}], expected {expected}"))
    }

    fn least_amplitude_m(&self) -> Result<f64, KeyRefusal> {
        let least_m = self.keys.least_amplitude_m.unwrap_or(0.0);
        if least_m.is_finite() && least_m >= 0.0 {
            return Ok(least_m);
        }
        self.refuse(
            "least_amplitude_m",
            format!("found {least_m}, expected a finite number of 0 or more, in m"),
        )
    }

    /// Number of a reversal, counted from 1.
    pub(crate) fn reversal_number(&self) -> Result<usize, KeyRefusal> {
        match self.keys.reversal {
            Some(0) => self.refuse("reversal", "found 0, expected 1 or more: the first reversal is 1"),
            reversal => Ok(reversal.unwrap_or(1)),
        }
    }

    /// The window whose frames are searched for a speed of the head. It is given by the key `part` (before or
    /// after the flip of a reversal) or by the key `window`.
    pub(crate) fn stroke_window(&self) -> Result<Window, KeyRefusal> {
        match (self.keys.part.as_deref(), &self.keys.window) {
            (Some(part @ ("before" | "after")), None) => {
                Window::parse(&format!("{part}[{}]", self.reversal_number()?))
                    .or_else(|error| self.refuse("part", error.to_string()))
            }
            (Some(part), None) => {
                self.refuse("part", format!("found \"{part}\", expected \"before\" or \"after\" (the flip)"))
            }
            (None, Some(_)) if self.keys.reversal.is_none() => self.parse_window(),
            (None, Some(_)) => self.refuse(
                "reversal",
                "has no meaning together with `window`; write it into the window, such as \"after[2]\"",
            ),
            _ => self.refuse(
                "part",
                "expected either `part` = \"before\" or \"after\" (the flip), or `window`; give one of them",
            ),
        }
    }

    pub(crate) fn width_relative(&self) -> Result<f64, KeyRefusal> {
        let width = self.keys.width_relative.unwrap_or(WIDTH_RELATIVE);
        if width > 0.0 && width <= WIDEST_RELATIVE {
            return Ok(width);
        }
        self.refuse(
            "width_relative",
            format!(
                "found {width}, expected above 0 and at most {WIDEST_RELATIVE}: 0.15 takes speeds within 15 %"
            ),
        )
    }
}
