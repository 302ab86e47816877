//! Reads TRC files, the tables of markers of motion-capture programs. They have lines of settings, and then
//! the names of the markers, each above three columns.

use crate::import::error::{ImportError, ImportResult, TextLocation};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::rate::RATE_AGREEMENT;
use crate::import::reader::{
    CellNumber, Column, CoordinateUnit, DelimitedTable, Document, Facts, PointCells, TableLayout, TextRow,
    TimeUnit, TrackFile, new_finding,
};
use crate::recording::quality::{Check, QualityFinding, Severity};

/// First word of the file.
const MAGIC: &str = "PathFileType";
/// Number of columns for frame number and time, s; they are the first columns.
const CLOCK_CELLS: usize = 2;
/// Number of columns of a marker: X, Y and Z.
const AXES: usize = 3;
/// Names of units of length in full, with their symbols.
const LONG_UNITS: [(&str, &str); 4] =
    [("millimeters", "mm"), ("centimeters", "cm"), ("meters", "m"), ("metres", "m")];

pub(crate) struct Trc;

impl FileFormat for Trc {
    fn name(&self) -> &'static str {
        "trc"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let first = document.table.as_ref().ok()?.head.first()?;
        (first.first_cell() == MAGIC).then(|| format!("line {} starts with {MAGIC}", first.line))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let settings = TrcSettings::read(table)?;
        let (start, points) = settings.marker_columns(table)?;
        let width = CLOCK_CELLS + AXES * points.len();
        let layout = TableLayout::new(start, width, points);
        let layout = TableLayout { frame: Some(0), time: Some(1), ..layout };
        let mut export = layout.read_tracks(document, table, settings.facts())?;
        settings.check_rows(&export)?;
        export.notes.push(
            "x and y of the markers are taken and z is left out; for another plane number the columns, e.g. \
             --columns frame=1,tip-x=3,tip-y=5"
                .to_owned(),
        );
        export.findings.extend(settings.resampling_finding());
        Ok(export)
    }
}

/// The settings of a TRC file: line 2 contains their names, line 3 their values.
struct TrcSettings<'t> {
    table: &'t DelimitedTable<'t>,
    names: &'t TextRow,
    values: &'t TextRow,
    /// Index in `DelimitedTable::head` of the row with the names of the markers.
    markers: usize,
}

impl<'t> TrcSettings<'t> {
    fn read(table: &'t DelimitedTable<'t>) -> ImportResult<Self> {
        let found = table.find_row(usize::MAX, |row| row.has("DataRate"));
        let found = found.and_then(|(at, names)| Some((at + 2, names, table.head.get(at + 1)?)));
        let Some((markers, names, values)) = found else {
            let expected = "DataRate, CameraRate, NumFrames, NumMarkers and Units in line 2";
            return Err(settings_error(table.location(2, 1), "no line of settings with DataRate", expected));
        };
        Ok(Self { table, names, values, markers })
    }

    /// Text and place of the setting `name`; `None` if it is missing or empty.
    fn setting(&self, name: &str) -> Option<(&'t str, TextLocation)> {
        let at = self.names.position(name)?;
        let text = self.values.cells.get(at).filter(|text| !text.is_empty())?;
        Some((text, self.table.cell_location(self.values.line, at)))
    }

    /// Value and place of a setting that must be a number above 0.
    fn positive_setting(&self, name: &str) -> ImportResult<(f64, TextLocation)> {
        let (text, place) =
            self.setting(name).unwrap_or_else(|| ("", self.table.location(self.values.line, 1)));
        if let CellNumber::Value(value) = self.table.parse_cell(text)
            && value > 0.0
        {
            return Ok((value, place));
        }
        let found = format!("{name} `{}`", text.chars().take(40).collect::<String>());
        Err(settings_error(place, &found, "a number above 0"))
    }

