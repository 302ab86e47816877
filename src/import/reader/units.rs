//! Units of times and coordinates, by the names that files give them.

use crate::import::options::CoordinateScale;

/// Unit of a file's times.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum TimeUnit {
    /// Lengths of this many seconds.
    Seconds(f64),
    /// Seconds, as in nearly every table.
    #[default]
    AssumedSeconds,
    /// The format has several and the file does not say which.
    Unknown,
}

impl TimeUnit {
    /// The unit of that name in a file: `s`, `sec`, `ms`, ...; `None` for any other.
    pub(crate) fn parse(name: &str) -> Option<Self> {
        let seconds = match name.trim().trim_matches(['(', ')', '[', ']']).to_lowercase().as_str() {
            "s" | "sec" | "secs" | "second" | "seconds" => 1.0,
            "ms" | "msec" | "millisecond" | "milliseconds" => 1e-3,
            "min" | "minute" | "minutes" => 60.0,
            "us" | "usec" | "\u{b5}s" | "\u{3bc}s" | "microsecond" | "microseconds" => 1e-6,
            "ns" | "nsec" | "nanosecond" | "nanoseconds" => 1e-9,
            _ => return None,
        };
        Some(Self::Seconds(seconds))
    }
}

/// What one unit of the file's coordinates is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum CoordinateUnit {
    /// A pixel of unknown size.
    Pixel,
    /// A length, m.
    Metres(f64),
}

impl CoordinateUnit {
    /// The unit of that name in a file: `px`, `pixel`, `mm`, `micron`, ...; `None` for any other.
    pub(crate) fn parse(name: &str) -> Option<Self> {
        let name = name.trim().trim_matches(['(', ')', '[', ']']).to_lowercase();
        match name.as_str() {
            "px" | "pixel" | "pixels" => Some(Self::Pixel),
            "micron" | "microns" | "micrometer" | "micrometre" => Some(Self::Metres(1e-6)),
            "inch" | "in" => Some(Self::Metres(0.0254)),
            name => CoordinateScale::parse(name).ok().map(|scale| Self::Metres(scale.metres())),
        }
    }

    pub(crate) fn describe(self) -> String {
        match self {
            Self::Pixel => "pixels".to_owned(),
            Self::Metres(metres) => format!("units of {metres} m"),
        }
    }
}
