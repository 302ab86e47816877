//! What a format makes of a file: clocks, tracks, and what the file itself says of its units.

use crate::import::error::TextLocation;
use crate::import::reader::column::Column;
use crate::import::reader::document::Document;
use crate::import::reader::table::DelimitedTable;
use crate::import::reader::units::{CoordinateUnit, TimeUnit};
use crate::import::source::base_name;
use crate::recording::files::YAxis;
use crate::recording::quality::QualityFinding;

/// When the rows of some tracks were taken, and where they say so.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Clock {
    /// 1-based line of every row.
    pub lines: Vec<u32>,
    /// Index of the cell that holds frame or time, for messages.
    pub cell: usize,
    /// Frame numbers, where the file has them.
    pub frame: Option<Column>,
    /// Times, where the file has them, in the unit of [`Facts::time`].
    pub time: Option<Column>,
}

impl Clock {
    pub(crate) fn len(&self) -> usize {
        self.lines.len()
    }

    pub(crate) fn line_number(&self, row: usize) -> usize {
        self.lines.get(row).map_or(1, |line| *line as usize)
    }
}

/// A point over the rows of its clock.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Track {
    pub name: String,
    /// Index of its clock.
    pub clock: usize,
    pub x: Column,
    pub y: Option<Column>,
    pub confidence: Option<Column>,
}

/// A fact and where it stands, in words.
pub(crate) type Fact<T> = Option<(T, String)>;

/// What the file, or the documentation of its format, fixes. What is missing here the user must give.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Facts {
    /// Direction of y.
    pub y_axis: Fact<YAxis>,
    /// What decides the direction of y where the format leaves it open, for the question.
    pub y_axis_open: Option<&'static str>,
    /// Length unit of the coordinates.
    pub unit: Fact<CoordinateUnit>,
    /// Rate at which the camera recorded, frames/s; never a rate that may be that of playback.
    pub frame_rate_hz: Fact<f64>,
    /// Exposure of a frame, s.
    pub exposure_s: Fact<f64>,
    /// Unit of the times.
    pub time: TimeUnit,
}

impl Facts {
    /// Image pixels with y downwards, and where that stands.
    pub(crate) fn pixels_down(why: &str) -> Self {
        let (y_axis, unit) =
            (Some((YAxis::Down, why.to_owned())), Some((CoordinateUnit::Pixel, why.to_owned())));
        Self { y_axis, unit, ..Self::default() }
    }
}

/// Rows and tracks of a file, in its own units.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct TrackFile<'a> {
    pub file: &'a str,
    pub stem: &'a str,
    /// The table that the lines of the clocks belong to, where it is one.
    pub table: Option<&'a DelimitedTable<'a>>,
    pub clocks: Vec<Clock>,
    pub tracks: Vec<Track>,
    pub facts: Facts,
    pub notes: Vec<String>,
    pub findings: Vec<QualityFinding>,
    /// Names and titles, searched for the mark of synthetic data.
    pub texts: Vec<String>,
}

impl<'a> TrackFile<'a> {
    /// Of a document, without anything in it yet.
    pub(crate) fn for_document(document: &Document<'a>) -> Self {
        Self { file: document.file, stem: document.stem, ..Self::default() }
    }

    /// Last part of the file's path.
    pub(crate) fn file_name(&self) -> &str {
        base_name(self.file)
    }

    /// Where a row says its frame or time.
    pub(crate) fn row_location(&self, clock: &Clock, row: usize) -> TextLocation {
        let line = clock.line_number(row);
        let column = self.table.map_or(1, |table| table.text_column(line, clock.cell));
        TextLocation { file: self.file.to_owned(), line, column }
    }
}