    /// Index of the first row of data, and the columns of x and y of every marker.
    fn marker_columns(&self, table: &DelimitedTable) -> ImportResult<(usize, Vec<PointCells>)> {
        let row = table.head.get(self.markers);
        let line = row.map_or(self.values.line, |row| row.line);
        let texts = row.map(TextRow::texts).unwrap_or_default();
        if !texts.first().is_some_and(|name| name.to_lowercase().starts_with("frame")) {
            let found = format!("`{}`", texts.join(" ").chars().take(60).collect::<String>());
            let expected = "Frame#, Time and the names of the markers";
            return Err(settings_error(table.location(line, 1), &found, expected));
        }
        let names: Vec<(usize, &str)> =
            texts.into_iter().enumerate().skip(CLOCK_CELLS).filter(|(_, name)| !name.is_empty()).collect();
        let misplaced = |(index, (at, _)): &(usize, &(usize, &str))| *at != CLOCK_CELLS + AXES * index;
        if let Some((_, (at, name))) = names.iter().enumerate().find(misplaced) {
            let found = format!("the marker `{name}` in column {}", at + 1);
            let expected = "a marker over every third column from the third on";
            return Err(settings_error(table.cell_location(line, *at), &found, expected));
        }
        let (count, place) = self.positive_setting("NumMarkers")?;
        if count != names.len() as f64 {
            let found = format!("NumMarkers {count}, but {} names in line {line}", names.len());
            return Err(settings_error(place, &found, "as many as there are markers"));
        }
        let start = table.first_numeric_row(self.markers + 1, &[0]);
        let start = start.ok_or_else(|| ImportError::header_only(table.file, line))?;
        Ok((start, names.into_iter().map(|(at, name)| PointCells::new(name, at, Some(at + 1))).collect()))
    }

    fn facts(&self) -> Facts {
        let unit = self.setting("Units").and_then(|(text, place)| {
            let long = text.to_lowercase();
            let short = LONG_UNITS.iter().find(|unit| unit.0 == long).map_or(text, |unit| unit.1);
            Some((CoordinateUnit::parse(short)?, format!("{place} says Units {text}")))
        });
        let camera = self.positive_setting("CameraRate").or_else(|_| self.positive_setting("DataRate")).ok();
        // (the rate of the rows, DataRate, is used; it differs from the camera's rate if the rows were
        // resampled)
        let rows = self.positive_setting("DataRate").ok();
        let frame_rate_hz = rows.or(camera).map(|(rate, place)| (rate, format!("the settings in {place}")));
        Facts { unit, frame_rate_hz, time: TimeUnit::Seconds(1.0), ..Facts::default() }
    }

    /// Refuses a file whose settings (number of frames, rate) contradict its rows.
    fn check_rows(&self, export: &TrackFile) -> ImportResult<()> {
        let Some(clock) = export.clocks.first() else { return Ok(()) };
        let (frames, place) = self.positive_setting("NumFrames")?;
        if frames != clock.len() as f64 {
            let found = format!("NumFrames {frames}, but {} rows", clock.len());
            let expected = "as many rows as frames: the file was cut or joined";
            return Err(settings_error(place, &found, expected));
        }
        let (rate_hz, place) = self.positive_setting("DataRate")?;
        let span = |column: &Column| Some(column.get(clock.len().checked_sub(1)?)? - column.get(0)?);
        let spans = clock.frame.as_ref().and_then(span).zip(clock.time.as_ref().and_then(span));
        let implied_hz = spans.map(|(frames, seconds)| frames / seconds);
        match implied_hz.filter(|rate| rate.is_finite() && (rate / rate_hz - 1.0).abs() > RATE_AGREEMENT) {
            Some(implied) => {
                let found = format!("DataRate {rate_hz}, but times that imply {implied:.6} frames/s");
                Err(settings_error(place, &found, "one rate"))
            }
            None => Ok(()),
        }
    }

    /// Finding about rows whose rate differs from the camera's rate, because they were resampled.
    fn resampling_finding(&self) -> Option<QualityFinding> {
        let (camera_hz, place) = self.positive_setting("CameraRate").ok()?;
        let (rate_hz, _) = self.positive_setting("DataRate").ok()?;
        let found = format!(
            "{place}: the camera ran at {camera_hz} frames/s, but the rows are {rate_hz} a second: they were \
             resampled"
        );
        let advice =
            "export the rows as they were recorded: resampling filters or folds what lies above its rate";
        ((camera_hz / rate_hz - 1.0).abs() > RATE_AGREEMENT)
            .then(|| new_finding(Check::Resampled, Severity::Caution, (camera_hz, "1/s"), found, advice))
    }
}

fn settings_error(place: TextLocation, found: &str, expected: &str) -> ImportError {
    let advice = "export the TRC file again from the program that tracked the markers, or number the columns with \
        --columns";
    ImportError::wrong_table(place, found, expected, advice)
}
