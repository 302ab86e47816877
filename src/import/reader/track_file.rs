//! The contents of an imported file: clocks (frame numbers and times of the rows), tracks (positions of
//! points), and facts such as units.

use super::Document;
use crate::import::error::TextLocation;
use crate::import::reader::column::{CoordinateUnit, TimeUnit};
use crate::import::reader::table::DelimitedTable;
use crate::import::source::base_name;
use crate::recording::clock::FrameFit;
use crate::recording::files::YAxis;
use crate::recording::quality::QualityFinding;
use std::borrow::Cow;
use std::cell::OnceCell;

/// Frame number and time of every row of one or more tracks.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Clock {
    /// Line number of every row in the file, counted from 1.
    pub lines: Vec<u32>,
    /// Index in each row of the cell with the frame number or the time; messages use it to name the place.
    pub cell: usize,
    /// Frame numbers, if the file has them.
    pub frame: Option<Column>,
    /// Times in the unit of [`Facts::time`], if the file has them.
    pub time: Option<Column>,
    /// Value of one unit in the last written digit of the times, in their unit; 0 if it is not known.
    pub digit: f64,
    /// What the times show, each computed on first use: whether they lie on no grid, the grid that fits them
    /// from their median step, and the step to which they are rounded, s.
    pub uneven: OnceCell<bool>,
    pub fit: OnceCell<Option<FrameFit>>,
    pub quantum_s: OnceCell<Option<f64>>,
}

/// Converts line numbers to `u32`, the type in which [`Clock`] stores them.
pub(crate) fn clock_lines(lines: impl IntoIterator<Item = usize>) -> Vec<u32> {
    lines.into_iter().map(|line| u32::try_from(line).unwrap_or(u32::MAX)).collect()
}

impl Clock {
    /// The times that are not missing.
    pub(crate) fn times(&self) -> Cow<'_, [f64]> {
        match &self.time {
            Some(Column(times)) if !times.iter().any(|time| time.is_nan()) => Cow::Borrowed(times),
            times => Cow::Owned(times.iter().flat_map(Column::iter).flatten().collect()),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.lines.len()
    }

    pub(crate) fn line_number(&self, row: usize) -> usize {
        self.lines.get(row).map_or(1, |line| *line as usize)
    }
}

/// Positions of a point in the rows of its clock.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Track {
    pub name: String,
    /// Index of the track's clock in [`TrackFile::clocks`].
    pub clock: usize,
    pub x: Column,
    pub y: Option<Column>,
    pub confidence: Option<Column>,
    /// Units of x and y, where the header states them.
    pub units: [Fact<CoordinateUnit>; 2],
}

/// A fact, and a text on where it was found; `None` if the fact is unknown.
pub(crate) type Fact<T> = Option<(T, String)>;

/// Facts that the file or the documentation of its format gives. The user has to give the facts that are
/// missing.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Facts {
    pub y_axis: Fact<YAxis>,
    /// Text on what the direction of y depends on, if the format does not fix it. The text is part of the
    /// message that asks the user.
    pub y_axis_open: Option<&'static str>,
    /// Unit of all coordinates, which the file or the documentation of its format gives.
    pub unit: Fact<CoordinateUnit>,
    /// Rate at which the camera recorded, 1/s. A rate that may be the playback rate is not stored here.
    pub frame_rate_hz: Fact<f64>,
    /// Exposure time of a frame, s.
    pub exposure_s: Fact<f64>,
    /// Unit of the times.
    pub time: TimeUnit,
}

impl Facts {
    /// Facts for coordinates in image pixels with y downwards; `why` is the text on where both facts were
    /// found.
    pub(crate) fn pixels_down(why: &str) -> Self {
        let unit = Some((CoordinateUnit::Pixel, why.to_owned()));
        Self { y_axis: Some((YAxis::Down, why.to_owned())), unit, ..Self::default() }
    }
}

/// Clocks and tracks of a file, in the units of the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct TrackFile<'a> {
    pub file: &'a str,
    pub stem: &'a str,
    /// The table from which the clocks were read; `None` if the file is not one table, such as XML.
    pub table: Option<&'a DelimitedTable<'a>>,
    pub clocks: Vec<Clock>,
    pub tracks: Vec<Track>,
    pub facts: Facts,
    pub notes: Vec<String>,
    pub findings: Vec<QualityFinding>,
    /// Names and titles in the file, which are searched for the word that marks simulated data.
    pub texts: Vec<String>,
}

impl<'a> TrackFile<'a> {
    pub(crate) fn for_document(document: &Document<'a>) -> Self {
        Self { file: document.file, stem: document.stem, ..Self::default() }
    }

    pub(crate) fn file_name(&self) -> &str {
        base_name(self.file)
    }

    /// Place in the file of the frame number or time of a row.
    pub(crate) fn row_location(&self, clock: &Clock, row: usize) -> TextLocation {
        let line = clock.line_number(row);
        let column = self.table.map_or(1, |table| table.text_column(line, clock.cell));
        TextLocation { file: self.file.to_owned(), line, column }
    }
}

/// Converts numbers from a unit of the given length. 1e-3 is not exact in binary: multiplying by it rounds
/// twice, dividing by 1000 rounds once.
pub(crate) fn convert_numbers<'n>(numbers: impl Iterator<Item = &'n mut f64>, unit: f64) {
    let parts = (1.0 / unit).round();
    if unit < 1.0 && unit == 1.0 / parts {
        numbers.for_each(|number| *number /= parts);
    } else {
        numbers.for_each(|number| *number *= unit);
    }
}

/// Numbers of a column of a table. A missing number is stored as NaN and returned as `None`.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Column(Vec<f64>);

impl Column {
    pub(crate) fn push(&mut self, value: Option<f64>) {
        self.0.push(value.unwrap_or(f64::NAN));
    }

    pub(crate) fn get(&self, row: usize) -> Option<f64> {
        self.0.get(row).copied().filter(|value| !value.is_nan())
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Option<f64>> {
        self.0.iter().map(|value| Some(*value).filter(|value| !value.is_nan()))
    }

    /// Converts all numbers from a unit of the given length.
    pub(crate) fn convert_unit(&mut self, unit: f64) {
        convert_numbers(self.0.iter_mut(), unit);
    }

    pub(crate) fn has_values(&self) -> bool {
        self.0.iter().any(|value| !value.is_nan())
    }

    /// The numbers in another order: the new number i is the old number `order[i]`.
    pub(crate) fn reorder(&self, order: &[usize]) -> Self {
        Self(order.iter().filter_map(|row| self.0.get(*row).copied()).collect())
    }
}

impl FromIterator<Option<f64>> for Column {
    fn from_iter<I: IntoIterator<Item = Option<f64>>>(values: I) -> Self {
        Self(values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect())
    }
}
