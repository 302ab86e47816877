//! What a format makes of a file: clocks, tracks, and what the file itself says of its units.

use super::error::Place;
use super::options::Scale;
use super::table::Table;
use crate::recording::files::YAxis;
use crate::recording::quality::Finding;

/// Numbers of a column; a missing one is kept as NaN inside and is `None` outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Column(Vec<f64>);

impl Column {
    pub(super) fn push(&mut self, value: Option<f64>) {
        self.0.push(value.unwrap_or(f64::NAN));
    }

    pub(super) fn get(&self, row: usize) -> Option<f64> {
        self.0.get(row).copied().filter(|value| !value.is_nan())
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = Option<f64>> {
        self.0.iter().map(|value| Some(*value).filter(|value| !value.is_nan()))
    }

    pub(super) fn scale(&mut self, factor: f64) {
        self.0.iter_mut().for_each(|value| *value *= factor);
    }

    pub(super) fn divide(&mut self, divisor: f64) {
        self.0.iter_mut().for_each(|value| *value /= divisor);
    }

    pub(super) fn has_any(&self) -> bool {
        self.0.iter().any(|value| !value.is_nan())
    }

    /// The rows in the order of `order`.
    pub(super) fn reordered(&self, order: &[usize]) -> Self {
        Self(order.iter().filter_map(|row| self.0.get(*row).copied()).collect())
    }
}

impl FromIterator<Option<f64>> for Column {
    fn from_iter<I: IntoIterator<Item = Option<f64>>>(values: I) -> Self {
        Self(values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect())
    }
}

/// When the rows of some tracks were taken, and where they say so.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Clock {
    /// 1-based line of every row.
    pub lines: Vec<u32>,
    /// Index of the cell that holds frame or time, for messages.
    pub cell: usize,
    /// Frame numbers, where the file has them.
    pub frame: Option<Column>,
    /// Times, where the file has them, in the unit of [`Says::time`].
    pub time: Option<Column>,
}

impl Clock {
    pub(super) fn len(&self) -> usize {
        self.lines.len()
    }

    pub(super) fn line(&self, row: usize) -> usize {
        self.lines.get(row).map_or(1, |line| *line as usize)
    }
}

/// A point over the rows of its clock.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Track {
    pub name: String,
    /// Index of its clock.
    pub clock: usize,
    pub x: Column,
    pub y: Option<Column>,
    pub confidence: Option<Column>,
}

/// Unit of a file's times.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum TimeUnit {
    /// Lengths of this many seconds.
    Seconds(f64),
    /// Seconds where nothing else is said, as nearly every table has them.
    #[default]
    Usual,
    /// The format has several and the file does not say which.
    Unknown,
}

impl TimeUnit {
    /// The unit of that name in a file: `s`, `sec`, `ms`, ...; `None` for any other.
    pub(super) fn named(name: &str) -> Option<Self> {
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

/// A fact and where it stands, in words.
pub(super) type Said<T> = Option<(T, String)>;

/// What the file, or the documentation of its format, fixes. Whatever is not said here the user must say.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Says {
    /// Direction of y.
    pub y_axis: Said<YAxis>,
    /// What decides the direction of y where the format leaves it open: said when it is asked for.
    pub y_axis_open: Option<&'static str>,
    /// Length unit of the coordinates.
    pub unit: Said<Unit>,
    /// Rate at which the camera recorded, frames/s; never a rate that may be that of playback.
    pub frame_rate_hz: Said<f64>,
    /// Unit of the times.
    pub time: TimeUnit,
}

/// What one unit of the file's coordinates is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unit {
    /// A pixel of unknown size.
    Pixel,
    /// A length, m.
    Metres(f64),
}

impl Unit {
    /// The unit of that name in a file: `px`, `pixel`, `mm`, `micron`, ...; `None` for any other.
    pub(super) fn named(name: &str) -> Option<Self> {
        let name = name.trim().trim_matches(['(', ')', '[', ']']).to_lowercase();
        match name.as_str() {
            "px" | "pixel" | "pixels" => Some(Self::Pixel),
            "micron" | "microns" | "micrometer" | "micrometre" => Some(Self::Metres(1e-6)),
            "inch" | "in" => Some(Self::Metres(0.0254)),
            name => Scale::parse(name).ok().map(|scale| Self::Metres(scale.metres())),
        }
    }

    pub(super) fn word(self) -> String {
        match self {
            Self::Pixel => "pixels".to_owned(),
            Self::Metres(metres) => format!("units of {metres} m"),
        }
    }
}

/// Rows and tracks of a file, in its own units.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Export<'a> {
    pub file: &'a str,
    pub stem: &'a str,
    /// The table that the lines of the clocks belong to, where it is one.
    pub table: Option<&'a Table<'a>>,
    pub clocks: Vec<Clock>,
    pub tracks: Vec<Track>,
    pub says: Says,
    pub notes: Vec<String>,
    pub findings: Vec<Finding>,
    /// Names and titles, searched for the mark of synthetic data.
    pub texts: Vec<String>,
}

impl Export<'_> {
    /// Last part of the file's path.
    pub(super) fn base(&self) -> &str {
        super::base_name(self.file)
    }

    /// Where a row says its frame or time.
    pub(super) fn place(&self, clock: &Clock, row: usize) -> Place {
        let line = clock.line(row);
        let column = self.table.map_or(1, |table| table.column(line, clock.cell));
        Place { file: self.file.to_owned(), line, column }
    }
}
